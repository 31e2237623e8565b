"""Power of frames in waves down and along them: what rows have in common, beside single pixels."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import gammainccinv, gammaincinv
from scipy.stats import norm

from analysis.mismatch.layout import Layout

Array = NDArray[np.float64]
FramesOf = Callable[[str], Iterable[NDArray[np.generic]]]
SLOW = 3  # waves along rows: their means, slopes and bends
_FINEST = 1 / 16  # cycles per pixel: finer waves along rows see neighbours that are alike
_FEWEST_WAVES, _MOST_WAVES = 6, 64
_NEAR = 4  # rows: pixels so near each other may be alike for another reason
_SINGLE, _RATIO = 8, 1.12  # waves down the frame that are bands by themselves; widths beyond
_CHANCE = 1e-3  # that any wave of white noise is taken for a line
_FAR = 5.0  # standard deviations: what is farther off is a spike's
_NORMAL = 1.4826  # standard deviation of normal noise over its median deviation
_CLIPPED = 0.01  # share of samples at the ends of the converter
_SLOWEST, _REACH = 4, 3  # first band that may be a line; bands to either side that are around it
_MOST_LINES = 4
_LEAST = 0.1  # of the mean power of white noise, that smoothing leaves


@dataclass(frozen=True)
class Size:
    """Rows and columns of a frame, and the waves of it that are looked at."""

    rows: int
    columns: int

    @property
    def waves(self) -> int:
        """How many waves along rows: of half a cycle, one cycle, and so on."""
        return max(min(int(2 * _FINEST * self.columns), _MOST_WAVES), _FEWEST_WAVES)

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """Where bands of waves down the frame begin, the wave of half a cycle at 0: (band,)."""
        return _starts(self.rows - 1)

    @cached_property
    def counts(self) -> Array:
        """How many waves each band has: (band,)."""
        return np.diff(np.append(self.starts, self.rows - 1)).astype(np.float64)

    def banded(self, power: Array) -> Array:
        """Return the means in each band of what waves down the frame have: (band, ...)."""
        counts = self.counts.reshape(-1, *(1,) * (power.ndim - 1))
        return np.asarray(np.add.reduceat(power, self.starts, 0) / counts)


@lru_cache(maxsize=8)
def _starts(count: int) -> NDArray[np.intp]:
    found = list(range(min(_SINGLE, count)))
    while (begin := max(found[-1] + 1, int(found[-1] * _RATIO))) < count:
        found.append(begin)
    return np.array(found, np.intp)


@dataclass(frozen=True)
class Powers:
    """Temporal power of one exposure's frames, DN^2; white noise has its variance in each wave.

    Attributes
    ----------
    slow
        Products of the `SLOW` slowest waves along rows, 0 the mean of rows, in bands of waves down
        the frame: (band, wave, wave).
    white
        What noise of single pixels has in these, relative to that along rows: (band, wave); not 1
        where pixels of neighbouring rows are alike.
    waves
        Of the next waves along rows, the mean over all waves down the frame: (wave,).
    whole
        Of the means of frames.
    signal_dn
        Mean signal above black.
    frames
        Independent frames in it.
    """

    slow: Array
    white: Array
    waves: Array
    whole: float
    signal_dn: float
    frames: int


@lru_cache(maxsize=2)
def down(rows: int) -> Array:
    """Return waves down a frame for the slowest waves along rows: (wave, row - 1, row).

    Cosines of half a cycle, one cycle and so on, orthonormal (DCT-II), which have no jump from the
    last row to the first. What rises along rows goes with what rises down the frame, where pixels
    are read one after the other: where cosines have their slope, sines (DST-II). What all rows have
    in common, as columns do that are noisy, is left out.
    """
    cosines = fft.dct(np.eye(rows), axis=0, norm="ortho")[1:]
    sines = fft.dst(np.eye(rows), axis=0, norm="ortho")[:-1]
    sines = sines - sines.mean(1, keepdims=True)
    return np.stack([sines if wave % 2 else cosines for wave in range(SLOW)])


def row_powers(layout: Layout, frames_of: FramesOf) -> list[Powers]:
    """Return the powers of each dark and flat that has two frames, and few clipped samples.

    Lines down the frame, as bands of a lamp's light are, are cut down: see `without_lines`.
    """
    found = []
    for e in layout.uniform:
        if len(e.numbers) < 2:
            continue
        flickers = e.kind == "flat"
        ends = (0.0, layout.white_dn)
        own = powers_of(partial(frames_of, e.name), layout.black_dn, ends, flickers=flickers)
        if own is not None:
            found.append(own)
    return without_lines(found, Size(layout.rows, layout.columns))


def without_lines(powers: Sequence[Powers], size: Size) -> list[Powers]:
    """Return powers whose lines among waves down the frame are cut down to what is around them.

    Offsets of rows that forget, or rise as 1 / f, have power that changes smoothly from band to
    band: over few of them nearly as a power of the frequency. What stands out of that by more than
    chance, in all exposures together, is a line.
    """
    bands, count = size.counts.size, sum(own.frames for own in powers)
    if not count or bands < _SLOWEST + 2 * _REACH:
        return list(powers)
    shares = [own.slow[:, 0, 0] * own.frames / count / float(own.waves.mean()) for own in powers]
    seen = np.log(np.sum(shares, 0))
    error = np.sqrt(2 / (size.counts * count))
    place = np.log(size.starts + 1 + (size.counts - 1) / 2)
    lines = np.zeros(bands, np.bool_)
    level = seen.copy()
    for _ in range(_MOST_LINES):
        beyond = np.zeros(bands)
        for own in range(_SLOWEST, bands):
            near = np.abs(np.arange(bands) - own) <= _REACH
            near &= ~lines & (np.arange(bands) != own)
            shape = (
                np.stack([np.ones(bands), place - place[own]], 1)[near] / error[near, np.newaxis]
            )
            inverse = np.linalg.pinv(shape.T @ shape)
            level[own] = (inverse @ shape.T @ (seen[near] / error[near]))[0]
            if not lines[own]:
                beyond[own] = (seen[own] - level[own]) / np.hypot(error[own], inverse[0, 0] ** 0.5)
        if beyond.max() < norm.isf(_CHANCE / bands):
            break
        lines[int(beyond.argmax())] = True
    cut = np.ones((bands, SLOW))
    cut[lines, 0] = np.exp((level - seen) / 2)[lines]  # what rows have in common is the first
    products = cut[:, :, np.newaxis] * cut[:, np.newaxis]
    return [replace(own, slow=own.slow * products) for own in powers]


def powers_of(
    frames: Callable[[], Iterable[NDArray[np.generic]]],
    black_dn: float,
    ends: tuple[float, float],
    *,
    flickers: bool,
) -> Powers | None:
    """Return the powers of one exposure's frames; None: too many samples are clipped.

    Parameters
    ----------
    frames
        Gives the frames (row, column), DN, anew each time.
    black_dn
        Black level.
    ends
        Lowest and highest code.
    flickers
        Whether a frame whose mean is off has its pattern so much larger, as of light.

    Waves down the frame of what rows share are as good as independent, see `down`. Of a spike
    counts as much as noise might be. Lines, that stand out of all waves along rows, are cut down to
    what is around them.
    """
    count, clipped = 0, 0.0
    total: Array | None = None
    for frame in frames():
        own = np.asarray(frame, np.float64)
        total = own - black_dn if total is None else total + (own - black_dn)
        clipped += float(((own <= ends[0]) | (own >= ends[1])).mean())
        count += 1
    if total is None or count < 2 or clipped > _CLIPPED * count:
        return None
    mean = total / count
    size, level = Size(*mean.shape), float(mean.mean())
    pattern = mean / level if flickers and level > 0 else np.ones_like(mean)
    made, levels = [], []
    for frame in frames():
        rest = np.asarray(frame, np.float64) - black_dn - mean
        off = float(rest.mean())
        rest = _without_spikes(rest - off * pattern)
        made.append(fft.dct(rest, axis=1, norm="ortho")[:, : size.waves + 1])
        levels.append(off)
    along = np.stack(made)
    along -= along.mean(0)
    power = (fft.dct(along[..., 1:], axis=1, norm="ortho")[:, 1:] ** 2).sum(0) / (count - 1)
    white = _alike_down(power, size)
    cut = _lines_cut(power / white[:, np.newaxis], count - 1)
    waves = (cut * power / white[:, np.newaxis])[:, SLOW - 1 :].mean(0)
    basis = down(size.rows)
    slow = np.stack([along[..., i] @ basis[i].T for i in range(SLOW)], 2)
    slow[..., 1:] *= np.sqrt(cut[:, : SLOW - 1])
    products = np.einsum("tki,tkj->kij", slow, slow) / (count - 1)
    own = white[:, np.newaxis] * (basis**2).sum(2).T
    return Powers(
        size.banded(products),
        size.banded(own),
        waves,
        float(np.var(levels, ddof=1)) * mean.size,
        level,
        count - 1,
    )


def _without_spikes(rest: Array) -> Array:
    """Return what is left of a frame (row, column) with far values pulled in, site by site.

    Sites of a mosaic, two by two, have noise of their own.
    """
    made = rest.copy()
    for y in (0, 1):
        for x in (0, 1):
            own = made[y::2, x::2]
            limit = _FAR * _NORMAL * float(np.median(np.abs(own - np.median(own))))
            if limit > 0:
                np.clip(own, -limit, limit, out=own)
    return made


def _alike_down(power: Array, size: Size) -> Array:
    """Return the power of noise of pixels in waves down the frame, smoothed: (row - 1,), mean 1.

    `power` is that of waves down and along (row - 1, wave).
    """
    angle = np.pi * np.arange(1, size.rows) / size.rows
    shapes = np.cos(angle[:, np.newaxis] * np.arange(min(_NEAR, size.rows // 4) + 1))
    profile = (power / power.mean(0)).mean(1)
    found = shapes @ np.linalg.lstsq(shapes, profile, rcond=None)[0]
    found = np.maximum(found, _LEAST)
    return np.asarray(found / found.mean())


def _lines_cut(power: Array, frames: int) -> Array:
    """Return what brings powers (row - 1, wave) that no chance makes to the level around them."""
    shape = frames / 2
    level = np.median(power, 0) * shape / float(gammaincinv(shape, 0.5))
    limit = level * float(gammainccinv(shape, _CHANCE / power.size)) / shape
    return np.asarray(np.where(power > limit, level / power, 1.0))
