"""Where samples of a frame lie far from a reference: a kernel, and the noise that says how far."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.measures.median import median

Codes = NDArray[np.uint16]
Image = NDArray[np.float32]
Array = NDArray[np.float64]
Places = NDArray[np.int32]
_SAMPLES = 8192  # of a channel, that tell by how much a frame moved, and how noisy it is
_BRIGHT = 0.5  # of a scene's samples: those tell by how much light changed
_LEAST_LINES = 16
_ONE_SIGMA = (15.865, 84.135)


@dataclass(frozen=True)
class Movement:
    """By how much a frame differs from the reference as a whole.

    Attributes
    ----------
    offset_dn
        Of uniform frames, by row and column of the colour filter: (2, 2).
    gain
        Of scenes: in proportion to the signal.
    """

    offset_dn: Array
    gain: float

    def at(self, rows: Places, columns: Places, above_dn: Array) -> Array:
        """Return the movement of pixels whose reference is `above_dn` above black, DN."""
        return np.asarray(self.offset_dn[rows % 2, columns % 2] + self.gain * above_dn)


def reference(frames: list[Codes]) -> Codes:
    """Return the middle of three frames, or the one given."""
    if len(frames) == 1:
        return frames[0]
    a, b, c = frames
    return np.asarray(np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c)))


def thinned(image: NDArray[np.generic], y: int, x: int, step: int) -> Image:
    """Return some of a channel's samples, evenly spread over it."""
    plane = image[y::step, x::step]
    every = max(int(np.sqrt(plane.size / _SAMPLES)), 1)
    return np.ascontiguousarray(plane[::every, ::every], np.float32)


def noise_dn(one: Codes, other: Codes, y: int, x: int, step: int) -> float:
    """Return the noise of most of a channel's samples, DN; not less than the step of its codes.

    The wider of what most differences are and of all but one in fifty of them: few electrons
    and coarse codes leave most samples where they are.
    """
    change = thinned(one, y, x, step) - thinned(other, y, x, step)
    change = change - np.float32(median(change))
    low, high = np.percentile(change, _ONE_SIGMA)
    size = np.abs(change)
    most = np.minimum(size, np.percentile(size, 98.0)).astype(np.float64)
    moved = size[size >= 1]
    step_dn = float(moved.min()) if moved.size else 1.0
    return max(float(high - low) / 2 / 2**0.5, float(np.sqrt((most**2).mean() / 2)), step_dn)


def of_lines(one: Codes, other: Codes, step: int) -> float:
    """Return which share of the spread of the samples of two frames is that of their lines.

    Of the quartiles of their difference: 1 less what is left, as a ratio, without the medians of
    rows and of columns. 0 of few lines, whose medians have much of their samples.
    """
    change = thinned(one, 0, 0, step) - thinned(other, 0, 0, step)
    if min(change.shape) < _LEAST_LINES:
        return 0.0
    alone = change - np.median(change, 1, keepdims=True)
    alone = alone - np.median(alone, 0, keepdims=True)
    spreads = []
    for own in (change, alone):
        low, high = np.percentile(own, _ONE_SIGMA)
        spreads.append(float(high - low))
    whole, left = spreads
    return 1 - left / whole if whole > 0 else 0.0


def movement(frame: Codes, middle: Codes, black_dn: float, *, scene: bool, step: int) -> Movement:
    """Return by how much a frame differs from the reference as a whole."""
    offsets = np.zeros((2, 2))
    if scene:
        now, then = (thinned(image, 0, 0, 1) - np.float32(black_dn) for image in (frame, middle))
        bright = then > max(float(np.quantile(then, _BRIGHT)), 1.0)
        return Movement(offsets, median(now[bright] / then[bright]) - 1 if bright.any() else 0.0)
    for y in range(step):
        for x in range(step):
            change = thinned(frame, y, x, step) - thinned(middle, y, x, step)
            offsets[y::step, x::step] = median(change)
    return Movement(offsets, 0.0)


def far_samples(
    frame: Codes, middle: Codes, farthest: Image, moved: Movement, black_dn: float, most: int
) -> Places | None:
    """Return the (row, column) of samples farther from the reference than `farthest`, DN.

    None: there are more than `most`.
    """
    offsets, gain = moved.offset_dn.astype(np.float32), np.float32(moved.gain)
    found, count = _far(frame, middle, farthest, offsets, gain, np.float32(black_dn), most)
    return None if count > most else found[:count]


@kernel
def _far(
    frame: Codes,
    middle: Codes,
    farthest: Image,
    offsets: Image,
    gain: np.float32,
    black: np.float32,
    most: int,
) -> tuple[Places, int]:
    found, count = np.empty((most, 2), np.int32), 0
    rows, columns = frame.shape
    for y in range(rows):
        any_far = False
        for x in range(columns):
            then = np.float32(middle[y, x])
            change = np.float32(frame[y, x]) - then - offsets[y % 2, x % 2] - gain * (then - black)
            any_far |= abs(change) > farthest[y, x]
        if not any_far:
            continue
        for x in range(columns):
            then = np.float32(middle[y, x])
            change = np.float32(frame[y, x]) - then - offsets[y % 2, x % 2] - gain * (then - black)
            if abs(change) > farthest[y, x]:
                if count < most:
                    found[count, 0], found[count, 1] = y, x
                count += 1
    return found, count
