"""Fit the paper's camera model to a recording: statistics -> black level -> segments -> figures.

Every decision that a reader of the numbers must know of is a sentence in `Fit.remarks`.
"""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy import stats

from analysis.photon_transfer.black import DarkLine, dark_line
from analysis.photon_transfer.distribution import Distribution, noise_distribution
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.recorded import Recorded, channel_names
from analysis.photon_transfer.rounding import unrounded
from analysis.photon_transfer.segments import (
    Line,
    Points,
    SegmentFit,
    fit_segments,
    lines_between,
)
from analysis.photon_transfer.statistics import LevelStatistics, expose_statistics
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.errors import InputError

CLIPPED_SHARE = 1e-4  # a level with more clipped samples is left out
COLLAPSE = 0.5  # variance below this share of its maximum, for good: the charge is full
WANDER_P = 1e-3  # frame means that wander more than chance does so often are counted as wandering
DIFFERENT_P = 1e-3  # channels that differ more than chance does so often differ


@dataclass(frozen=True)
class FittedLevel:
    """One level of one channel as the fit saw it.

    Attributes
    ----------
    statistics
        What was measured, in raw codes.
    x_dn, x_se_dn
        Level above black, before rounding.
    noise_dn2, noise_se_dn2
        Temporal variance before rounding.
    left_out
        Why the fit does not use it; empty where it does.
    z
        (noise - fitted line) in standard errors.
    """

    statistics: LevelStatistics
    x_dn: float
    x_se_dn: float
    noise_dn2: float
    noise_se_dn2: float
    left_out: str
    z: float


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
    darks = {name: _dark(measured, name) for name in names}
    black, black_se = _black(recording, darks, remarks)
    levels = _levels(measured, darks, recording.sensor.black_level)
    saturation = _saturation(levels)
    levels = _leave_out(levels, saturation, remarks)
    points = _points(levels)
    found = _fit(recording, levels, points, segments, black_se or 0.0)
    levels = [_with_residual(level, found) for level in levels]
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
    _remark(found, alike, darks, levels, remarks, reached=reached)
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
        quantities=_quantities(found, full, reached=reached),
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


def _dark(measured: Sequence[LevelStatistics], channel: str) -> DarkLine | None:
    """Return the black level of one channel, from the darks that are not clipped at code 0."""
    usable = [
        s
        for s in measured
        if s.kind == "dark" and s.channel == channel and not _useless(s) and s.frames > 1
    ]
    if not usable:
        return None
    times, levels, errors = [], [], []
    for s in usable:
        plain = unrounded(s.level_dn, s.level_se_dn, s.variance_dn2, s.variance_se_dn2, s.fixed_dn2)
        # A frame offset that wanders moves the mean more than the pixels' noise does.
        wanders = stats.f.sf(s.wander, s.frames - 1, 1e6) < WANDER_P
        error = plain.level_se_dn * (np.sqrt(s.wander) if wanders else 1.0)
        times.append(s.exposure_time_s)
        levels.append(plain.level_dn)
        errors.append(float(error))
    return dark_line(times, levels, errors)


def _useless(s: LevelStatistics) -> str:
    """Return why a level cannot be used; empty where it can."""
    if s.frames < 2:
        return "one frame only: no noise to be seen"
    if s.clipped_high > CLIPPED_SHARE:
        return "more than 0.01 % of its samples are at the white level"
    if s.clipped_low > CLIPPED_SHARE:
        return "more than 0.01 % of its samples are at code 0"
    if s.repeated_frames:
        return "frames equal the frame before bit for bit"
    if not s.variance_dn2 > 0 or not s.variance_se_dn2 > 0:
        return "its frames do not vary"
    return ""


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


def _levels(
    measured: Iterable[LevelStatistics], darks: dict[str, DarkLine | None], nominal_dn: float
) -> list[FittedLevel]:
    levels = []
    for s in measured:
        dark, why = darks[s.channel], _useless(s)
        plain = unrounded(s.level_dn, s.level_se_dn, s.variance_dn2, s.variance_se_dn2, s.fixed_dn2)
        if not why and not plain.recovered:
            why = "its noise is too small beside one code to be recovered from rounding"
        x = plain.level_dn - (dark.black_dn if dark else nominal_dn)
        if s.kind == "dark":
            if dark is None:
                why = why or "no usable dark of this channel"
            else:
                # The wander of the offset is no signal; only a dark current is.
                x = _dark_signal(dark, s.exposure_time_s)
        levels.append(
            FittedLevel(
                s,
                x,
                plain.level_se_dn,
                plain.variance_dn2,
                plain.variance_se_dn2,
                why,
                float("nan"),
            )
        )
    return levels


