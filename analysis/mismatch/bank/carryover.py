"""What a sample has from the code of the one read before it: memory of a converter of steps.

The residue of a converter's coarse decision rises and falls with the code, period by period. Waves
over the code before a sample tell it from all that couples neighbours in proportion: what a line
through that code explains is taken off.
"""

from collections.abc import Iterable, Iterator
from functools import cache
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.sawtooth import FOLDED, PERIODS, Array, Frame, Samples
from analysis.mismatch.bank.scalars import UNKNOWN, Number
from dsis.compiled import kernel

AXES = ("rows", "columns")
PHASES = ("cosine", "sine")
_BEFORE = {"rows": (0, 1), "columns": (1, 0)}
_FRAMES = 16  # of an exposure: a memory is the same in all
_LEAST = 4.0  # times what means of lines take: what must be left of a wave, to say anything
_SAMPLES = 2**16  # of a difference, roughly: every so many lines are looked at
_KEPT = 2**15  # samples of a difference of frames that are kept one by one
_FARTHEST = 6.0  # standard deviations of a change of samples: beyond it is a spike
_ASKED = 4096  # samples that tell how far changes scatter
_ASKED_AT = np.array([0.15865, 0.5, 0.84135])  # a standard deviation, and the middle


def detail(axis: str, period: int, phase: str) -> str:
    """Return what tells one of the numbers from the others."""
    return f"{axis}, {phase} over {period} codes"


class _Counts:
    """Sums over samples by their code, folded at `PERIODS[-1]`, and over all of them.

    Attributes
    ----------
    counts
        How often codes, their differences and sums occur: (3, code).
    moved
        Changes of samples, of those to their right and of those below: (code, 3).
    squares
        Count, squares of the own, of the others, and their products with the own.
    """

    def __init__(self) -> None:
        self.counts = np.zeros((3, FOLDED), np.int64)
        self.moved = np.zeros((FOLDED, 3))
        self.squares = np.zeros(6)

    def take(
        self,
        one: Frame,
        other: Frame,
        still: NDArray[np.float32],
        lines: tuple[int, int, int],
        columns: tuple[int, int],
    ) -> None:
        """Take samples of some lines (first, end, step) and columns (first, end)."""
        _take(one, other, still, lines, columns, self.counts, self.moved, self.squares)


