"""What limits the numbers of a fit, in sentences."""

from collections.abc import Sequence

from scipy import stats

from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.levels import WANDER_P, FittedLevel
from analysis.photon_transfer.segments import SegmentFit

DIFFERENT_P = 1e-3  # channels that differ more than chance does so often differ


def remark_on_fit(
    fit: SegmentFit,
    alike: float,
    darks: dict[str, DarkLine | None],
    levels: Sequence[FittedLevel],
    remarks: list[str],
    *,
    reached: bool,
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
