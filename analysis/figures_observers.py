"""Figures of the observers: bias and inconsistency, use of the scale, those a screen rejects."""

from math import ceil
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from analysis.figures import ALARM, COLOURS, GREY, INK, STYLE, save, scale_ticks, short_name
from analysis.scale import Scale
from analysis.screening import moments
from analysis.votes import Indexed, index_votes

NAMED = 60  # observers; more are drawn without names
SHOWN = 12  # observers that screens reject, one panel each
GRADES_SHOWN = 40


def draw_observers(
    people: pd.DataFrame,
    names: list[str],
    flagged: NDArray[np.bool_],
    simulated_share: float,
    path: Path,
) -> None:
    """Draw bias and inconsistency of each observer (P.910) with their 95 % intervals.

    Parameters
    ----------
    people
        `analysis.p910(votes).observers`.
    names
        How to call them, in that order.
    flagged
        (observer,): drawn in red, because a screen would reject them.
    simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    columns = (("bias", "bias, grades"), ("inconsistency", "inconsistency, grades"))
    x = np.arange(len(people))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(max(6.0, min(9.6, 1.5 + 0.22 * len(x))), 5.0))
        figure.set_layout_engine("constrained")
        for axes, (name, label) in zip(
            figure.subplots(2, 1, sharex=True).flat, columns, strict=True
        ):
            value = people[name].to_numpy(dtype=np.float64)
            low, high = (people[f"{name}_ci_{end}"].to_numpy() for end in ("low", "high"))
            for mine, colour in ((~flagged, COLOURS[0]), (flagged, ALARM)):
                bars = np.nan_to_num(np.stack([value - low, high - value])[:, mine])
                axes.errorbar(x[mine], value[mine], bars, fmt="o", color=colour, ms=4, lw=1.0)
            axes.set_ylabel(label)
            axes.grid(visible=True, axis="y")
            axes.set_axisbelow(True)
            axes.set_xlim(-0.7, len(x) - 0.3)
        figure.axes[0].axhline(0, color=INK, lw=0.7)
        figure.axes[1].axhline(float(people["inconsistency"].median()), color=GREY, lw=0.9, ls="--")
        figure.axes[1].set_ylim(bottom=0)
        _observer_axis(figure.axes[1], names)
        if flagged.any():
            title = "red: a screen proposes to reject"
            figure.axes[0].set_title(title, loc="right", color=ALARM, fontweight="normal")
        save(figure, "Observers", simulated_share, path)


def _observer_axis(axes: Axes, names: list[str]) -> None:
    if len(names) <= NAMED:
        axes.set_xticks(
            range(len(names)), [short_name(name) for name in names], rotation=90, fontsize=7.5
        )
    else:
        axes.set_xlabel(f"{len(names)} observers")
    axes.tick_params(axis="x", length=0)


def draw_scale_use(
    votes: pd.DataFrame, names: list[str], scale: Scale, simulated_share: float, path: Path
) -> None:
    """Draw how often each observer gave each grade, and all of them together.

    Parameters
    ----------
    votes
        Table of votes.
    names
        How to call the observers, in the order of `index_votes(votes).observers`.
    scale, simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    scored = index_votes(votes)
    columns = min(_grades(scored.vote, scale), GRADES_SHOWN)
    half = (scale.high - scale.low) / max(columns - 1, 1) / 2
    edges = np.linspace(scale.low - half, scale.high + half, columns + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    rows = np.arange(len(names) + 1) - 0.5
    counts = np.histogram2d(scored.observer, scored.vote, bins=[rows, edges])[0]
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    with mpl.rc_context(STYLE):
        height = 2.4 + (0.16 * len(names) if len(names) <= NAMED else 6.0)
        figure = Figure(figsize=(6.4, height), layout="constrained")
        ratio = [1.3, max(height - 1.9, 1.0)]
        top, axes = figure.subplots(2, 1, sharex=True, height_ratios=ratio)
        top.bar(middle, counts.sum(axis=0) / counts.sum(), width=1.6 * half, color=COLOURS[0])
        top.set_ylabel("share")
        top.set_title("all observers", loc="left")
        top.grid(visible=True, axis="y")
        top.set_axisbelow(True)
        mesh = axes.pcolormesh(edges, rows, shares, cmap="Blues", vmin=0, rasterized=True)
        axes.invert_yaxis()
        if len(names) <= NAMED:
            axes.set_yticks(range(len(names)), [short_name(name) for name in names], fontsize=7.5)
        else:
            axes.set_yticks([])
            axes.set_ylabel(f"{len(names)} observers")
        axes.tick_params(axis="y", length=0)
        ticks = scale_ticks(scale)
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.set_xlabel(f"vote, {scale}")
        figure.colorbar(mesh, ax=axes, label="share of the observer's votes")
        save(figure, "Use of the scale", simulated_share, path)


def _grades(vote: NDArray[np.float64], scale: Scale) -> int:
    """Return how many bins the scale needs: its grades, where votes are whole numbers."""
    whole = (vote == np.rint(vote)).all() and scale.low.is_integer() and scale.high.is_integer()
    return int(scale.high - scale.low) + 1 if whole else 20


def draw_flagged(
    votes: pd.DataFrame,
    names: list[str],
    flagged: NDArray[np.bool_],
    scale: Scale,
    simulated_share: float,
    path: Path,
) -> None:
    """Draw the votes of each observer whom a screen rejects against the MOS of the others.

    Parameters
    ----------
    votes
        Table of votes.
    names
        How to call the observers, in the order of `index_votes(votes).observers`.
    flagged
        (observer,): whom to draw; the first `SHOWN`.
    scale, simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    scored = index_votes(votes)
    chosen = np.flatnonzero(flagged)[:SHOWN]
    columns = min(4, len(chosen))
    rows = ceil(len(chosen) / columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(0.8 + 2.2 * columns, 0.7 + 2.2 * rows), layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        for axes, who in zip(grid.flat, chosen, strict=False):
            others, mine = _against_others(scored, int(who))
            axes.plot([scale.low, scale.high], [scale.low, scale.high], color=GREY, lw=0.8)
            axes.plot(others, mine, "o", color=ALARM, ms=3.5, alpha=0.6, mew=0)
            axes.set_title(short_name(names[who]), loc="left")
            axes.set_aspect("equal")
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(MaxNLocator(5, integer=True))
            margin = 0.06 * (scale.high - scale.low)
            axes.set_xlim(scale.low - margin, scale.high + margin)
            axes.set_ylim(scale.low - margin, scale.high + margin)
            axes.grid(visible=True)
            axes.set_axisbelow(True)
        for axes in list(grid.flat)[len(chosen) :]:
            axes.remove()
        figure.supxlabel("MOS of the others", fontsize=9)
        figure.supylabel("vote", fontsize=9)
        save(figure, "Observers that screens reject", simulated_share, path)


def _against_others(scored: Indexed, who: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the MOS of the others, and the votes of `who`, where both exist."""
    others = scored.observer != who
    group = scored.stimulus[others]
    judged, at = np.unique(group, return_inverse=True)
    mean = np.full(len(scored.stimuli), np.nan)
    if len(judged):
        mean[judged] = moments(at.reshape(-1).astype(np.intp), scored.vote[others], 1).mean
    expected = mean[scored.stimulus[~others]]
    known = ~np.isnan(expected)
    return expected[known], scored.vote[~others][known]
