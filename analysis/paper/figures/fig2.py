"""Fig. 2: variance against signal, and the distribution of the noise."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS
from analysis.paper.figures.style import draw

if TYPE_CHECKING:
    from analysis.paper.fig2 import Transfer


def draw_transfer(found: "Transfer", path: Path) -> None:
    """Draw the photon transfer curve, its beginning enlarged, and the noise at one level."""

    def fill(figure: Figure) -> None:
        whole, start, noise = figure.subplots(1, 3)
        switches = [s.middle_dn for s in found.fit.switches]
        near = 4 * switches[0] if switches else float(found.x_dn.max()) / 10
        _curve(whole, found, float(found.x_dn.max()))
        _curve(start, found, near)
        whole.set_title("(a) variance against signal", loc="left")
        start.set_title("its beginning", loc="left")
        whole.set_ylabel("variance, DN²")
        _distribution(noise, found)

    draw(path, f"Photon transfer: {found.title}", (10.4, 3.5), fill)


def _curve(axes: Axes, found: "Transfer", top: float) -> None:
    here = found.x_dn <= top
    axes.plot(found.x_dn[here], found.variance_dn2[here], "o", color=COLOURS[0], ms=3.2)
    ends = [0.0, *(s.middle_dn for s in found.fit.switches), top]
    for line, low, high in zip(found.fit.lines, ends[:-1], ends[1:], strict=True):
        x = np.linspace(low, high, 50)
        label = f"{line.slope_dn:.3g} x + {line.intercept_dn2:.3g}"
        axes.plot(x, line.variance_dn2(x), color=ALARM, lw=1.1, label=label)
    axes.set_xlim(0, 1.03 * top)
    axes.set_ylim(bottom=0)
    axes.ticklabel_format(axis="both", style="plain")
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("signal, DN above black")
    axes.grid(visible=True)
    axes.legend(loc="upper left")


def _distribution(axes: Axes, found: "Transfer") -> None:
    if found.centres_dn.size == 0:
        axes.remove()
        return
    width = float(np.diff(found.centres_dn)[0])
    axes.bar(found.centres_dn, found.density, width, color="#b9d4e8", label="measured")
    x = found.centres_dn
    level = np.array([found.level_dn])
    sd = float(np.sqrt(found.fit.variance_dn2(level)[0] + 1 / 12))
    gauss = np.exp(-0.5 * (x / sd) ** 2) / (sd * np.sqrt(2 * np.pi))
    axes.plot(x, gauss, color=ALARM, lw=1.2, label=f"Gaussian, sd {sd:.3g} DN")
    axes.set_ylim(top=1.35 * float(gauss.max()))
    axes.set_title(f"(b) noise at {found.level_dn:.0f} DN", loc="left")
    axes.set_xlabel("noise, DN")
    axes.set_ylabel("density, 1/DN")
    axes.legend(loc="upper right")