def _dark_signal(dark: DarkLine, exposure_time_s: float) -> float:
    current, error = dark.current_dn_per_s, dark.current_se_dn_per_s
    if current is None or error is None or current < 3 * error:
        return 0.0
    return current * exposure_time_s


def _saturation(levels: Sequence[FittedLevel]) -> float | None:
    """Return the level (DN above black) at which charge stops growing below the white level.

    Seen where the variance falls below half of its maximum at a higher level and stays there.
    """
    plateaus = []
    for channel in {level.statistics.channel for level in levels}:
        flats = sorted(
            (
                level
                for level in levels
                if level.statistics.kind == "flat"
                and level.statistics.channel == channel
                and level.statistics.frames > 1
                and level.statistics.clipped_high <= CLIPPED_SHARE
            ),
            key=lambda level: level.x_dn,
        )
        if len(flats) < 3:
            continue
        variance = np.array([level.statistics.variance_dn2 for level in flats])
        top = int(np.argmax(variance))
        full = [f for f, v in zip(flats[top + 1 :], variance[top + 1 :], strict=True)
                if v < COLLAPSE * variance[top]]  # fmt: skip
        if full and variance[-1] < COLLAPSE * variance[top]:
            plateaus.append(float(np.mean([level.x_dn for level in full])))
    return float(np.mean(plateaus)) if plateaus else None


def _leave_out(
    levels: Sequence[FittedLevel], saturation: float | None, remarks: list[str]
) -> list[FittedLevel]:
    """Mark the levels at saturation and say, once for each reason, what is left out."""
    kept = []
    for level in levels:
        why = level.left_out
        # Closer than 3.7 sd, more than 1e-4 of the pixels are full.
        near = 3.7 * np.sqrt(max(level.noise_dn2, 0.0) + max(level.statistics.fixed_dn2, 0.0))
        if not why and saturation is not None and level.x_dn + near > saturation:
            why = f"the charge is full at {saturation:.5g} DN"
        kept.append(
            FittedLevel(
                level.statistics,
                level.x_dn,
                level.x_se_dn,
                level.noise_dn2,
                level.noise_se_dn2,
                why,
                level.z,
            )
        )
    reasons: dict[str, list[str]] = {}
    for level in kept:
        if level.left_out:
            s = level.statistics
            reasons.setdefault(level.left_out, []).append(f"{s.exposure} ({s.channel})")
    for reason, which in reasons.items():
        shown = ", ".join(which[:12]) + (f" and {len(which) - 12} more" if which[12:] else "")
        remarks.append(f"Left out, {reason}: {shown}.")
    return kept


def _points(levels: Sequence[FittedLevel]) -> Points:
    used = [level for level in levels if not level.left_out]
    return Points.of(
        x_dn=np.array([level.x_dn for level in used], float),
        variance_dn2=np.array([level.noise_dn2 for level in used], float),
        relative_se=np.array(
            [level.noise_se_dn2 / max(level.noise_dn2, 1e-9) for level in used], float
        ),
        x_se_dn=np.array([level.x_se_dn for level in used], float),
        channel=np.array([level.statistics.channel for level in used], np.str_),
        black_share=np.array(
            [0.0 if level.statistics.kind == "dark" else -1.0 for level in used], float
        ),
    )


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


def _with_residual(level: FittedLevel, fit: SegmentFit) -> FittedLevel:
    line = float(fit.variance_dn2(np.array([level.x_dn]))[0])
    error = abs(line) * level.noise_se_dn2 / max(level.noise_dn2, 1e-9)
    z = (level.noise_dn2 - line) / error if error > 0 else float("nan")
    return FittedLevel(
        level.statistics,
        level.x_dn,
        level.x_se_dn,
        level.noise_dn2,
        level.noise_se_dn2,
        level.left_out,
        z,
    )


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


