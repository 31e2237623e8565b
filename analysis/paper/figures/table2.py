"""Table 2 as a picture: noisy, plainly denoised, denoised knowing the noise."""

from collections.abc import Callable, Mapping
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.figures import COLOURS, DEMOSAICKERS, GREY, INK, MARKS
from analysis.paper.figures.style import draw

if TYPE_CHECKING:
    from analysis.paper.denoised import Score
    from analysis.paper.frames import Key

KINDS = {("awgn", 3): "AWGN / 3", ("sd", 3): "SD / 3", ("sd", 2): "SD / 2"}
REFERENCES: dict[str, Callable[["Score"], float]] = {
    "the full-colour reference": attrgetter("mean_db"),
    "the demosaicked clean frame": attrgetter("mean_still_db"),
}
METHODS = ("none", "bilinear", "dlmmse", "lu_tan")
LOOK = {"bls_gsm": ("BLS-GSM", COLOURS[0], MARKS[0]), "bm3d": ("BM3D", COLOURS[1], MARKS[1])}


def draw_gains(found: "Mapping[Key, Score]", path: Path) -> None:
    """Draw a panel for each noise and stage, a place for each demosaicking method."""

    def fill(figure: Figure) -> None:
        grid = figure.subplots(2, len(KINDS), sharex=True, sharey="row")
        for panels, (words, mean_db) in zip(grid, REFERENCES.items(), strict=True):
            panels[0].set_ylabel(f"PSNR, dB, against\n{words}")
            for axes, kind in zip(panels, KINDS, strict=True):
                _panel(axes, found, kind, mean_db)
        for axes, title in zip(grid[0], KINDS.values(), strict=True):
            axes.set_title(title, loc="left")
        handles = [
            Line2D([], [], color=colour, marker=mark, ls="", label=name)
            for name, colour, mark in LOOK.values()
        ]
        noisy = Line2D([], [], color=GREY, marker="_", ms=11, ls="", mew=2, label="noisy")
        hollow = Line2D([], [], color=INK, marker="o", mfc="white", ls="", label="plain")
        full = Line2D([], [], color=INK, marker="o", ls="", label="adapted")
        figure.legend(handles=[*handles, noisy, hollow, full], loc="outside lower center", ncols=5)

    draw(path, "Denoised City", (10.4, 6.2), fill)


def _panel(
    axes: Axes,
    found: "Mapping[Key, Score]",
    kind: tuple[str, int],
    mean_db: "Callable[[Score], float]",
) -> None:
    for at, method in enumerate(METHODS):
        noisy = mean_db(found[*kind, method, "noisy", False])
        axes.plot([at], [noisy], "_", color=GREY, ms=22, mew=2)
        for aside, (name, (_, colour, mark)) in zip((-0.13, 0.13), LOOK.items(), strict=True):
            y = [mean_db(found[*kind, method, name, adapted]) for adapted in (False, True)]
            axes.plot([at + aside] * 2, y, color=colour, lw=1.2)
            axes.plot([at + aside], y[:1], mark, mfc="white", mec=colour, ms=6)
            axes.plot([at + aside], y[1:], mark, color=colour, ms=6)
    names = ["RGB", *(DEMOSAICKERS[method] for method in METHODS[1:])]
    axes.set_xticks(range(len(METHODS)), names)
    axes.grid(visible=True, axis="y")
    axes.set_axisbelow(True)
