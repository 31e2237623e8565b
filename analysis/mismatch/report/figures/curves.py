"""A statistic against signal, light, exposure time or lag: what differs, and what is left of it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS, GREY, INK
from analysis.figures_camera import CHANNEL_COLOURS, CHANNEL_MARKS
from analysis.mismatch.evidence import Curve
from analysis.mismatch.report.figures.ticks import plain_numbers

SIZE_INCHES = (9.6, 3.3)
AXIS = {
    "signal_dn": "signal above black, DN",
    "light": "light, as recorded",
    "exposure_time_s": "exposure time, s",
    "lag_pixels": "lag, pixels",
}
_WIDE = 20.0  # largest over smallest from which on an axis is logarithmic


def draw(figure: Figure, curves: Sequence[Curve], threshold_z: float) -> None:
    """Draw departures from the base model beside their sizes in standard deviations.

    Left: recorded less base model, the band that chance fills, and the line that the named physics
    adds. Right: departures from the base model (hollow) and from the final one (full).
    """
    left, right = figure.subplots(1, 2)
    for curve in curves:
        _departures(left, curve, threshold_z)
        _deviations(right, curve)
    unit = curves[0].unit.replace("^2", "\u00b2")
    of = f", {unit}" if unit else ""
    left.axhline(0, color=GREY, lw=0.8, zorder=0)
    left.set_ylabel(f"recorded less base model{of}")
    left.set_title("What differs", loc="left")
    if any(curve.expected_after is not None for curve in curves):
        left.plot([], [], color=COLOURS[0] if len(curves) == 1 else GREY, label="physics named")
    left.legend(loc="best")
    _standard(right, curves, threshold_z)
    for axes in (left, right):
        _abscissa(axes, curves)
        axes.grid(visible=True)
        axes.set_axisbelow(True)


def _departures(axes: Axes, curve: Curve, threshold_z: float) -> None:
    order = np.argsort(curve.x)
    x, sd = curve.x[order], curve.sd[order]
    colour = CHANNEL_COLOURS.get(curve.channel, INK)
    axes.fill_between(x, -threshold_z * sd, threshold_z * sd, color=GREY, alpha=0.18, lw=0)
    if curve.expected_after is not None:
        added = (curve.expected_after - curve.expected_before)[order]
        line = COLOURS[0] if curve.channel in ("", "MONO") else colour
        axes.plot(x, added, color=line, lw=1.4)
    seen = (curve.observed - curve.expected_before)[order]
    mark = CHANNEL_MARKS.get(curve.channel, "o")
    label = "recorded" if curve.channel in ("", "MONO") else curve.channel
    axes.plot(x, seen, mark, color=colour, ms=4.5, label=label, zorder=3)


def _deviations(axes: Axes, curve: Curve) -> None:
    mark = CHANNEL_MARKS.get(curve.channel, "o")
    with np.errstate(divide="ignore", invalid="ignore"):
        before = (curve.observed - curve.expected_before) / curve.sd
        axes.plot(curve.x, before, mark, mfc="white", mec=ALARM, ms=5, zorder=3)
        if curve.expected_after is not None:
            after = (curve.observed - curve.expected_after) / curve.sd
            axes.plot(curve.x, after, mark, color=COLOURS[0], ms=4, zorder=4)


def _standard(axes: Axes, curves: Sequence[Curve], threshold_z: float) -> None:
    """Label the right panel: a scale linear within the band of chance, logarithmic beyond."""
    axes.axhspan(-threshold_z, threshold_z, color=GREY, alpha=0.18, lw=0, label="chance")
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    axes.plot([], [], "o", mfc="white", mec=ALARM, label="before")
    if any(curve.expected_after is not None for curve in curves):
        axes.plot([], [], "o", color=COLOURS[0], label="after")
    seen = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    seen = seen[np.isfinite(seen)]
    low, high = float(seen.min(initial=0.0)), float(seen.max(initial=0.0))
    most = max(-1.15 * low, 1.15 * high, 1.5 * threshold_z)
    if most > 4 * threshold_z:
        axes.set_yscale("symlog", linthresh=threshold_z)
        plain_numbers(axes.yaxis)
        most *= 1.8
    least = 1.5 * threshold_z
    axes.set_ylim(-most if low < -threshold_z else -least, most if high > threshold_z else least)
    axes.set_ylabel("departure, standard deviations")
    axes.set_title("Before and after", loc="left")
    axes.legend(loc="best", ncols=3)


def _abscissa(axes: Axes, curves: Sequence[Curve]) -> None:
    against = curves[0].against
    axes.set_xlabel(AXIS[against])
    x = np.concatenate([curve.x for curve in curves])
    x = x[np.isfinite(x)]
    positive = x[x > 0]
    if against == "lag_pixels" or positive.size < 2:
        return
    # The dark stands on the straight part about 0.
    start = float(np.quantile(positive, 0.1)) if x.min() <= 0 else float(positive.min())
    if positive.max() > _WIDE * start:
        left = float(x.min()) - 0.4 * start if x.min() <= 0 else float(x.min()) / 1.4
        axes.set_xscale("symlog" if x.min() <= 0 else "log", **_linear(start, x.min() <= 0))
        axes.set_xlim(left, 1.4 * float(x.max()))
        plain_numbers(axes.xaxis)


def _linear(reach: float, there: bool) -> dict[str, float]:
    return {"linthresh": reach, "linscale": 0.5} if there else {}