def _quantities(fit: SegmentFit, full_well_dn: float, *, reached: bool) -> tuple[Quantity, ...]:
    """Return the model's figures: gain and read noise of the first segment, full well of the last.

    Where a switch changes the slope alone, electrons before it and after it differ by that ratio.
    """
    first = fit.lines[0]
    slope, slope_se = first.slope_dn, first.slope_se_dn
    read2, read2_se = first.intercept_dn2, first.intercept_se_dn2
    if not slope > 0:
        return ()
    gain = Quantity("gain", "DN/e-", slope, slope_se, "slope of the lowest segment")
    inverse = Quantity("1/gain", "e-/DN", 1 / slope, slope_se / slope**2, "its inverse")
    top = fit.lines[-1]
    full = full_well_dn / top.slope_dn if top.slope_dn > 0 else None
    bound = "saturation over the highest slope" if reached else "at least: none saturates"
    full_se = None if full is None else full * top.slope_se_dn / top.slope_dn
    well = Quantity("full_well", "e-", full, full_se, bound)
    if not read2 > 0:
        none = "the intercept is not positive"
        return (gain, inverse, Quantity("read_noise", "e-", None, None, none), well)
    read = float(np.sqrt(read2))
    read_se = read2_se / (2 * read)
    covariance = first.covariance[0][1]
    electrons = read / slope
    relative = (read_se / read) ** 2 + (slope_se / slope) ** 2 - covariance / (read2 * slope)
    electrons_se = electrons * float(np.sqrt(max(relative, 0.0)))
    found = [
        gain,
        inverse,
        Quantity("read_noise", "DN", read, read_se, "sqrt(intercept), rounding taken off"),
        Quantity("read_noise", "e-", electrons, electrons_se, "sqrt(intercept) / slope"),
        well,
    ]
    if full is not None:
        ratio = full / electrons
        error = float(np.hypot((full_se or 0.0) / full, electrons_se / electrons))
        means = "full well over read noise"
        found += [
            Quantity("dynamic_range", "dB", float(20 * np.log10(ratio)), 8.686 * error, means),
            Quantity("dynamic_range", "stops", float(np.log2(ratio)), 1.443 * error, means),
        ]
    return tuple(found)


def _remark(
    fit: SegmentFit,
    alike: float,
    darks: dict[str, DarkLine | None],
    levels: Sequence[FittedLevel],
    remarks: list[str],
    *,
    reached: bool,
) -> None:
    if fit.dof == 0:
        remarks.append("No level is left over: whether the variance is straight was not tested.")
    if fit.scatter > 0:
        remarks.append(
            "The variance is not on straight lines: deviance / dof = "
            f"{fit.deviance / fit.dof:.3g}. The levels scatter by {100 * fit.scatter:.2g} % more "
            "than their errors allow; that is included in the errors of slopes and intercepts. Physics "
            "beyond the model is at work."
        )
    if fit.bends:
        remarks.append(
            "The variance bends; a smooth bend explains it as well as a switch: one segment."
        )
    if alike < DIFFERENT_P:
        remarks.append(
            f"The channels' lines differ (p = {alike:.1g}): one slope and intercept stand for all."
        )
    if not reached:
        remarks.append("No level saturates: full well and dynamic range are lower limits.")
    for name, dark in darks.items():
        if dark is not None and dark.black_dn < 0:
            remarks.append(f"The black level of {name} extrapolates to {dark.black_dn:.3g} DN < 0.")
    remarks.extend(_remarks_on_levels(levels))


def _remarks_on_levels(levels: Sequence[FittedLevel]) -> list[str]:
    remarks = []
    if all(level.statistics.kind != "dark" or level.left_out for level in levels):
        remarks.append("The intercept is extrapolated: no usable dark supports it.")
    wandering = [
        f"{level.statistics.exposure} ({100 * level.statistics.frame_sd_dn / level.x_dn:.2g} %)"
        for level in levels
        if level.statistics.kind == "flat"
        and level.statistics.frames > 1
        and stats.f.sf(level.statistics.wander, level.statistics.frames - 1, 1e6) < WANDER_P
    ]
    if wandering:
        remarks.append(
            "The mean changes from frame to frame and was removed in: "
            + ", ".join(list(dict.fromkeys(wandering))[:6])
            + (" ..." if len(wandering) > 6 else "")
            + "."
        )
    small = [s for s in levels if s.statistics.variance_dn2 < 0.5 and not s.left_out]
    if small:
        remarks.append(
            "Noise below 0.7 DN was corrected for rounding as Gaussian noise with Gaussian offsets."
        )
    return remarks
