"""What limits the numbers of a fit, in sentences."""

from collections.abc import Mapping, Sequence
from math import hypot, sqrt

import numpy as np
from scipy import stats

from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.described import Described, contradictions
from analysis.photon_transfer.levels import WANDER_P, FittedLevel, spoiled
from analysis.photon_transfer.parts import P_SEEN
from analysis.photon_transfer.patterns import LEAST_GAIN, FixedPatterns
from analysis.photon_transfer.projections import OUTLIER_SD
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.segments import SegmentFit
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.recording.hygiene import CLIPPED_SHARE

SATURATED = "saturation over the highest slope"
CONVERTER = "the converter clips first: lower limit of the full well"
UNREACHED = "at least: none saturates"

_WEAK = "the fixed pattern is too weak to be seen beside the noise of these frames"
_WHY = {"PRNU1288": "beside noise, flats have no stronger a fixed pattern than darks have"}

DIFFERENT_P = 1e-3  # channels that differ more than chance does so often differ


def remark_on_fit(
    fit: SegmentFit,
    alike: float,
    darks: dict[str, DarkLine | None],
    levels: Sequence[FittedLevel],
    remarks: list[str],
    *,
    full_well_means: str,
) -> None:
    """Add what limits a fit and its levels to `remarks`."""
    if fit.dof == 0:
        remarks.append("No level is left over: whether the variance is straight was not tested.")
    if fit.scatter > 0:
        remarks.append(
            "The variance is not on straight lines: deviance / dof = "
            f"{fit.deviance / fit.dof:.3g}. The levels scatter by {100 * fit.scatter:.2g} % more "
            "than their errors allow; that is included in the errors of slopes and intercepts. "
            "Physics beyond the model is at work."
        )
    if fit.bends:
        remarks.append(
            "The variance bends; a smooth bend explains it as well as a switch: one segment."
        )
    if alike < DIFFERENT_P:
        remarks.append(
            f"The channels' lines differ (p = {alike:.1g}): one slope and intercept stand for all."
        )
    if full_well_means == CONVERTER:
        remarks.append(
            "The converter clips before the charge is full: full well and dynamic range are lower "
            "limits, (white level - black level) / gain."
        )
    if full_well_means == UNREACHED:
        remarks.append("No level saturates: full well and dynamic range are lower limits.")
    for name, dark in darks.items():
        if dark is not None and dark.black_dn < 0:
            remarks.append(f"The black level of {name} extrapolates to {dark.black_dn:.3g} DN < 0.")
    remarks.extend(_remarks_on_levels(levels))
    remarks.extend(_remarks_on_lines(levels))


def remarks_on_clipped_darks(measured: Sequence[LevelStatistics], nominal_dn: float) -> list[str]:
    """Return a remark for each clipped dark whose mean a pedestal at the nominal black forbids.

    Clipping at code 0 only lifts a mean, by at most 0.4 of the noise's standard deviation.
    """
    remarks = []
    for s in measured:
        if s.kind != "dark" or s.frames < 2 or s.clipped_low <= CLIPPED_SHARE:
            continue
        # Clipped noise is narrower than it was: three of its own sd leave room for that.
        room = 3 * float(np.sqrt(max(s.variance_dn2, 0.0) + max(s.fixed_dn2, 0.0))) + 0.5
        if s.level_dn < nominal_dn - 3 * s.level_se_dn - 0.5 or s.level_dn > nominal_dn + room:
            current = " or a dark current adds to it" if s.level_dn > nominal_dn else ""
            remarks.append(
                f"{s.exposure} ({s.channel}): {100 * s.clipped_low:.3g} % of its samples are at "
                f"code 0 and its mean is {s.level_dn:.4g} DN: the nominal black level "
                f"{nominal_dn:g} DN is wrong{current}, and every intercept with it."
            )
    return remarks


