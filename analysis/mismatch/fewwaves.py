"""A field of gains that few frequencies make: a wave that stands still is no random field."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.bank.peaks import white_level
from analysis.mismatch.bank.standing import NAME
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.fewpatches import gains_for, unlike_drawn, white_of
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu

Array = NDArray[np.float64]
_GROUP = 64  # bins of much the same power: a bent wave is in fewer than half of them


def of_few_waves(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by a wave that makes most of it; None: it is not.

    Power of a random field scatters about its spectrum as exponential variates do: of bins where
    the spectrum is much the same the median tells the mean, whatever few of them have. Where a wave
    stands still unexplained, and medians tell half or less of the field that means do, far less
    than of fields of this spectrum ever, most frequencies have no such gain.
    """
    image = gains_for(state, effect)
    if image is None or not isinstance(effect, SmoothPrnu):
        return None
    if all(m.statistic != NAME for m in state.mismatches):
        return None
    why = "a wave that stands still makes most of it, as no field of gains is made"
    return unlike_drawn(image, effect, _of_most_bins, why)


def _of_most_bins(image: Array, field: Array) -> float:
    """Return the share of the field's power that is in most bins of each group of them.

    Means of lines have none: they were taken off.
    """
    power = (np.abs(fft.rfft2(image)) ** 2 / image.size)[1:, 1:-1].ravel()
    expected = field[1:, 1:-1].ravel()
    order = np.argsort(-expected)
    white = white_of(image)
    most = plain = 0.0
    for first in range(0, order.size - _GROUP + 1, _GROUP):
        own = order[first : first + _GROUP]
        weight = float(expected[own].mean()) / (float(expected[own].mean()) + white) ** 2
        most += weight * (white_level(power[own], 1) - white)
        plain += weight * (float(power[own].mean()) - white)
    return most / plain if plain > 0 else 1.0
