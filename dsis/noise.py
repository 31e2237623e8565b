"""The paper's noise: equations (1) to (4). sigma there is a standard deviation.

AWGN adds N(0, sigma) to a display image. Camera noise adds N(0, sqrt(m x + t)) to linear raw data,
m and t piecewise constant in the clean signal x: one pair per read-out segment (dual gain has two).
It is drawn as what it is made of: shot noise of variance m x and read noise of variance t, each
from a field of its own, so that physics between the two finds its place in the chain.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, over_rows
from dsis.draw import Draw
from dsis.grid import PixelGrid

_SAMPLES_IN_CACHE = 1 << 16  # with the signal beside them they fit a core's second-level cache


@dataclass(frozen=True)
class Segments:
    """Variance of raw noise against the clean signal x, one entry per read-out segment, ascending.

    Attributes
    ----------
    lower_dn
        Where each segment begins, DN above black; the first is -inf.
    slope_dn
        m, DN.
    intercept_dn2
        t, DN^2. Where t < 0 (a black level estimated too low) shot noise carries it all.
    """

    lower_dn: NDArray[np.float32]
    slope_dn: NDArray[np.float32]
    intercept_dn2: NDArray[np.float32]

    @classmethod
    def of(cls, segments: Sequence[tuple[float, float, float]]) -> "Segments":
        """Return segments from (lower_dn, slope_dn, intercept_dn2) in ascending order."""
        # Contiguous, so that two segments need no kernels of their own.
        lower, slope, intercept = np.ascontiguousarray(np.asarray(segments, np.float32).T)
        return cls(lower, slope, intercept)

    def index(self, signal_dn: NDArray[np.float32]) -> NDArray[np.intp]:
        """Return the segment of each clean signal (DN above black)."""
        found = np.searchsorted(self.lower_dn[1:], signal_dn, side="right")
        return np.asarray(found, np.intp)

    def variance_dn2(self, signal_dn: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return m x + t of the clean signal x: DN^2. Shot and read noise each count from 0."""
        i, zero = self.index(signal_dn), np.float32(0)
        t = self.intercept_dn2[i]
        shot: NDArray[np.float32] = np.maximum(
            self.slope_dn[i] * signal_dn + np.minimum(t, zero), zero
        )
        return shot + np.maximum(t, zero)


def awgn(
    image: NDArray[np.float32], sigma: float, draw: Draw, grid: PixelGrid, frame: int
) -> NDArray[np.float32]:
    """Return image + N(0, sigma), equation (4); `sigma` in the unit of `image` (`grid.shape`)."""
    out = np.empty(image.shape, np.float32)
    for top, end in _spans(0, grid.rows, out):
        _add_white(
            _flat(image[top:end]),
            draw.normal_rows("awgn", grid, frame, top, end).reshape(-1),
            out[top:end].reshape(-1),
            np.float32(sigma),
        )
    return out


