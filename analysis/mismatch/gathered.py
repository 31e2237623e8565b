"""Noisy pixels that lie side by side: a field of noise, or lines of it, no pixels of their own."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_BLOCK = 8  # pixels a side
_MOST = 0.5  # of how much pixels' variances differ, that those of whole parts may
_SURE = 4.0  # standard deviations
_LEAST_PARTS = 8
_PARTS = {
    "pixels of one place are noisy alike": (_BLOCK, _BLOCK),
    "pixels of one row are noisy alike": (1, None),
    "pixels of one column are noisy alike": (None, 1),
}


def gathered(state: State) -> Denial | None:
    """Return how pixels that differ each by itself are denied by parts that do; None: they are not.

    Relative variances of pixels, summed over exposures, have a mean square beyond chance, e. Of
    pixels that are drawn one by one the mean over m of them has e / m. Where whole blocks, rows or
    columns have half of e or more, for certain, noise is a matter of place; where e, which is known
    less well than that, is none, too. What follows their gain is that of light which falls
    unevenly, and counts for nothing.
    """
    images = state.setting.seen.images
    both = [
        (*own, images.get((channel, "gain"), images.get((channel, "gain alone"))))
        for (channel, name), own in images.items()
        if name == "variance"
    ]
    for why, size in _PARTS.items():
        whole = shared = error = 0.0
        for total, noise, gain in both:
            own = _of_parts(total, noise, None if gain is None else gain[0], size)
            whole, shared, error = whole + own[0], shared + own[1], error + own[2]
        if shared > _MOST * whole and shared > _SURE * error**0.5:
            return Denial(max(1 - shared / max(whole, shared), 0.0), why)
    return None


def _of_parts(
    total: Array, noise: float, gain: Array | None, size: tuple[int | None, int | None]
) -> tuple[float, float, float]:
    """Return a map's mean square beyond chance, that of its parts, and the latter's variance.

    `noise` is the standard deviation of one pixel by chance; a size of None is the map's.
    """
    rows, columns = (own or n for own, n in zip(size, total.shape, strict=True))
    count = (total.shape[0] // rows) * (total.shape[1] // columns)
    if count < _LEAST_PARTS:
        return 0.0, 0.0, 0.0
    parts = _means(total, rows, columns)
    if gain is not None:
        light = _means(gain, rows, columns)
        along = float((light**2).sum())
        parts = parts - light * (float((parts * light).sum()) / along if along > 0 else 0.0)
    every = float(((total - total.mean()) ** 2).mean())
    by_chance = every / (rows * columns)  # if pixels were drawn one by one, whatever their law
    shared = float((parts**2).mean()) - by_chance
    return every - noise**2, shared, 2 * by_chance**2 / count


def _means(image: Array, rows: int, columns: int) -> Array:
    """Return the means over parts of so many rows and columns, less that of all."""
    down, across = image.shape[0] // rows, image.shape[1] // columns
    inside = image[: down * rows, : across * columns]
    parts = inside.reshape(down, rows, across, columns).mean((1, 3))
    return np.asarray(parts - parts.mean())
