"""What figures share: style, colours, marks, names, how they are saved.

A figure carries no date, and its inner names do not depend on chance: same numbers, same bytes.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analysis.scale import Scale

# Okabe and Ito's colours, told apart by the colour-blind too; the marks tell them apart in grey.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKS = ("o", "s", "^", "D", "v", "P")
MAX_COLOURS = len(COLOURS)
INK, GREY, ALARM = "#222222", "#777777", "#b00020"

NOISES = {"awgn": "AWGN", "sd": "signal-dependent"}
DEMOSAICKERS = {"none": "none", "bilinear": "bilinear", "dlmmse": "DLMMSE", "lu_tan": "Lu-Tan"}

ROWS_PER_COLUMN = 60  # of lists of names
ROWS_NAMED = 3 * ROWS_PER_COLUMN
NAME_LENGTH = 44

STYLE: dict[Any, Any] = {
    "svg.hashsalt": "dsis",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters everywhere
    "font.size": 9.0,
    "text.color": INK,
    "text.parse_math": False,  # a "$" in a name is a dollar sign
    "axes.edgecolor": "#888888",
    "axes.facecolor": "none",  # the mark of simulated votes lies behind
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "xtick.color": INK,
    "ytick.color": INK,
}


def save(figure: Figure, title: str, simulated_share: float, path: Path) -> None:
    """Write a figure as `.svg` and `.png` (200 dots per inch), marked where votes are simulated.

    To be called, as everything that draws, inside `matplotlib.rc_context(STYLE)`.
    """
    _mark_simulated(figure, simulated_share)
    title = " ".join([title, simulated_mark(simulated_share)]).strip()
    svg = {"Date": None, "Creator": "dsis", "Title": title}
    figure.savefig(path.with_suffix(".svg"), metadata=svg)
    figure.set_layout_engine("none")  # it is laid out; once is enough
    png = {"Software": "dsis", "Title": title}
    figure.savefig(path.with_suffix(".png"), dpi=200, metadata=png)


def condition_name(word: str) -> str:
    """Return noise, demosaicking, or a difference `a - b` of two, as people call them."""
    parts = [(NOISES | DEMOSAICKERS).get(part, part) for part in word.split(" - ")]
    return " \u2212 ".join(parts)


def simulated_mark(share: float) -> str:
    """Return the words that stand with every table and figure; empty where no vote is simulated."""
    if share <= 0:
        return ""
    # A single vote of a person among them: not yet 100 %.
    return "SIMULATED VOTES" if share >= 1 else f"{min(100 * share, 99):.2g} % SIMULATED VOTES"


def _mark_simulated(figure: Figure, share: float) -> None:
    mark = simulated_mark(share)
    if not mark:
        return
    figure.suptitle(mark, color=ALARM, fontweight="bold", fontsize=11)
    width, height = figure.get_size_inches()
    size = min(40.0, 72 * width / (0.9 * len(mark)))
    times = max(1, round(height / 4))
    for at in range(times):
        text = figure.text(0.5, (at + 0.5) / times, mark, ha="center", va="center", rotation=20)
        text.set(color=ALARM, alpha=0.10, fontsize=size, fontweight="bold", zorder=-1)
        text.set_in_layout(False)


def scale_ticks(scale: Scale) -> list[float]:
    """Return the grades to mark on an axis: all of up to thirteen, else five."""
    ends = (float(scale.low), float(scale.high))
    whole = all(end.is_integer() for end in ends) and ends[1] - ends[0] <= 12
    count = int(scale.high - scale.low) + 1 if whole else 5
    return [float(tick) for tick in np.linspace(scale.low, scale.high, count)]


def short_name(name: str) -> str:
    """Return a name that fits an axis, its middle left out."""
    if len(name) <= NAME_LENGTH:
        return name
    half = NAME_LENGTH // 2
    return f"{name[: half - 1]}\u2026{name[-half:]}"