def remarks_on_description(measured: Sequence[LevelStatistics], nominal_dn: float) -> list[str]:
    """Return what of a recording's description the levels of its darks and flats contradict."""
    by: dict[str, list[LevelStatistics]] = {}
    for s in measured:
        by.setdefault(s.exposure, []).append(s)
    told = [
        Described.of(
            name,
            own[0].kind,
            own[0].exposure_time_s,
            own[0].light,
            [(s.level_dn, _error_dn(s), s.variance_dn2) for s in own],
        )
        for name, own in by.items()
        if not any(spoiled(s) for s in own)
    ]
    return list(contradictions(told, nominal_dn))


def _error_dn(s: LevelStatistics) -> float:
    """Return the standard error of a level whose frames may move as a whole, DN."""
    return hypot(s.level_se_dn, s.frame_sd_dn / sqrt(s.frames))


def remarks_on_patterns(patterns: FixedPatterns) -> list[str]:
    """Return what the model, or its maps, do not have of the fixed pattern."""
    found = []
    if patterns.dead:
        found.append(
            f"{patterns.dead} pixel(s) have less than {LEAST_GAIN:g} of the mean gain: the maps "
            f"have {LEAST_GAIN:g} for them."
        )
    for by, name in ((patterns.dark, "offset"), (patterns.gain, "gain")):
        outliers = sum(p.outliers for p in by.values())
        if outliers:
            found.append(
                f"{outliers} pixel(s) are more than {OUTLIER_SD:g} standard deviations off in "
                f"{name}: maps hold them as measured, the model's "
                f"{'dsnu' if name == 'offset' else 'prnu'} leaves them out."
            )
    for channel, pattern in patterns.gain.items():
        parts = [("row", pattern.row), ("column", pattern.column)]
        if patterns.falloff is None:
            parts.append(("place, smoothly", pattern.smooth))
        found += [
            f"{channel}: gain differs by {name}, {100 * np.sqrt(part.variance):.2g} %; the maps "
            "hold it, no effect of the model does."
            for name, part in parts
            if part.p < P_SEEN and part.variance > 0
        ]
    found += [
        f"{channel}: the dark level differs by place, smoothly, {np.sqrt(p.smooth.variance):.2g} "
        "DN; the maps hold it, no effect of the model does."
        for channel, p in patterns.dark.items()
        if p.smooth.p < P_SEEN and p.smooth.variance > 0
    ]
    return found


def remarks_on_unknown(figures: Mapping[str, Sequence[Quantity]]) -> list[str]:
    """Return why tables have no value for some figures; `figures` of each channel."""
    channels: dict[str, dict[str, dict[str, None]]] = {}
    for channel, own in figures.items():
        for name in (q.name for q in own if q.value is None):
            channels.setdefault(_WHY.get(name, _WEAK), {}).setdefault(name, {})[channel] = None
    if not channels:
        return []
    said = []
    for why, names in channels.items():
        told = ", ".join(f"{name} ({', '.join(of)})" for name, of in names.items())
        said.append(f"of {told}: {why}")
    return [f"No value (-) {'; '.join(said)}."]


def _remarks_on_lines(levels: Sequence[FittedLevel]) -> list[str]:
    """Return a remark on row and column noise in the darkest level, by channel."""
    darkest: dict[str, FittedLevel] = {}
    for level in sorted((v for v in levels if not v.left_out), key=lambda v: v.x_dn):
        darkest.setdefault(level.statistics.channel, level)
    remarks = []
    for channel, level in darkest.items():
        s = level.statistics
        for name, square in (("row", s.row_variance_dn2), ("column", s.column_variance_dn2)):
            if square > 0:
                share = 100 * square / max(s.variance_dn2, 1e-12)
                remarks.append(
                    f"{channel}: {name} noise of {np.sqrt(square):.3g} DN in {s.exposure} is in "
                    f"the intercept ({share:.2g} % of the variance there); the model has it "
                    "pixel by pixel."
                )
    return remarks


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