class CarryOver:
    """Sums over successive frames of one exposure, by the code before, folded at `PERIODS[-1]`.

    By axis: how often codes, their differences and sums occur; sums of the sample's own change from
    frame to frame and of that of the one before; count, squares and product of the changes.
    """

    def __init__(self, *, keep: bool = False) -> None:
        self.keep = keep
        self.kept: dict[str, list[Array]] = {axis: [] for axis in AXES}
        self.inner, self.edges = _Counts(), {axis: _Counts() for axis in AXES}
        self.frames, self.size = 0, {"rows": 1, "columns": 1}

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) as they come, and take their differences."""
        last: Frame | None = None
        for frame in frames:
            if self.frames < _FRAMES:
                own = np.ascontiguousarray(frame, np.int32)
                if last is not None:
                    self._take(last, own)
                last = own
                self.frames += 1
            yield frame

    def _take(self, one: Frame, other: Frame) -> None:
        """Take the change between two frames, of every so many lines.

        Most samples stand before one to their right and one below: what both have in common is
        summed once. The last column stands before what is below alone, the last line before what is
        beside.
        """
        rows, columns = one.shape
        self.size = {"rows": columns, "columns": rows}
        still = _still(one, other, *_ends(one, other))
        every = max(one.size // _SAMPLES, 1) | 1  # odd: no colour is left out
        self.inner.take(one, other, still, (0, rows - 1, every), (0, columns - 1))
        self.edges["columns"].take(one, other, still, (0, rows - 1, every), (columns - 1, columns))
        if (rows - 1) % every == 0:
            self.edges["rows"].take(one, other, still, (rows - 1, rows, 1), (0, columns - 1))
        if not self.keep:
            return
        for axis in AXES:
            down, right = _BEFORE[axis]
            parts = (one, other, still[down:, right:], still)
            flat = [part[: rows - down, : columns - right].reshape(-1) for part in parts]
            step = max(flat[0].size // _KEPT, 1) | 1
            self.kept[axis].append(np.stack([part[::step] for part in flat]).astype(float))

    def sums(self, axis: str) -> tuple[Array, Array]:
        """Return sums of samples that stand before others along an axis.

        By code: how often codes, their differences and sums occur, changes of what was read after
        and of the codes' own. Of all: count, squares of what was read after, product with the own,
        squares of the own.
        """
        inner, edge, after = self.inner, self.edges[axis], AXES.index(axis)
        by_code = np.empty((5, FOLDED))
        np.add(inner.counts, edge.counts, out=by_code[:3])
        for k, column in ((3, 1 + after), (4, 0)):
            np.add(inner.moved[:, column], edge.moved[:, column], out=by_code[k])
        squares = inner.squares + edge.squares
        return by_code, squares[[0, 2 + after, 4 + after, 1]]

    def samples(self, axis: str) -> Samples | None:
        """Return the samples kept; None: there are none."""
        if not self.kept[axis]:
            return None
        one, other, moved, before = np.concatenate(self.kept[axis], 1)
        square = float(before @ before)
        if square <= 0:
            return None
        follows = float(before @ moved) / square
        rest = moved - before * follows
        variance = float(rest.var())
        if variance <= 0:
            return None
        first, second = (part.astype(np.int32) & (FOLDED - 1) for part in (one, other))
        own = rest / sqrt(variance)
        # Neighbours less the mean of their line differ from it in opposite ways, by one over its
        # length.
        follows += 1 / self.size[axis]
        return Samples(first, second, own, before, variance, square, follows)


class CarryOverSums:
    """Amplitudes of the waves over all exposures, by weighted least squares, DN.

    Attributes
    ----------
    samples
        Those that exposures have kept, by axis.
    """

    def __init__(self) -> None:
        self.samples: dict[str, tuple[Samples, ...]] = dict.fromkeys(AXES, ())
        self.top, self.bottom = np.zeros((2, len(AXES), len(PERIODS), len(PHASES)))

    def add(self, own: CarryOver, *, still: bool = False) -> None:
        """Take one exposure; frames that are `still` say nothing."""
        if own.frames < 2 or still:
            return
        for axis in AXES:
            kept = own.samples(axis)
            self.samples[axis] += (kept,) if kept is not None else ()
        # n - 1 differences of successive frames, which share frames, say as much as fewer apart.
        weight = (2 * own.frames - 2) / (3 * own.frames - 4)
        for k, axis in enumerate(AXES):
            by_code, squares = own.sums(axis)
            waves = by_code @ _waves()
            _add(waves, squares, own.size[axis], weight, self.top[k], self.bottom[k])

    def numbers(self) -> dict[str, Number]:
        """Return amplitudes and their errors in white noise, DN, by name."""
        found: dict[str, Number] = {}
        for a, axis in enumerate(AXES):
            for p, period in enumerate(PERIODS):
                for k, phase in enumerate(PHASES):
                    top, bottom = self.top[a, p, k], self.bottom[a, p, k]
                    name = f"carry_over along {detail(axis, period, phase)}"
                    known = bottom > 0
                    found[name] = (float(top / bottom), 1 / sqrt(bottom)) if known else UNKNOWN
        return found


@kernel
def _add(
    waves: Array, squares: Array, size: int, weight: float, tops: Array, bottoms: Array
) -> None:
    """Add what `sums` says of each wave of an axis, by least squares: (period, phase).

    Parameters
    ----------
    waves
        Sums by code, times `_waves`.
    squares
        Of all samples.
    size
        Samples in a line.
    weight
        Of differences between frames.
    tops, bottoms
        Are added to.
    """
    count, square, product, before = squares
    if not min(square, before) > 0:
        return
    scale = weight / (max(square - product**2 / before, 1e-12) / max(count, 1))
    periods = len(tops)
    for p in range(periods):
        codes, apart, joined = waves[0, 2 * periods + p], waves[1, p], waves[2, p]
        for phase, sign in enumerate((1.0, -1.0)):
            moved, through = waves[3, phase * periods + p], waves[4, phase * periods + p]
            # Of cosines (cos a - cos b)^2, of sines (sin a - sin b)^2, from a - b and a + b.
            whole = count + sign * codes / 2 - (apart + sign * joined)
            left = whole - through**2 / before
            if left > _LEAST / size * abs(whole):
                tops[p, phase] += (moved - through * product / before) * scale
                bottoms[p, phase] += left * scale


@cache
def _waves() -> Array:
    """Return cosines, sines and cosines of twice the angle: (code folded, each period)."""
    angle = 2 * pi * np.arange(FOLDED)[:, None] / np.array(PERIODS)
    cosine = np.cos(angle)
    return np.hstack([cosine, np.sin(angle), 2 * cosine**2 - 1])


def _ends(one: Frame, other: Frame) -> tuple[int, int]:
    """Return the least and the largest change of samples that is no spike, DN.

    Six standard deviations from the middle, which normal changes never reach: a spike, or a few,
    would bend all that is summed, and its own lines' means.
    """
    low, middle, high = _quantiles(one, other, max(one.size // _ASKED, 1) | 1, _ASKED_AT)
    far = _FARTHEST * max(float(high - low) / 2, 0.5)
    return int(np.floor(middle - far)), int(np.ceil(middle + far))


@kernel
def _quantiles(one: Frame, other: Frame, every: int, at: Array) -> Array:
    """Return quantiles of every so many changes, between two in proportion, as numpy has them.

    Counted, not sorted: changes are few whole numbers.
    """
    columns, count = one.shape[1], (one.size + every - 1) // every
    change = np.empty(count, np.int32)
    y = x = 0
    for i in range(count):
        change[i] = one[y, x] - other[y, x]
        x += every
        while x >= columns:  # a division takes longer
            x -= columns
            y += 1
    least = change.min()
    met = np.zeros(change.max() - least + 1, np.int64)
    for i in range(count):
        met[change[i] - least] += 1
    found = np.empty(at.size)
    for k in range(at.size):
        place = at[k] * (count - 1)
        below = 0
        so_far = met[0]
        while so_far <= int(place):
            below += 1
            so_far += met[below]
        next_ = below
        if so_far <= min(int(place) + 1, count - 1):
            next_ += 1
            while met[next_] == 0:
                next_ += 1
        found[k] = least + below + (next_ - below) * (place - int(place))
    return found


@kernel
def _still(one: Frame, other: Frame, least: int, most: int) -> NDArray[np.float32]:
    """Return the change of samples less that of rows and columns: lines move for other reasons."""
    rows, columns = one.shape
    by_column, whole = np.zeros(columns, np.int64), np.int64(0)
    found = np.empty(one.shape, np.float32)
    of_row = np.empty(rows, np.float32)
    for y in range(rows):
        first, second, total = one[y], other[y], np.int64(0)
        for x in range(columns):
            change = min(max(first[x] - second[x], least), most)
            by_column[x] += change
            total += change
        of_row[y] = np.float32(total) / np.float32(columns)
        whole += total
    of_column = by_column.astype(np.float32) / np.float32(rows)
    mean = np.float32(whole) / np.float32(one.size)
    for y in range(rows):
        first, second, line, own = one[y], other[y], found[y], of_row[y]
        for x in range(columns):
            change = min(max(first[x] - second[x], least), most)
            line[x] = np.float32(change) - own - of_column[x] + mean
    return found


@kernel
def _take(
    one: Frame,
    other: Frame,
    still: NDArray[np.float32],
    lines: tuple[int, int, int],
    columns: tuple[int, int],
    counts: NDArray[np.int64],
    moved: Array,
    squares: Array,
) -> None:
    """Add sums over some lines and columns of samples: see `_Counts`."""
    mask = FOLDED - 1
    count = before = squared_right = squared_below = by_right = by_below = 0.0
    end = still.shape[1] - 1
    for y in range(lines[0], lines[1], lines[2]):
        first, second, line, after = one[y], other[y], still[y], still[min(y + 1, len(still) - 1)]
        for x in range(columns[0], columns[1]):
            a, b = first[x], second[x]
            counts[0, a & mask] += 1
            counts[0, b & mask] += 1
            counts[1, (a - b) & mask] += 1
            counts[2, (a + b) & mask] += 1
            own, right, below = line[x], line[min(x + 1, end)], after[x]  # products: float32
            into, off = moved[a & mask], moved[b & mask]
            into[0] += own
            into[1] += right
            into[2] += below
            off[0] -= own
            off[1] -= right
            off[2] -= below
            count += 1
            before += own * own
            squared_right += right * right
            squared_below += below * below
            by_right += right * own
            by_below += below * own
    squares[0] += count
    squares[1] += before
    squares[2] += squared_right
    squares[3] += squared_below
    squares[4] += by_right
    squares[5] += by_below
