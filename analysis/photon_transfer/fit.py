"""Fit the paper's camera model to a recording: statistics -> black level -> segments -> figures.

Every decision that a reader of the numbers must know of is a sentence in `Fit.remarks`.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy import stats

from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.distribution import Distribution, noise_distribution
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.levels import (
    CLIPPED_SHARE,
    FittedLevel,
    dark_of,
    leave_out,
    levels_of,
    points_of,
    saturation_of,
    with_residual,
)
from analysis.photon_transfer.lines import Line, Points
from analysis.photon_transfer.model_figures import model_figures
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.remarks import DIFFERENT_P, remark_on_fit
from analysis.photon_transfer.segments import SegmentFit, fit_segments, lines_between
from analysis.photon_transfer.statistics import LevelStatistics, expose_statistics
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.errors import InputError


@dataclass(frozen=True)
class ChannelFit:
    """What one channel by itself says.

    Attributes
    ----------
    dark
        Its black level and dark current; None without darks.
    lines
        Its own slope and intercept in each segment; None where it has fewer than two levels there.
    figures
        EMVA 1288's figures of merit; empty without darks.
    """

    dark: DarkLine | None
    lines: tuple[Line | None, ...]
    figures: tuple[Quantity, ...]


@dataclass(frozen=True)
class Fit:
    """The camera model that a recording asks for, and how well it is known.

    Attributes
    ----------
    name, cfa, white_level, bit_depth
        The sensor's.
    black_dn, black_se_dn
        Black level over all channels; the error is None where darks are missing (nominal level).
    segments
        Slopes (DN), intercepts (DN^2, rounding's 1/12 taken off) and switches (DN above black).
    levels
        Every level of every channel, used or not.
    channels
        Each channel by itself.
    homogeneity_p
        How likely chance makes the channels' lines differ as they do; nan with one channel.
    saturation_dn
        Where the charge stops growing below the white level; None where it was not seen.
    full_well_dn, full_well_reached
        Largest level used or `saturation_dn`; whether levels beyond it were seen to saturate.
    quantities
        Gain, read noise, full well and dynamic range of the fitted model.
    distribution
        Noise at one level, for the figure; None where there is no usable flat.
    remarks
        What limits these numbers, in sentences.
    """

    name: str
    cfa: Cfa
    white_level: float
    bit_depth: int
    black_dn: float
    black_se_dn: float | None
    segments: SegmentFit
    levels: tuple[FittedLevel, ...]
    channels: dict[str, ChannelFit]
    homogeneity_p: float
    saturation_dn: float | None
    full_well_dn: float
    full_well_reached: bool
    quantities: tuple[Quantity, ...]
    distribution: Distribution | None
    remarks: tuple[str, ...]

    @property
    def camera(self) -> Camera:
        """The camera model; raises `InputError` where the fit is no possible camera."""
        ends = [switch.middle_dn for switch in self.segments.switches]
        pieces = []
        for number, line in enumerate(self.segments.lines):
            if line.slope_dn < 0:
                fact = f"is {line.slope_dn:.4g} +- {line.slope_se_dn:.2g} DN, must not be negative"
                raise InputError.of(
                    self.name, f"noise.segment[{number}].slope", f"{fact}: record more levels"
                )
            pieces.append(
                Segment(
                    upper_dn=ends[number] if number < len(ends) else None,
                    slope=line.slope_dn,
                    intercept=line.intercept_dn2,
                    slope_se=line.slope_se_dn,
                    intercept_se=line.intercept_se_dn2,
                )
            )
        return Camera(
            name=self.name,
            cfa=self.cfa,
            black_level=max(self.black_dn, 0.0),
            white_level=self.white_level,
            bit_depth=self.bit_depth,
            saturation_dn=self.saturation_dn,
            noise=BaseNoise(segment=tuple(pieces)),
        )


def fit_camera(
    recording: Recorded,
    segments: int | None = None,
    *,
    threads: int = 1,
    distribution_of: str | None = None,
) -> Fit:
    """Return the camera model of a recording, in one pass over its frames.

    Parameters
    ----------
    recording
        Darks and flats; scenes are passed over. The flat of the distribution is read again.
    segments
        Number of read-out segments; None: as many as the data need.
    threads
        Exposures measured at the same time; the result does not depend on it.
    distribution_of
        The exposure whose noise distribution is kept; None: the flat nearest half of the range.

    Raises
    ------
    InputError
        Where no camera can be fitted: why each exposure is of no use.
    """
    remarks: list[str] = []
    measured = _measure(recording, threads, remarks)
    names = list(dict.fromkeys(np.ravel(channel_names(recording.sensor.cfa)).tolist()))
    darks = {name: dark_of(measured, name) for name in names}
    black, black_se = _black(recording, darks, remarks)
    levels = levels_of(measured, darks, recording.sensor.black_level)
    saturation = saturation_of(levels)
    levels = leave_out(levels, saturation, remarks)
    points = points_of(levels)
    found = _fit(recording, levels, points, segments, black_se or 0.0)
    levels = [with_residual(level, found) for level in levels]
    lines = {}
    for name in names:
        own = points.scattered(found.scatter).part(points.channel == name)
        lines[name] = lines_between(own, found.switches)
    alike = _homogeneity(found, lines, points.scattered(found.scatter))
    used = [level for level in levels if not level.left_out and level.statistics.kind == "flat"]
    full = saturation if saturation is not None else max(level.x_dn for level in used)
    reached = saturation is not None or any(
        level.statistics.clipped_high > CLIPPED_SHARE for level in levels
    )
    channels = {
        name: ChannelFit(
            darks[name],
            lines[name][0],
            figures_of_merit([s for s in measured if s.channel == name]),
        )
        for name in names
    }
    remark_on_fit(found, alike, darks, levels, remarks, reached=reached)
    return Fit(
        name=recording.sensor.name,
        cfa=recording.sensor.cfa,
        white_level=float(recording.sensor.white_level),
        bit_depth=recording.sensor.bit_depth,
        black_dn=black,
        black_se_dn=black_se,
        segments=found,
        levels=tuple(levels),
        channels=channels,
        homogeneity_p=alike,
        saturation_dn=saturation,
        full_well_dn=full,
        full_well_reached=reached,
        quantities=model_figures(found, full, reached=reached),
        distribution=noise_distribution(recording, _chosen(distribution_of, used, recording)),
        remarks=tuple(dict.fromkeys(remarks)),
    )


def _measure(recording: Recorded, threads: int, remarks: list[str]) -> list[LevelStatistics]:
    exposures = [e for e in recording.exposures if str(e.kind) in ("dark", "flat")]
    scenes = len(recording.exposures) - len(exposures)
    if scenes:
        remarks.append(f"{scenes} exposure(s) of kind scene are not used.")
    if threads > 1:
        with ThreadPoolExecutor(threads) as pool:
            parts = list(pool.map(lambda e: expose_statistics(recording, e), exposures))
    else:
        parts = [expose_statistics(recording, exposure) for exposure in exposures]
    return [statistics for part in parts for statistics in part]


def _black(
    recording: Recorded, darks: dict[str, DarkLine | None], remarks: list[str]
) -> tuple[float, float | None]:
    """Return the black level over all channels and its error, scaled where channels differ."""
    known = [dark for dark in darks.values() if dark is not None]
    if not known:
        remarks.append(
            f"No usable darks: the black level is the nominal {recording.sensor.black_level:g} DN, "
            "unchecked; an error of it moves every intercept by slope times the error."
        )
        return recording.sensor.black_level, None
    value = np.array([dark.black_dn for dark in known])
    weight = 1 / np.array([dark.black_se_dn for dark in known]) ** 2
    mean = float((weight * value).sum() / weight.sum())
    error = float(1 / np.sqrt(weight.sum()))
    misfit = float((weight * (value - mean) ** 2).sum())
    if len(known) > 1 and stats.chi2.sf(misfit, len(known) - 1) < DIFFERENT_P:
        error *= float(np.sqrt(misfit / (len(known) - 1)))
        remarks.append(
            f"The channels' black levels differ by up to {np.ptp(value):.3g} DN, more than chance: "
            "each channel's own is used for its levels, the model has their mean."
        )
    return mean, error


def _fit(
    recording: Recorded,
    levels: Sequence[FittedLevel],
    points: Points,
    segments: int | None,
    black_se: float,
) -> SegmentFit:
    name = recording.sensor.name
    flats = [level for level in levels if level.statistics.kind == "flat"]
    if not any(not level.left_out for level in flats):
        reasons = dict.fromkeys(f"{level.statistics.exposure}: {level.left_out}" for level in flats)
        why = "; ".join(list(reasons)[:8]) or "the recording has no exposure of kind flat"
        raise InputError.of(name, "exposure", f"no flat can be used ({why})")
    try:
        return fit_segments(points, segments, black_se)
    except ValueError as error:
        key = "exposure" if segments is None else f"--segments {segments}"
        fact = f"too few usable levels, darks counted as one: {error}"
        raise InputError.of(name, key, fact) from None


def _homogeneity(
    fit: SegmentFit,
    lines: dict[str, tuple[tuple[Line | None, ...], float, int]],
    points: Points,
) -> float:
    """Return how likely chance makes the channels differ as they do."""
    parts = list(lines.values())
    if len(parts) < 2 or any(line is None for own, _, _ in parts for line in own):
        return float("nan")
    separate, parameters = sum(part[1] for part in parts), sum(part[2] for part in parts)
    _, pooled, fewer = lines_between(points, fit.switches)
    return float(stats.chi2.sf(max(pooled - separate, 0.0), parameters - fewer))


def _chosen(wanted: str | None, used: Sequence[FittedLevel], recording: Recorded) -> str:
    names = [exposure.name for exposure in recording.exposures]
    if wanted is not None:
        if wanted not in names:
            fact = f"is {wanted!r}, must be an exposure of the recording: {', '.join(names[:20])}"
            raise InputError.of(recording.sensor.name, "distribution_of", fact)
        return wanted
    half = 0.5 * max(level.x_dn for level in used)
    return min(used, key=lambda level: abs(level.x_dn - half)).statistics.exposure
