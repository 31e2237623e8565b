"""A statistic against signal, light, exposure time or lag: what differs, and what is left of it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from analysis.figures import ALARM, COLOURS, GREY, INK
from analysis.figures_camera import CHANNEL_COLOURS, CHANNEL_MARKS
from analysis.mismatch.evidence import Array, Curve
from analysis.mismatch.report.figures.ticks import plain_numbers, symmetric_scale

SIZE_INCHES = (9.6, 3.3)
AXIS = {
    "signal_dn": "signal above black, DN",
    "light": "light, as recorded",
    "exposure_time_s": "exposure time, s",
    "lag_pixels": "lag, pixels",
    "code_before": "code of the sample before, within the period",
}
_WIDE = 20.0  # largest over smallest from which on an axis is logarithmic


def draw(figure: Figure, curves: Sequence[Curve], threshold_z: float) -> None:
    """Draw departures from the base model beside their sizes in standard deviations.

    Left: recorded less base model, the band that chance fills, and the line that the named physics
    adds. Right: departures from the base model (hollow) and from the final one (full).
    """
    left, right = figure.subplots(1, 2)
    _differences(left, curves, threshold_z, curves[0].unit)
    _standard(right, curves, threshold_z)


def draw_transfer(figure: Figure, curves: Sequence[Curve], threshold_z: float) -> None:
    """Draw photon transfer: variance against signal, departures from the line in percent, and z."""
    left, middle, right = figure.subplots(1, 3)
    for curve in curves:
        order = np.argsort(curve.x)
        x = curve.x[order]
        colour = CHANNEL_COLOURS.get(curve.channel, INK)
        mark = CHANNEL_MARKS.get(curve.channel, "o")
        left.plot(x, curve.expected_before[order], color=ALARM, lw=1.0)
        if curve.expected_after is not None:
            left.plot(x, curve.expected_after[order], color=COLOURS[0], lw=1.0, ls=(0, (5, 3)))
        seen = curve.observed[order]
        left.plot(x, seen, mark, color=colour, ms=4, label=_label(curve), zorder=3)
    left.plot([], [], color=ALARM, label="base model")
    if _named(curves):
        left.plot([], [], color=COLOURS[0], ls=(0, (5, 3)), label="physics named")
    if min(float(np.nanmin(c.observed)) for c in curves) > 0:
        left.set_yscale("log")
        plain_numbers(left.yaxis)
    left.set_ylabel("variance of a pixel, DN\u00b2")
    left.set_title("Photon transfer", loc="left")
    left.legend(loc="best")
    _finish(left, curves)
    _differences(middle, [_in_percent(curve) for curve in curves], threshold_z, "%")
    _standard(right, curves, threshold_z)


def _in_percent(curve: Curve) -> Curve:
    """Return a curve in percent of the base model."""
    base = curve.expected_before
    after = curve.expected_after
    return replace(
        curve,
        observed=100 * curve.observed / base,
        expected_before=np.full(base.shape, 100.0),
        expected_after=None if after is None else 100 * after / base,
        sd=100 * curve.sd / base,
        sd_after=None if curve.sd_after is None else 100 * curve.sd_after / base,
        unit="%",
    )


def _label(curve: Curve) -> str:
    return {"": "recorded", "MONO": "recorded", "G": "Gr over Gb"}.get(curve.channel, curve.channel)


def _named(curves: Sequence[Curve]) -> bool:
    return any(curve.expected_after is not None for curve in curves)


def _differences(axes: Axes, curves: Sequence[Curve], threshold_z: float, unit: str) -> None:
    for curve in curves:
        _departures(axes, curve, threshold_z, alone=len(curves) == 1)
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    of = f", {unit}".replace("^2", "\u00b2") if unit else ""
    axes.set_ylabel(f"recorded less base model{of}")
    axes.set_title("What differs", loc="left")
    if _named(curves):
        axes.plot([], [], color=COLOURS[0] if len(curves) == 1 else GREY, label="physics named")
    _range(axes, curves, threshold_z)
    axes.legend(loc="best")
    _finish(axes, curves)


def _departures(axes: Axes, curve: Curve, threshold_z: float, *, alone: bool) -> None:
    order = np.argsort(curve.x)
    x, sd = curve.x[order], curve.sd[order]
    colour = CHANNEL_COLOURS.get(curve.channel, INK)
    band = threshold_z * sd
    axes.fill_between(x, -band, band, color=GREY, alpha=0.18 if alone else 0.07, lw=0)
    if curve.expected_after is not None:
        added = (curve.expected_after - curve.expected_before)[order]
        line = COLOURS[0] if curve.channel in ("", "MONO") else colour
        axes.plot(x, added, color=line, lw=1.4)
        if curve.sd_after is not None and alone:
            reach = threshold_z * curve.sd_after[order]
            axes.fill_between(x, added - reach, added + reach, color=line, alpha=0.1, lw=0)
    seen = (curve.observed - curve.expected_before)[order]
    mark = CHANNEL_MARKS.get(curve.channel, "o")
    axes.plot(x, seen, mark, color=colour, ms=4.5, label=_label(curve), zorder=3)


def _range(axes: Axes, curves: Sequence[Curve], threshold_z: float) -> None:
    """Choose a scale of differences: where chance is little at one end, that end is seen too."""
    bands = np.concatenate([threshold_z * curve.sd for curve in curves])
    bands = bands[np.isfinite(bands) & (bands > 0)]
    seen = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    seen = seen[np.isfinite(seen)]
    if not bands.size or not seen.size:
        return
    low = min(float(seen.min()), -float(bands.max()))
    high = max(float(seen.max()), float(bands.max()))
    if max(-low, high) > _WIDE * bands.min():
        symmetric_scale(axes, 2.5 * low, 2.5 * high, float(bands.min()))


def _departure(curve: Curve, expected: Array | None, z: Array | None) -> Array | None:
    """Return departures in standard deviations; None: no such model."""
    if z is not None or expected is None:
        return z
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((curve.observed - expected) / curve.sd)


def largest_z(curve: Curve) -> float:
    """Return the largest departure from either model, in standard deviations."""
    both = (
        _departure(curve, curve.expected_before, curve.z_before),
        _departure(curve, curve.expected_after, curve.z_after),
    )
    seen = np.abs(np.concatenate([z for z in both if z is not None]))
    return float(seen[np.isfinite(seen)].max(initial=0.0))


def _standard(axes: Axes, curves: Sequence[Curve], threshold_z: float) -> None:
    """Draw departures on a scale linear within the band of chance, logarithmic beyond."""
    for curve in curves:
        mark = CHANNEL_MARKS.get(curve.channel, "o")
        before = _departure(curve, curve.expected_before, curve.z_before)
        after = _departure(curve, curve.expected_after, curve.z_after)
        if before is not None:
            axes.plot(curve.x, before, mark, mfc="white", mec=ALARM, ms=5, zorder=3)
        if after is not None:
            axes.plot(curve.x, after, mark, color=COLOURS[0], ms=4, zorder=4)
    axes.axhspan(-threshold_z, threshold_z, color=GREY, alpha=0.18, lw=0, label="chance")
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    axes.plot([], [], "o", mfc="white", mec=ALARM, label="before")
    if _named(curves):
        axes.plot([], [], "o", color=COLOURS[0], label="after")
    seen = np.concatenate([np.asarray(line.get_ydata(), np.float64) for line in axes.lines])
    seen = seen[np.isfinite(seen)]
    least = 1.5 * threshold_z
    low = min(1.15 * float(seen.min(initial=0.0)), -least)
    high = max(1.15 * float(seen.max(initial=0.0)), least)
    axes.set_ylabel("departure, standard deviations")
    if max(-low, high) > 4 * threshold_z:
        symmetric_scale(axes, 1.6 * low, 1.6 * high, threshold_z)
    else:
        axes.set_ylim(low, high)
    axes.set_title("Before and after" if _named(curves) else "How far", loc="left")
    axes.legend(loc="best", ncols=3, columnspacing=0.8, handlelength=1.2, handletextpad=0.5)
    _finish(axes, curves)


def _finish(axes: Axes, curves: Sequence[Curve]) -> None:
    axes.grid(visible=True)
    axes.set_axisbelow(True)
    _abscissa(axes, curves)


def _abscissa(axes: Axes, curves: Sequence[Curve]) -> None:
    against = curves[0].against
    axes.set_xlabel(AXIS[against])
    x = np.concatenate([curve.x for curve in curves])
    x = x[np.isfinite(x)]
    positive = x[x > 0]
    if against in ("lag_pixels", "code_before") or positive.size < 2:
        return
    # The dark stands on the straight part about 0.
    start = float(np.quantile(positive, 0.1)) if x.min() <= 0 else float(positive.min())
    if positive.max() <= _WIDE * start:
        return
    if x.min() > 0:
        axes.set_xscale("log")
        axes.set_xlim(float(x.min()) / 1.4, 1.4 * float(x.max()))
    else:
        axes.set_xscale("symlog", linthresh=start, linscale=0.5)
        axes.set_xlim(float(x.min()) - 0.4 * start, 1.4 * float(x.max()))
        steps = [factor * 10.0**power for power in range(-6, 9) for factor in (1, 3)]
        seen = [step for step in steps if start <= step <= 1.4 * x.max()]
        axes.xaxis.set_major_locator(FixedLocator([0.0, *(seen[::2] if len(seen) > 4 else seen)]))
    plain_numbers(axes.xaxis)
