"""Numbers of order that a model does not tell whose effect draws at random what may be in order."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.codephase import DETAIL as CODE_PHASE
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.movingbands import DETAIL as MOVING_BANDS
from dsis.camera import Camera
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.line_flicker import LineFlicker


def untold_order(camera: Camera, keys: Sequence[Key]) -> NDArray[np.bool_]:
    """Return which numbers say how orderly that is which a camera's effects draw: (number,).

    Bands of light have a new phase in each frame, and may move on steadily; codes have widths of
    their own, and may be wide in step with the weights of bits.
    """
    found = set()
    for effect in camera.effect:
        found |= {MOVING_BANDS} if isinstance(effect, LineFlicker) else set()
        found |= {CODE_PHASE} if isinstance(effect, AdcDnl) else set()
    return np.array([key.detail in found for key in keys], np.bool_)
