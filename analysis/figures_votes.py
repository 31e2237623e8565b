"""Figures of the votes: on each stimulus, over the order of presentations, in contrasts."""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from analysis.figures import (
    ALARM,
    COLOURS,
    GREY,
    INK,
    ROWS_NAMED,
    ROWS_PER_COLUMN,
    STYLE,
    condition_name,
    save,
    scale_ticks,
    short_name,
)
from analysis.inference.design import ALL, CONTENT, OVERALL
from analysis.scale import Scale
from analysis.screening import moments
from analysis.votes import Indexed, index_votes

LARGEST_DOT = 120.0  # points^2: all votes of a stimulus on one grade
GRADES_AS_DOTS = 40  # more distinct grades are drawn as they stand


def draw_votes(
    votes: pd.DataFrame, removed: pd.DataFrame, scale: Scale, simulated_share: float, path: Path
) -> None:
    """Draw the votes on each stimulus: a dot per grade, its area the share of votes.

    A red ring: votes that the 2-sigma rule removes; a bar: the MOS. Stimuli in the order of the
    score table; more than `ROWS_NAMED` are drawn without names, by MOS.

    Parameters
    ----------
    votes, removed
        Table of votes; `analysis.remove_outliers(votes).removed`.
    scale, simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    scored = index_votes(votes)
    mean = moments(scored.stimulus, scored.vote, 1).mean
    names = scored.stimuli["stimulus"]
    named = len(names) <= ROWS_NAMED
    order = np.arange(len(names)) if named else np.lexsort((names, mean))
    rank = np.empty(len(order), dtype=np.intp)
    rank[order] = np.arange(len(order))
    columns = -(-len(names) // ROWS_PER_COLUMN) if named else 1
    rows = -(-len(names) // columns)
    height = 1.1 + 0.19 * rows if named else 9.0
    width = 6.2 * columns if columns > 1 else 7.5
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        panels = np.ravel(figure.subplots(1, columns, squeeze=False))
        if named:
            dots = _dots(scored, rank, removed)
            for at, axes in enumerate(panels):
                mine = slice(at * rows, (at + 1) * rows)
                _vote_panel(axes, dots, mine, mean[order][mine], scale)
                labels = [short_name(name) for name in names.iloc[order[mine]]]
                axes.set_yticks(np.arange(len(labels)), labels, fontsize=7)
        else:
            _vote_image(panels[0], scored, rank, mean[order], scale)
        _vote_legend(figure, named=named)
        save(figure, "Votes on each sequence", simulated_share, path)


def _dots(scored: Indexed, rank: NDArray[np.intp], removed: pd.DataFrame) -> pd.DataFrame:
    """Return a row per stimulus and grade: place, grade, share of votes, votes removed."""
    table = pd.DataFrame({"place": rank[scored.stimulus], "grade": scored.vote, "votes": 1})
    dots = table.groupby(["place", "grade"], as_index=False).sum()
    dots["share"] = dots["votes"] / dots.groupby("place")["votes"].transform("sum")
    place = dict(zip(scored.stimuli["stimulus"], rank, strict=True))
    gone = {(place[s], v) for s, v in zip(removed["stimulus"], removed["vote"], strict=True)}
    dots["removed"] = [key in gone for key in zip(dots["place"], dots["grade"], strict=True)]
    return dots


def _vote_panel(
    axes: Axes, dots: pd.DataFrame, mine: slice, mean: NDArray[np.float64], scale: Scale
) -> None:
    here = dots[(dots["place"] >= mine.start) & (dots["place"] < mine.stop)]
    y = here["place"] - mine.start
    edge = [ALARM if gone else COLOURS[0] for gone in here["removed"]]
    axes.scatter(
        here["grade"],
        y,
        s=LARGEST_DOT * here["share"],
        c=COLOURS[0],
        alpha=0.75,
        edgecolors=edge,
        linewidths=[1.5 if gone else 0.0 for gone in here["removed"]],
    )
    axes.plot(mean, np.arange(len(mean)), "|", color=INK, ms=8, mew=1.4)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(mine.stop - mine.start - 0.4, -0.6)
    _grade_axis(axes, scale)
    axes.grid(visible=True)


def _vote_image(
    axes: Axes,
    scored: Indexed,
    rank: NDArray[np.intp],
    mean: NDArray[np.float64],
    scale: Scale,
) -> None:
    """Share of votes as shades, stimuli by MOS."""
    columns = min(len(np.unique(scored.vote)), GRADES_AS_DOTS)
    half = (scale.high - scale.low) / max(columns - 1, 1) / 2
    edges = np.linspace(scale.low - half, scale.high + half, columns + 1)
    rows = np.arange(len(mean) + 1) - 0.5
    shares = np.histogram2d(rank[scored.stimulus], scored.vote, bins=[rows, edges])[0]
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1)
    mesh = axes.pcolormesh(edges, rows, shares, cmap="Blues", vmin=0, rasterized=True)
    axes.plot(mean, np.arange(len(mean)), color=INK, lw=1.2)
    axes.invert_yaxis()
    axes.set_yticks([])
    axes.set_ylabel(f"{len(mean)} stimuli, by MOS")
    _grade_axis(axes, scale, half)
    figure = axes.get_figure()
    if figure is not None:
        figure.colorbar(mesh, ax=axes, label="share of votes", shrink=0.5)


def _grade_axis(axes: Axes, scale: Scale, beyond: float | None = None) -> None:
    beyond = 0.05 * (scale.high - scale.low) if beyond is None else beyond
    axes.set_xlim(scale.low - beyond, scale.high + beyond)
    ticks = scale_ticks(scale)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xlabel(f"vote, {scale}")
    axes.set_axisbelow(True)


def _vote_legend(figure: Figure, *, named: bool) -> None:
    bar = Line2D([], [], color=INK, marker="|", ls="", ms=8, mew=1.4, label="MOS")
    line = Line2D([], [], color=INK, lw=1.2, label="MOS")
    if not named:
        figure.legend(handles=[line], loc="outside lower center")
        return
    half = Line2D([], [], color=COLOURS[0], marker="o", ls="", ms=7.7, label="half of the votes")
    ring = Line2D([], [], color=COLOURS[0], marker="o", ls="", ms=5, label="removed")
    ring.set(markeredgecolor=ALARM, markeredgewidth=1.5)
    figure.legend(handles=[half, ring, bar], loc="outside lower center", ncols=3)


def draw_order(
    place: NDArray[np.float64],
    residual: NDArray[np.float64],
    effects: pd.DataFrame,
    simulated_share: float,
    path: Path,
) -> None:
    """Draw what the order of presentations does: residuals against the place, and their means.

    Parameters
    ----------
    place, residual
        (vote,): place in the observer's order; vote less the stimulus' mean and the observer's.
    effects
        `analysis.order_effects`.
    simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    known = ~np.isnan(place)
    place, residual = place[known], residual[known]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 3.4), layout="constrained")
        axes = figure.subplots()
        axes.plot(place, residual, ".", color=GREY, ms=3, alpha=0.35, mew=0, rasterized=True)
        bins = np.unique(np.quantile(place, np.linspace(0, 1, 11)))
        group = np.clip(np.searchsorted(bins, place, side="right") - 1, 0, max(len(bins) - 2, 0))
        used, at = np.unique(group, return_inverse=True)
        n, mean, sd = moments(at.reshape(-1).astype(np.intp), residual, 1)
        x = np.bincount(at, place, len(used)) / n
        axes.errorbar(
            x, mean, 1.96 * sd / np.sqrt(n), color=COLOURS[0], fmt="o-", ms=5, lw=1.4, capsize=2.5
        )
        axes.axhline(0, color=INK, lw=0.7)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("place in the observer's order")
        axes.set_ylabel("vote above that of the others")
        axes.set_title(_order_title(effects), loc="left", fontweight="normal")
        axes.grid(visible=True, axis="y")
        axes.set_axisbelow(True)
        save(figure, "Order of presentations", simulated_share, path)


