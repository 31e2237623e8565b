"""Figures of a camera fit, in the manner of Fig. 2 of Seybold et al. (2014)."""

from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.figures import ALARM, GREY, INK, STYLE

if TYPE_CHECKING:  # the fit imports nothing that draws
    from analysis.photon_transfer.distribution import Distribution
    from analysis.photon_transfer.fit import Fit
    from analysis.photon_transfer.levels import FittedLevel

CHANNEL_COLOURS = {
    "R": "#D55E00",
    "Gr": "#009E73",
    "Gb": "#56B4E9",
    "B": "#0072B2",
    "MONO": INK,
}
CHANNEL_MARKS = {"R": "o", "Gr": "^", "Gb": "v", "B": "s", "MONO": "o"}
FINE_Z = 5.0  # residuals are shown at least so far


def draw_photon_transfer(fit: "Fit", path: Path) -> tuple[Path, ...]:
    """Draw variance against level with the fitted segments; below, residuals in standard errors.

    Full marks were fitted, hollow ones left out; the grey band is the interval that holds a switch.
    `path` has no suffix: `.svg` and `.png` (200 dots per inch) are written and returned.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 5.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
        _variance(above, fit)
        _residuals(below, fit)
        title = f"Photon transfer: {fit.name}"
        above.set_title(title, loc="left")
        written = (path.with_name(path.name + ".svg"), path.with_name(path.name + ".png"))
        figure.savefig(written[0], metadata={"Date": None, "Creator": "dsis", "Title": title})
        figure.savefig(written[1], dpi=200, metadata={"Software": "dsis", "Title": title})
    return written


def _variance(axes: Axes, fit: "Fit") -> None:
    for name in fit.channels:
        for used in (True, False):
            rows = [r for r in _of(fit, name) if (not r.left_out) is used and r.noise_dn2 > 0]
            axes.plot(
                [r.x_dn for r in rows],
                [r.noise_dn2 for r in rows],
                CHANNEL_MARKS[name],
                color=CHANNEL_COLOURS[name],
                mfc=CHANNEL_COLOURS[name] if used else "none",
                ms=4 if used else 5,
                label=name
                if used
                else ("_left out" if name != next(iter(fit.channels)) else "left out"),
            )
    ends = [s.middle_dn for s in fit.segments.switches]
    top = max(r.x_dn for r in fit.levels if not r.left_out)
    dashes = cycle(("-", (0, (5, 2)), (0, (1, 1))))
    for low, high, line in zip([0.0, *ends], [*ends, top], fit.segments.lines, strict=True):
        x = np.linspace(low, high, 400)
        label = f"{line.slope_dn:.4g} x + {line.intercept_dn2:.4g}"
        axes.plot(x, line.variance_dn2(x), color=ALARM, lw=1.1, ls=next(dashes), label=label)
    for switch in fit.segments.switches:
        axes.axvspan(switch.low_dn, switch.high_dn, color="#e4e4e4", lw=0, zorder=-2)
    # Levels span decades; the dark stands on the straight part about 0.
    small = [r.x_dn for r in fit.levels if not r.left_out and r.statistics.kind == "flat"]
    axes.set_xscale("symlog", linthresh=max(min(small, key=abs), 1e-3))
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):  # plain numbers: the style draws no mathematics
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_ylim(bottom=0.5 * min(r.noise_dn2 for r in fit.levels if not r.left_out))
    axes.set_ylabel("variance of the temporal noise, DN\u00b2")
    axes.legend(loc="upper left")
    axes.grid(visible=True)
    axes.set_axisbelow(True)


def _residuals(axes: Axes, fit: "Fit") -> None:
    most = FINE_Z
    for name in fit.channels:
        rows = [r for r in _of(fit, name) if not r.left_out]
        z = [r.z for r in rows]
        most = max([most, *(abs(value) for value in z if np.isfinite(value))])
        x = [r.x_dn for r in rows]
        axes.plot(x, z, CHANNEL_MARKS[name], color=CHANNEL_COLOURS[name], ms=3.5)
    for limit in (-2.0, 0.0, 2.0):
        axes.axhline(limit, color=GREY, lw=0.8, ls="-" if limit == 0 else (0, (4, 3)), zorder=0)
    axes.set_ylim(-1.1 * most, 1.1 * most)
    axes.set_ylabel("residual, s.e.")
    axes.set_xlabel("level above black, DN")


def _of(fit: "Fit", channel: str) -> list["FittedLevel"]:
    return [r for r in fit.levels if r.statistics.channel == channel and r.statistics.frames > 1]


def draw_distribution(fit: "Fit", noise: "Distribution", path: Path) -> Path:
    """Draw the noise at one level as density, with the Gaussian of the fitted variance; PNG."""
    x = noise.centres_dn
    level = noise.level_dn - fit.black_dn
    sd = float(np.sqrt(max(float(fit.segments.variance_dn2(np.array([level]))[0]), 0.0) + 1 / 12))
    gauss = np.exp(-0.5 * (x / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.4, 3.8), layout="constrained")
        axes = figure.subplots()
        axes.bar(x, noise.density, np.diff(x)[0], color="#b9d4e8", label="recorded")
        axes.plot(x, gauss, color=ALARM, lw=1.3, label=f"Gaussian of the model, sd {sd:.3g} DN")
        axes.set_xlabel("noise, DN")
        axes.set_ylabel("density, 1/DN")
        axes.set_title(
            f"{noise.exposure} ({noise.channel}), level {level:.5g} DN\nsd {noise.sd_dn:.4g} DN, "
            f"skewness {noise.skewness:.3f}, kurtosis {noise.kurtosis:.3f}",
            loc="left",
            fontsize=8,
        )
        axes.set_ylim(top=1.3 * float(max(noise.density.max(), gauss.max())))
        axes.legend(loc="upper right")
        title = f"Distribution of the noise: {fit.name}"
        figure.savefig(path, dpi=200, metadata={"Software": "dsis", "Title": title})
    return path
