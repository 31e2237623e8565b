"""Sufficient statistics of one exposure, streaming: level, temporal variance, fixed pattern.

Frames are read once; whole numbers are added exactly, so the order of the sums does not matter. The
temporal variance is the sum of squares within pixels, less the frames' common change, over
(T - 1)(n - 1): for two frames equation (1) of Seybold et al. (2014) with the change of the mean
removed. Its standard error is that of the balanced row x column model with a term for the kurtosis,
so row and column noise do not make it too small.
"""

from dataclasses import dataclass
from itertools import product
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.sums import (
    Floats,
    Ints,
    Sums,
    add_frame,
    add_pair,
    begin,
    square_total,
)
from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.recording.hygiene import CLIPPED_SHARE, Inspection

_LEAST_PIXELS = 2  # of a channel: their common change is taken off
LINES_P = 1e-3  # rows or columns that vary more than chance does so often have their own noise


class Patterns(Protocol):
    """Takes the sum over an exposure's frames."""

    def add(self, exposure: Any, total: Ints) -> None: ...  # noqa: D102 - the class says it


@dataclass(frozen=True)
class LevelStatistics:
    """One CFA channel of one exposure; DN of the raw codes, rounding included.

    Attributes
    ----------
    exposure, kind, exposure_time_s, light, channel
        Where it comes from.
    frames, rows, columns
        T and the size of the channel's plane.
    level_dn, level_se_dn
        Mean code; error from pixel, row and column noise (not from a wander of the frames).
    variance_dn2, variance_se_dn2
        Temporal variance, the change of the frame mean removed.
    pair_variance_dn2
        Equation (1) over the disjoint pairs of successive frames, nothing removed.
    removed_dn2
        What removing the change of the mean takes from equation (1).
    frame_sd_dn
        Standard deviation of the frame means.
    wander
        Variance of the frame means over what pixel, row and column noise explain; 1 = no wander.
    kurtosis
        Excess kurtosis of the temporal noise, from the pair differences; nan where there is none.
    clipped_low, clipped_high
        Share of samples at code 0 and at the white level or above.
    fixed_dn2, fixed_se_dn2
        Spatial variance of the mean frame less what temporal noise leaves in it.
    repeated_frames
        Number of frames that equal the one before bit for bit.
    row_variance_dn2, column_variance_dn2
        Variance of fresh offsets of rows and columns; 0 where chance explains them.
    copied_frames
        Whether a frame occurs elsewhere in the recording bit for bit, although noise moves pixels.
    """

    exposure: str
    kind: str
    exposure_time_s: float
    light: float | None
    channel: str
    frames: int
    rows: int
    columns: int
    level_dn: float
    level_se_dn: float
    variance_dn2: float
    variance_se_dn2: float
    pair_variance_dn2: float
    removed_dn2: float
    frame_sd_dn: float
    wander: float
    kurtosis: float
    clipped_low: float
    clipped_high: float
    fixed_dn2: float
    fixed_se_dn2: float
    repeated_frames: int
    row_variance_dn2: float = 0.0
    column_variance_dn2: float = 0.0
    copied_frames: bool = False

    @property
    def pixels(self) -> int:
        """Number of pixels of the plane."""
        return self.rows * self.columns

    @property
    def copies(self) -> bool:
        """Whether frames of it are no frames of their own: copies, or all of them one picture."""
        return self.copied_frames or 0 < self.repeated_frames == self.frames - 1