def _order_title(effects: pd.DataFrame) -> str:
    parts = [
        f"{row.effect} {row.slope:+.3f} [{row.ci_low:+.3f}, {row.ci_high:+.3f}]"
        for row in effects.itertuples()
    ]
    return "   ".join(parts).replace("-", "\u2212")


def draw_contrasts(contrasts: pd.DataFrame, simulated_share: float, path: Path) -> None:
    """Draw the differences of MOS with their 95 % intervals, pairs and averages (forest plot).

    Parameters
    ----------
    contrasts
        `analysis.test_contrasts`; red: significant after Holm (paired t).
    simulated_share, path
        As for `analysis.figures_mos.draw_mos`.
    """
    table = contrasts.sort_values(["question", "treatment"], kind="stable").reset_index(drop=True)
    y = np.arange(len(table), dtype=np.float64)
    y += pd.factorize(table["question"] + table["treatment"])[0] * 0.8
    low = (table["difference"] - table["ci_low"]).fillna(0.0)
    high = (table["ci_high"] - table["difference"]).fillna(0.0)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 1.2 + 0.24 * (y.max() + 1)), layout="constrained")
        axes = figure.subplots()
        for at, row in enumerate(table.to_dict("records")):
            colour = COLOURS[1] if row["p_t_holm"] < 0.05 else GREY
            wide = row["grain"] in (CONTENT, OVERALL)
            axes.errorbar(
                row["difference"],
                y[at],
                xerr=[[low[at]], [high[at]]],
                fmt="D" if wide else "o",
                color=colour,
                ms=6 if wide else 4.5,
                lw=1.8 if wide else 1.1,
                capsize=2.2,
            )
        axes.axvline(0, color=INK, lw=0.8)
        axes.set_yticks(y, [_contrast_name(row) for row in table.to_dict("records")], fontsize=8)
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(y.max() + 0.7, -0.7)
        axes.set_xlabel("difference of MOS, grades")
        axes.grid(visible=True, axis="x")
        axes.set_axisbelow(True)
        _contrast_legend(figure)
        save(figure, "Contrasts", simulated_share, path)


def _contrast_name(row: dict[Hashable, Any]) -> str:
    stops = str(row["level"])
    where = "all contents" if row["content"] == ALL else str(row["content"])
    held = "" if row["within"] in (ALL, "") else f", {condition_name(str(row['within']))}"
    level = f", {stops} stops" if stops not in (ALL, "", "0") else ""
    return f"{condition_name(str(row['treatment']))}: {short_name(where)}{held}{level}"


def _contrast_legend(figure: Figure) -> None:
    handles = [
        Line2D([], [], color=COLOURS[1], marker="o", ls="", label="significant after Holm"),
        Line2D([], [], color=GREY, marker="o", ls="", label="not significant"),
        Line2D([], [], color=INK, marker="D", ls="", label="averaged over pairs"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