def shot_noise(
    expected_dn: NDArray[np.float32],
    segments: Segments,
    draw: Draw,
    grid: PixelGrid,
    frame: int,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Return the expected signal (DN above black, `grid.shape`) with shot noise of variance m x."""
    out = np.empty(expected_dn.shape, np.float32)  # rows of it are filled as flat views

    def add(top: int, end: int) -> None:
        _add_shot(
            _flat(expected_dn[top:end]),
            draw.normal_rows("shot_noise", grid, frame, top, end).reshape(-1),
            out[top:end].reshape(-1),
            segments.lower_dn,
            segments.slope_dn,
            segments.intercept_dn2,
        )

    _in_spans(add, out, partial(draw.held, "shot_noise", grid, frame), threads)
    return out


def read_noise(
    signal_dn: NDArray[np.float32],
    expected_dn: NDArray[np.float32],
    segments: Segments,
    draw: Draw,
    grid: PixelGrid,
    frame: int,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Return `signal_dn` with read noise of variance t, segment chosen by the expected signal."""
    out = np.empty(signal_dn.shape, np.float32)  # rows of it are filled as flat views
    sigma = np.sqrt(np.maximum(segments.intercept_dn2, np.float32(0)))

    def add(top: int, end: int) -> None:
        _add_read(
            _flat(signal_dn[top:end]),
            _flat(expected_dn[top:end]),
            draw.normal_rows("read_noise", grid, frame, top, end).reshape(-1),
            out[top:end].reshape(-1),
            segments.lower_dn,
            sigma,
        )

    _in_spans(add, out, partial(draw.held, "read_noise", grid, frame), threads)
    return out


def camera_noise(
    clean_dn: NDArray[np.float32],
    segments: Segments,
    draw: Draw,
    grid: PixelGrid,
    frame: int,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Return x + N(0, sqrt(m x + t)) of the clean signal x: DN above black, `grid.shape`.

    Neither rounded nor clipped: that is the converter's part (`dsis.camera`).
    """
    shot = shot_noise(clean_dn, segments, draw, grid, frame, threads)
    return read_noise(shot, clean_dn, segments, draw, grid, frame, threads)


def _in_spans(
    work: Callable[[int, int], None],
    field: NDArray[np.float32],
    held: Callable[[], bool],
    threads: int,
) -> None:
    """Call `work(first, end)` on runs of rows that cover a field: small ones are one, see `_spans`.

    One after another within blocks that threads share.
    """
    if field.size <= _SAMPLES_IN_CACHE:
        work(0, len(field))
        return

    def block(first: int, last: int) -> None:
        for top, end in _spans(first, last, field, held):
            work(top, end)

    over_rows(block, len(field), threads)


def _spans(
    first: int, last: int, field: NDArray[np.float32], held: Callable[[], bool] = lambda: False
) -> Iterator[tuple[int, int]]:
    """Yield (first, end) of runs of rows whose deviates stay in the cache until they are used.

    All in one run where they are `held` already.
    """
    rows = max(1, _SAMPLES_IN_CACHE * len(field) // max(1, field.size))
    if last - first > rows and held():
        rows = last - first
    for top in range(first, last, rows):
        yield top, min(top + rows, last)


def _flat(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return rows as one line that could be written: read-only ones need kernels of their own."""
    flat = rows.reshape(-1)
    return flat if flat.flags.carray else np.require(flat, requirements=["C", "W"])


@kernel
def _add_shot(
    expected: NDArray[np.float32],
    deviates: NDArray[np.float32],
    out: NDArray[np.float32],
    lower: NDArray[np.float32],
    slope: NDArray[np.float32],
    intercept: NDArray[np.float32],
) -> None:
    zero = np.float32(0)
    # Segment by segment, each overwriting where it holds: such loops become vector instructions.
    for s in range(lower.size):
        # A negative intercept cannot be read noise: shot noise carries it.
        begins, m, t = lower[s], slope[s], min(intercept[s], zero)
        for i in range(expected.size):
            x = expected[i]
            noisy = x + np.sqrt(max(m * x + t, zero)) * deviates[i]
            out[i] = noisy if s == 0 or x >= begins else out[i]


@kernel
def _add_read(
    signal: NDArray[np.float32],
    expected: NDArray[np.float32],
    deviates: NDArray[np.float32],
    out: NDArray[np.float32],
    lower: NDArray[np.float32],
    sigma: NDArray[np.float32],
) -> None:
    for k in range(lower.size):
        begins, s = lower[k], sigma[k]
        for i in range(signal.size):
            noisy = signal[i] + s * deviates[i]
            out[i] = noisy if k == 0 or expected[i] >= begins else out[i]


@kernel
def _add_white(
    image: NDArray[np.float32],
    deviates: NDArray[np.float32],
    out: NDArray[np.float32],
    sigma: np.float32,
) -> None:
    for i in range(image.size):
        out[i] = image[i] + sigma * deviates[i]
