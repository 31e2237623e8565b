"""Where two amplifiers' parts of a sensor meet, that are no halves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.clues import Clues

Array = NDArray[np.float64]
_LEAST = 1 / 12  # of the lines: a narrower part is told from a decay by few
_BETTER = 3.0  # of log-likelihood than halves: odds of 20


@dataclass(frozen=True)
class Parts:
    """Two parts of unequal gain.

    Attributes
    ----------
    seam
        Where the second begins, a share of all lines.
    step
        Its gain less that of the first, relative.
    tried
        Places of a seam that were looked at.
    """

    seam: float
    step: float
    tried: int


def unequal_parts(clues: Clues, axis: int) -> Parts | None:
    """Return the likeliest parts, not halves, of rows (axis 0) or columns (1); None: none.

    Means of lines of the gain's maps are fitted by a step at each line in turn, beside smooth
    polynomials; their noise is what those and the step leave. They are told by more than chance
    gains in so many tries, and than a step in the middle gains.
    """
    images = clues.image("gain")
    if not images:
        return None
    size = min(image.shape[axis] for image, _ in images.values())
    first = max(int(np.ceil(_LEAST * size)), 3)
    places = np.arange(first, size - first + 1)
    if places.size < 2:
        return None
    steps = beyond_smooth((np.arange(size)[:, None] >= places).astype(np.float64))
    length = (steps**2).sum(0)
    top, bottom = np.zeros(places.size), np.zeros(places.size)
    for channel, (image, noise) in images.items():
        scale = clues.scale("gain", channel)
        rest = beyond_smooth(image.mean(1 - axis)[:size] / scale)
        moments = rest @ steps
        left = float(np.min(rest @ rest - moments**2 / length)) / size
        weight = 1 / max(left, (noise / scale) ** 2 / image.shape[1 - axis], 1e-18)
        top += weight * moments
        bottom += weight * length
    gains = top**2 / bottom / 2
    best = int(np.argmax(gains))
    middle = gains[np.abs(places - size / 2) <= 1].max()
    if gains[best] < np.log(places.size) + _BETTER or gains[best] < middle + _BETTER:
        return None
    return Parts(float(places[best] / size), float(top[best] / bottom[best]), places.size)
