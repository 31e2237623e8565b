"""How well equation (5) predicts: correlations by region, and against the strength of noise."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures import COLOURS, DEMOSAICKERS, GREY, INK, MARKS
from analysis.paper.figures.style import draw

if TYPE_CHECKING:
    from analysis.paper.equation5 import Compared

LOOK = {m: (COLOURS[i], MARKS[i]) for i, m in enumerate(("bilinear", "dlmmse", "lu_tan"))}


def draw_regions(found: "Sequence[Compared]", path: Path) -> None:
    """Draw predicted against measured correlations, a panel per region."""
    names = list(dict.fromkeys(c.region for c in found))

    def fill(figure: Figure) -> None:
        panels = figure.subplots(1, len(names), sharex=True, sharey=True)
        for axes, name in zip(panels, names, strict=True):
            axes.axline((0, 0), slope=1, color=GREY, lw=0.8, zorder=0)
            for c in (c for c in found if c.region == name):
                colour, mark = LOOK[c.method]
                for point, values in c.predicted.items():
                    axes.plot(
                        c.measured.ravel(),
                        values.ravel(),
                        mark,
                        ms=3.2,
                        mec=colour,
                        mew=0.6,
                        mfc="none" if point == "noisy" else colour,
                        alpha=0.8,
                    )
            axes.set_title(name, loc="left")
            axes.set_xlabel("measured correlation")
            axes.set_aspect("equal")
            axes.grid(visible=True)
        panels[0].set_ylabel("predicted correlation")
        figure.legend(handles=_methods(), loc="outside lower center", ncols=5)

    draw(path, "Equation (5) by region", (10.4, 3.5), fill)


def draw_levels(levels: "Mapping[float, Sequence[Compared]]", path: Path) -> None:
    """Draw the largest deviation against stops of under-exposure."""

    def fill(figure: Figure) -> None:
        axes = figure.subplots()
        for method, (colour, mark) in LOOK.items():
            rows = [(s, c) for s, found in levels.items() for c in found if c.method == method]
            for point in rows[0][1].predicted:
                y = [c.worst(point) for _, c in rows]
                dashes = (0, (4, 2)) if point == "noisy" else "-"
                full = "none" if point == "noisy" else colour
                axes.plot([s for s, _ in rows], y, mark, color=colour, ls=dashes, ms=4.5, mfc=full)
        errors = [(s, max(float(c.error.max()) for c in found)) for s, found in levels.items()]
        axes.plot(*zip(*errors, strict=True), color=GREY, ls=(0, (1, 1.5)), lw=1.2)
        axes.set_yscale("log")
        axes.set_yticks([0.003, 0.01, 0.03, 0.1], ["0.003", "0.01", "0.03", "0.1"])
        axes.minorticks_off()
        axes.set_xlabel("stops of under-exposure; 0: the paper's noise")
        axes.set_ylabel("largest deviation of a correlation")
        axes.grid(visible=True)
        sampling = Line2D([], [], color=GREY, ls=(0, (1, 1.5)), label="standard error of measuring")
        figure.legend(handles=[*_methods(), sampling], loc="outside right upper")

    draw(path, "Equation (5) against the strength of noise", (7.0, 3.4), fill)


def _methods() -> list[Line2D]:
    marks = [
        Line2D([], [], color=colour, marker=mark, ls="", ms=4.5, label=DEMOSAICKERS[method])
        for method, (colour, mark) in LOOK.items()
    ]
    full = Line2D([], [], color=INK, marker="o", ls="-", ms=4, label="at the clean mosaic, exact")
    hollow = Line2D(
        [], [], color=INK, marker="o", ls=(0, (4, 2)), ms=4, mfc="none", label="at noisy mosaics"
    )
    return [*marks, full, hollow]
