"""Bands that move on steadily: no number of a model whose bands have new phases in every frame."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.movingbands import DETAIL
from dsis.camera import Camera
from dsis.effects.line_flicker import LineFlicker


def unknown_advances(camera: Camera, keys: Sequence[Key]) -> NDArray[np.bool_]:
    """Return which numbers say how steadily bands move on, if a camera has them: (number,).

    The effect draws a phase for each frame; a lamp and a shutter may keep their rates.
    """
    if not any(isinstance(effect, LineFlicker) for effect in camera.effect):
        return np.zeros(len(keys), np.bool_)
    return np.array([key.detail == DETAIL for key in keys])