def expose_statistics(
    recording: Recorded,
    exposure: Any,
    inspection: Inspection | None = None,
    patterns: Patterns | None = None,
) -> list[LevelStatistics]:
    """Return the statistics of each CFA channel of one exposure; empty where it has no frames.

    `inspection` sees every frame in passing, and says which code is white; `patterns` is given the
    sum of the frames where no more than `CLIPPED_SHARE` of the samples are clipped. Raises
    `InputError` where a channel has a single pixel or none: its noise is no other than a change of
    the light.
    """
    white = int(inspection.white_level if inspection else recording.sensor.white_level)
    sums: Sums | None = None
    previous: NDArray[np.uint16] | None = None
    for count, frame in enumerate(recording.frames(exposure)):
        if inspection is not None:
            inspection.look(str(exposure.name), count, frame)
        if sums is None:
            _refuse_few(recording, frame.shape)
            sums = begin(frame)
        row, column = (
            np.empty((frame.shape[0], 2), np.int64),
            np.zeros((2, frame.shape[1]), np.int64),
        )
        add_frame(frame, sums.reference, white, sums.total, row, column, sums.squares, sums.clipped)
        sums.rows.append(row)
        sums.columns.append(column)
        if previous is not None and count % 2:
            shape = (2, frame.shape[1])
            d1, d2, d4 = np.zeros(shape, np.int64), np.zeros(shape, np.int64), np.zeros(shape)
            add_pair(frame, previous, d1, d2, d4)
            sums.pairs.append((d1, d2, d4))
        if previous is not None and np.array_equal(frame, previous):
            sums.repeats += 1
        previous = frame
    if sums is None:
        return []
    pattern = np.zeros((2, sums.total.shape[1]), np.int64)
    square_total(sums.total, pattern)
    samples = sums.total.size * len(sums.rows)
    if patterns is not None and int(sums.clipped.sum()) <= CLIPPED_SHARE * samples:
        patterns.add(exposure, sums.total + np.int64(sums.reference * len(sums.rows)))
    names = channel_names(recording.sensor.cfa)
    found = dict.fromkeys(names[i][j] for i, j in product((0, 1), (0, 1)))
    return [_channel(exposure, name, names, sums, pattern) for name in found]


