"""A field of gains that the outermost lines make, whose pixels have fewer neighbours."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
_SURE = 4.0  # standard deviations
_NEAREST, _FARTHEST = 2, 6  # pixels of the sensor
_MOST = 0.5  # of what smooth surfaces explain, that the outermost lines may make


def of_outermost_lines(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by the outermost lines; None: it is not.

    A single line at an edge that is darker than the others pulls polynomials along with it, which
    count most at their ends. A field goes on beyond it: where each outermost line is replaced by
    the next, as much is left. Where less than half of it is, beyond noise, lines of the edge differ
    and no field is seen, unless pixels inside that are no neighbours are alike.
    """
    if not isinstance(effect, SmoothPrnu):
        return None
    whole = inside = 0.0
    maps = [own for (_, name), own in state.setting.seen.images.items() if name == "gain"]
    alike: list[float] = []
    for image, noise in maps:
        own = (image - image.mean()) / noise
        whole += _smooth(own)
        inside += _smooth(np.pad(own[1:-1, 1:-1], 1, mode="edge"))
        alike.append(_alike(own[1:-1, 1:-1], 1 if len(maps) == 1 else 2))
    if whole <= 0 or inside > _MOST * whole or sum(alike) >= _SURE * sqrt(len(alike)):
        return None
    return Denial(max(inside / whole, 0.0), "lines at an edge make most of what is smooth in it")


def _smooth(image: Array) -> float:
    """Return the power of smooth surfaces of a map of unit noise, beyond that noise."""
    coefficients = Smooth.of(*image.shape).coefficients(image)
    order = np.arange(len(coefficients))
    taken = (order[:, np.newaxis] + order > 0) & (order[:, np.newaxis] + order < len(order))
    return float((coefficients[taken] ** 2 - 1).sum())


def _alike(image: Array, step: int) -> float:
    """Return how alike pixels are that lie near each other and are no neighbours, a normal score.

    Beyond lines. What pixels hand to their neighbours ends there. `step`: sensor pixels from one
    of the map to the next.
    """
    own = image - image.mean(0) - image.mean(1, keepdims=True) + image.mean()
    rows, columns = own.shape
    nearest, farthest = _NEAREST // step, _FARTHEST // step
    sizes = [next_fast_len(n + farthest, real=True) for n in own.shape]
    products = irfft2(np.abs(rfft2(own, sizes)) ** 2, sizes)
    lags = [
        (y, x)
        for y in range(1, farthest + 1)  # pixels of one line are a little less alike, by its mean
        for x in range(-farthest, farthest + 1)
        if x != 0 and nearest**2 <= y * y + x * x <= farthest**2
    ]
    pairs = sum(max(rows - y, 0) * max(columns - abs(x), 0) for y, x in lags)
    power = float((own**2).mean()) if own.size else 0.0
    if not (pairs and power > 0):
        return 0.0
    return float(sum(products[lag] for lag in lags)) / (power * sqrt(pairs))