def _refuse_few(recording: Recorded, size: tuple[int, ...]) -> None:
    """Raise `InputError` where frames of this size (rows, columns) hold too few pixels."""
    cfa = recording.sensor.cfa
    step = 1 if cfa is Cfa.MONO else 2
    if (size[0] // step) * (size[1] // step) < _LEAST_PIXELS:
        each = f" of each colour ({cfa.value})" if step > 1 else ""
        fact = f"are of {size[1]} x {size[0]} pixels, must have {_LEAST_PIXELS} or more{each}"
        raise InputError.of(recording.sensor.name, "frames", fact)


def _channel(
    exposure: Any, name: str, names: tuple[tuple[str, str], ...], sums: Sums, pattern: Ints
) -> LevelStatistics:
    """Reduce the sums to one channel: the parities that bear its name, as one plane."""
    places = [(i, j) for i, j in product((0, 1), (0, 1)) if names[i][j] == name]
    mono = len(places) > 1
    i, j = places[0]

    def picked(sums_by_column: NDArray[Any]) -> Any:
        """Return the sum over the channel's parities; the last two axes are (parity, column)."""
        if mono:
            return sums_by_column.sum((-2, -1))
        return sums_by_column[..., i, j::2].sum(-1)

    frames = len(sums.rows)
    if mono:
        row = np.stack([r.sum(1) for r in sums.rows])
        column = np.stack([c.sum(0) for c in sums.columns])
    else:
        row = np.stack([r[i::2, j] for r in sums.rows])
        column = np.stack([c[i, j::2] for c in sums.columns])
    size = (row.shape[1], column.shape[1])
    n = size[0] * size[1]
    within = frames * int(picked(sums.squares)) - int(picked(pattern))
    temporal = _temporal(within / frames, row / size[1], column / size[0])
    pairs = [(int(picked(a)), int(picked(b)), float(picked(c))) for a, b, c in sums.pairs]
    variance, variance_se, kurtosis = _variance(temporal, pairs, n, frames)
    mean_total = int(row.sum())
    noise = temporal.white + temporal.lines if frames > 1 else np.nan
    spatial = (int(picked(pattern)) - mean_total**2 / n) / frames**2 / max(n - 1, 1)
    light = exposure.light
    low, high = picked(sums.clipped)
    return LevelStatistics(
        exposure=exposure.name,
        kind=str(exposure.kind),
        exposure_time_s=float(exposure.exposure_time_s),
        light=None if light is None else float(light),
        channel=name,
        frames=frames,
        rows=size[0],
        columns=size[1],
        level_dn=sums.reference + mean_total / (n * frames),
        level_se_dn=float(np.sqrt(max(noise, 0.0) / (n * frames))),
        variance_dn2=variance,
        variance_se_dn2=variance_se,
        pair_variance_dn2=_mean([d2 / (2 * n) for _, d2, _ in pairs]),
        removed_dn2=_mean([(d1 / n) ** 2 / 2 for d1, _, _ in pairs]),
        frame_sd_dn=float(np.sqrt(temporal.frame / n)),
        wander=float(temporal.frame / noise) if noise > 0 else np.nan,
        kurtosis=kurtosis,
        clipped_low=float(low) / (n * frames),
        clipped_high=float(high) / (n * frames),
        fixed_dn2=spatial - variance / frames,
        fixed_se_dn2=float(spatial * np.sqrt(2 / max(n - 1, 1))),
        repeated_frames=sums.repeats,
        row_variance_dn2=temporal.row,
        column_variance_dn2=temporal.column,
    )


@dataclass(frozen=True)
class _Temporal:
    """Mean squares of the temporal residual, and the sum of squares without the frames' change.

    `lines` is what row and column noise add to the mean square of a frame mean, `white` the rest.
    Both are estimates from few degrees of freedom; where chance explains the rows' and columns'
    excess, they count as white: errors that err at random would spoil the weights.
    """

    frame: float
    white: float
    lines: float
    line_spread: float
    rest: float
    row: float
    column: float


def _temporal(within: float, row_means: Floats, column_means: Floats) -> _Temporal:
    frames, rows = row_means.shape
    columns = column_means.shape[1]
    if frames < 2:
        return _Temporal(*[np.nan] * 7)
    frame = row_means.mean(1)
    change = frame - frame.mean()
    row = row_means - row_means.mean(0) - change[:, None]
    column = column_means - column_means.mean(0) - change[:, None]
    n = rows * columns
    ss_row, ss_column = columns * float((row**2).sum()), rows * float((column**2).sum())
    ss_frame = n * float((change**2).sum())
    rest = max(within - ss_frame, 0.0)
    dof = (frames - 1) * (rows - 1) * (columns - 1)
    pixel = max(rest - ss_row - ss_column, 0.0) / dof if dof else 0.0
    white = rest / ((frames - 1) * max(n - 1, 1))
    lines = spread = 0.0
    own = [0.0, 0.0]  # variance of the rows' and the columns' offsets
    for k, (sum_of_squares, count) in enumerate(((ss_row, rows - 1), (ss_column, columns - 1))):
        square = sum_of_squares / ((frames - 1) * max(count, 1))
        if count and stats.f.sf(square / max(pixel, 1e-12), (frames - 1) * count, dof) < LINES_P:
            lines += square - pixel
            own[k] = (square - pixel) / (columns, rows)[k]
            spread += count * (square**2 - pixel**2)
            white = pixel
    return _Temporal(ss_frame / (frames - 1), white, lines, spread, rest, *own)


def _variance(
    temporal: _Temporal, pairs: list[tuple[int, int, float]], n: int, frames: int
) -> tuple[float, float, float]:
    """Return temporal variance, its standard error (DN^2) and the excess kurtosis."""
    if frames < 2 or n < 2:
        return np.nan, np.nan, np.nan
    variance = temporal.rest / ((frames - 1) * (n - 1))
    kurtosis = _kurtosis(pairs, n)
    spread = (n - 1) * temporal.white**2 + temporal.line_spread
    square = 2 * spread / ((frames - 1) * (n - 1) ** 2)
    if np.isfinite(kurtosis):
        # Counted as far as it exceeds its own error; -2 is the least there is.
        error2 = 4 * 24 / (n * len(pairs))
        known = kurtosis * max(0.0, 1 - error2 / max(kurtosis**2, 1e-30))
        square += max(known, -1.9) * variance**2 / (frames * n)
    return variance, float(np.sqrt(max(square, 0.0))), kurtosis


def _kurtosis(pairs: list[tuple[int, int, float]], n: int) -> float:
    """Return the excess kurtosis of the noise: twice that of differences of two frames."""
    second = fourth = 0.0
    for d1, d2, d4 in pairs:
        shift, m2 = d1 / n, d2 / n
        centred = m2 - shift**2
        second += centred
        # The third moment of a difference of equal frames is zero.
        fourth += d4 / n - 6 * shift**2 * centred - shift**4
    if not pairs or second <= 0:
        return np.nan
    m2, m4 = second / len(pairs), fourth / len(pairs)
    return 2 * (m4 / m2**2 - 3)


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else np.nan
