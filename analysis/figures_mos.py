"""The figure of mean opinion scores: by condition, or a list where stimuli have none."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from analysis.figures import (
    COLOURS,
    DEMOSAICKERS,
    GREY,
    INK,
    MARKS,
    MAX_COLOURS,
    NOISES,
    ROWS_NAMED,
    ROWS_PER_COLUMN,
    STYLE,
    save,
    scale_ticks,
    short_name,
)
from analysis.scale import Scale

DASHES = {"awgn": (0, (5, 2.5)), "sd": "-"}
MORE_DASHES = ((0, (1, 1.5)), (0, (6, 2, 1, 2)), (0, (3, 1, 1, 1, 1, 1)))
PAGE_WIDTH = 9.6  # inches


def draw_mos(scores: pd.DataFrame, scale: Scale, simulated_share: float, path: Path) -> None:
    """Draw MOS with 95 % intervals, in the manner of Fig. 6 of Seybold et al. (2014).

    Left without, right with demosaicking (one place per method); AWGN dashed, signal-dependent
    noise solid; a colour per content, or a panel per content where there are more than
    `MAX_COLOURS`. Full marks and bars: all votes, Student t; hollow marks beside them: after the
    2-sigma removal. Stimuli that do not differ so are listed, one line each.

    Parameters
    ----------
    scores
        `analysis.score_table`.
    scale
        Of the test.
    simulated_share
        Share of simulated votes, 0..1; above 0 the figure says so, in its title and across it.
    path
        Without suffix: `.svg` and `.png` (200 dots per inch) are written.
    """
    with mpl.rc_context(STYLE):
        draw = _draw_conditions if has_conditions(scores) else _draw_list
        save(draw(scores, scale), "Mean opinion scores", simulated_share, path)


def has_conditions(scores: pd.DataFrame) -> bool:
    """Return whether the test stimuli have noise and demosaicking, each combination once."""
    tests = scores[scores["kind"] == "test"]
    named = (tests["noise"] != "").all() and (tests["demosaic"] != "").all()
    cells = tests[["content", "noise", "demosaic", "level"]].fillna({"level": 0.0})
    return bool(named and len(tests) > 0 and not cells.duplicated().any())


@dataclass(frozen=True)
class _Layout:
    """What the panels, the colours, the lines and the places along x stand for."""

    panels: str
    panel_values: list[Any]
    colours: str
    colour_values: list[Any]
    noises: list[str]
    places: list[str]

    def series(self) -> list[tuple[Any, str]]:
        """Return (colour value, noise) of each series of a panel."""
        return [(value, noise) for value in self.colour_values for noise in self.noises]

    def step(self) -> float:
        """Return the distance, along x, of series that share a place."""
        return min(0.10, 0.8 / len(self.series()))

    def panel_width(self) -> float:
        """Return how wide a panel must be, in inches, for its words and marks not to touch."""
        return len(self.places) * max(0.95, 0.13 * len(self.series()))


def _layout(tests: pd.DataFrame, *, references: bool) -> _Layout:
    values = {
        "content": list(dict.fromkeys(tests["content"])),
        "level": sorted(set(tests["level"])),
    }
    by_content = len(values["content"]) > MAX_COLOURS
    panels, colours = ("content", "level") if by_content else ("level", "content")
    places = _in_order(tests["demosaic"], DEMOSAICKERS)
    return _Layout(
        panels,
        values[panels],
        colours,
        values[colours],
        _in_order(tests["noise"], NOISES),
        ["reference", *places] if references else places,
    )


def _in_order(names: Iterable[str], known: Iterable[str]) -> list[str]:
    """Return the distinct names, the known ones first and in their order."""
    found = set(names)
    return [name for name in known if name in found] + sorted(found - set(known))


def _draw_conditions(scores: pd.DataFrame, scale: Scale) -> Figure:
    scores = scores.assign(level=scores["level"].fillna(0.0))
    tests = scores[scores["kind"] == "test"]
    references = scores[scores["kind"] == "reference"]
    layout = _layout(tests, references=len(references) > 0)
    number = len(layout.panel_values)
    most = 4 if layout.panels == "content" else 3
    columns = max(1, min(most, number, int(PAGE_WIDTH / layout.panel_width())))
    rows = ceil(number / columns)
    width, height = {1: (5.0, 3.9), 2: (3.4, 3.3), 3: (2.8, 3.0), 4: (2.3, 2.2)}[columns]
    width = max(width, layout.panel_width())
    size = (1.0 + width * columns + (1.6 if number == 1 else 0), 0.9 + height * rows)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, value in zip(grid.flat, layout.panel_values, strict=False):
        beside = (
            references if layout.panels == "level" else references[references["content"] == value]
        )
        _draw_panel(axes, layout, tests[tests[layout.panels] == value], beside)
        if number > 1:
            axes.set_title(_value_name(layout.panels, value), loc="left")
    for axes in list(grid.flat)[number:]:
        axes.remove()
    for axes in grid[:, 0]:
        _scale_axis(axes, scale)
    _legend(figure, layout, aside=number == 1)
    return figure


def _value_name(column: str, value: Any) -> str:
    return _exposure(value) if column == "level" else str(value)


def _exposure(level: float) -> str:
    if level == 0:
        return "full exposure"
    return f"{level:g} stop{'' if level == 1 else 's'} under-exposed"


def _draw_panel(axes: Axes, layout: _Layout, tests: pd.DataFrame, references: pd.DataFrame) -> None:
    series = layout.series()
    for at, (value, noise) in enumerate(series):
        rows = tests[(tests[layout.colours] == value) & (tests["noise"] == noise)]
        rows = rows.sort_values("demosaic", key=lambda d: d.map(layout.places.index))
        x = np.array([layout.places.index(place) for place in rows["demosaic"]], dtype=float)
        x += (at - (len(series) - 1) / 2) * layout.step()
        colour, mark = _colour(layout, value)
        axes.plot(x, rows["mos"], color=colour, ls=_dashes(noise, layout), lw=1.4)
        _marks(axes, x, rows, (colour, mark), layout.step())
    for at, row in enumerate(references.itertuples()):
        one = references.iloc[at : at + 1]
        known = layout.colours == "content" and row.content in layout.colour_values
        colour, mark = _colour(layout, row.content) if known else (GREY, "o")
        x = np.array([(at - (len(references) - 1) / 2) * layout.step()])
        _marks(axes, x, one, (colour, mark), layout.step())
    axes.set_xticks(range(len(layout.places)), [_place(p, layout) for p in layout.places])
    axes.tick_params(axis="x", length=0, labelbottom=True, labelsize=8.5)
    axes.set_xlim(-0.5, len(layout.places) - 0.5)
    axes.grid(visible=True, axis="y")
    axes.set_axisbelow(True)


def _marks(
    axes: Axes, x: NDArray[np.float64], rows: pd.DataFrame, look: tuple[str, str], step: float
) -> None:
    """Full marks with intervals (all votes); hollow marks beside them (after the removal)."""
    colour, mark = look
    bars = np.nan_to_num(np.stack([rows["mos"] - rows["ci_low"], rows["ci_high"] - rows["mos"]]))
    axes.errorbar(x, rows["mos"], bars, color=colour, fmt=mark, ms=5, lw=1.1, capsize=2.2, zorder=3)
    axes.plot(
        x + 0.42 * step,
        rows["mos_trimmed"],
        mark,
        ms=3.8,
        mfc="white",
        mec=colour,
        mew=0.9,
        zorder=4,
    )


def _colour(layout: _Layout, value: Any) -> tuple[str, str]:
    at = layout.colour_values.index(value)
    return COLOURS[at % MAX_COLOURS], MARKS[at % MAX_COLOURS]


def _dashes(noise: str, layout: _Layout) -> Any:
    others = [name for name in layout.noises if name not in DASHES]
    if noise in others:
        return MORE_DASHES[others.index(noise) % len(MORE_DASHES)]
    return DASHES[noise]


def _place(place: str, layout: _Layout) -> str:
    if place == "reference":
        return "hidden\nreference"
    if place == "none":
        return "without\ndemosaicking"
    name = DEMOSAICKERS.get(place, place)
    alone = len(set(layout.places) - {"none", "reference"}) == 1
    return f"with\ndemosaicking\n({name})" if alone else name


def _scale_axis(axes: Axes, scale: Scale) -> None:
    """Y axis over the whole scale, with the words at its ends."""
    margin = 0.06 * (scale.high - scale.low)
    axes.set_ylim(scale.low - margin, scale.high + margin)
    ticks = scale_ticks(scale)
    axes.set_yticks(ticks, [_tick_label(tick, scale) for tick in ticks])
    axes.set_ylabel("MOS")


def _tick_label(tick: float, scale: Scale) -> str:
    words = {scale.low: scale.low_label, scale.high: scale.high_label}.get(tick, "")
    return f"{words}  {tick:g}" if words else f"{tick:g}"


def _legend(figure: Figure, layout: _Layout, *, aside: bool) -> None:
    handles = []
    if len(layout.colour_values) > 1:
        for value in layout.colour_values:
            colour, mark = _colour(layout, value)
            label = _value_name(layout.colours, value)
            label = f" {label}" if label.startswith("_") else label  # else left out of legends
            handles.append(Line2D([], [], color=colour, marker=mark, ls="", label=label))
    handles += [
        Line2D([], [], color=INK, ls=_dashes(noise, layout), lw=1.4, label=NOISES.get(noise, noise))
        for noise in layout.noises
    ]
    handles += _twins()
    if aside:
        figure.legend(handles=handles, loc="outside right upper")
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5))


def _twins() -> list[Line2D]:
    return [
        Line2D([], [], color=GREY, marker="o", lw=1.1, ms=5, label="all votes, 95 % CI"),
        Line2D(
            [],
            [],
            color=GREY,
            marker="o",
            ls="",
            ms=3.8,
            mfc="white",
            label="after 2\u03c3 removal",
        ),
    ]


def _draw_list(scores: pd.DataFrame, scale: Scale) -> Figure:
    """One line a stimulus, in the order of the score table; beyond `ROWS_NAMED`, by MOS."""
    named = len(scores) <= ROWS_NAMED
    if not named:
        scores = scores.sort_values(["mos", "stimulus"])
    columns = ceil(len(scores) / ROWS_PER_COLUMN) if named else 1
    rows = ceil(len(scores) / columns)
    height = 1.2 + 0.165 * rows if named else 9.0
    figure = Figure(figsize=(1.0 + 6.0 * columns if columns > 1 else 7.5, height))
    figure.set_layout_engine("constrained")
    for at, axes in enumerate(np.ravel(figure.subplots(1, columns, squeeze=False))):
        _draw_column(axes, scores.iloc[at * rows : (at + 1) * rows], rows, scale, named=named)
    handles = _twins()
    if (scores["kind"] == "reference").any():
        handles.append(
            Line2D([], [], color=COLOURS[1], marker="D", ls="", ms=5, label="hidden reference")
        )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure


def _draw_column(axes: Axes, scores: pd.DataFrame, rows: int, scale: Scale, *, named: bool) -> None:
    y = np.arange(len(scores))
    contents = pd.factorize(scores["content"])[0]
    for place in y[contents % 2 == 1] if named else []:
        axes.axhspan(place - 0.5, place + 0.5, color="#f1f4f7", lw=0, zorder=-2)
    for kind, colour, mark in (("test", COLOURS[0], "o"), ("reference", COLOURS[1], "D")):
        here = (scores["kind"] == kind).to_numpy()
        some = scores[here]
        bars = np.nan_to_num(
            np.stack([some["mos"] - some["ci_low"], some["ci_high"] - some["mos"]])
        )
        axes.errorbar(some["mos"], y[here], xerr=bars, fmt=mark, color=colour, ms=4, lw=1.0)
        axes.plot(some["mos_trimmed"], y[here] + 0.25, mark, ms=3, mfc="white", mec=colour, mew=0.8)
    if named:
        axes.set_yticks(y, [short_name(name) for name in scores["stimulus"]], fontsize=7)
    else:
        axes.set_yticks([])
        axes.set_ylabel(f"{len(scores)} stimuli, by MOS")
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(rows - 0.4, -0.6)
    ticks = scale_ticks(scale)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.tick_params(axis="x", top=True, labeltop=True)
    axes.set_xlim(scale.low - 0.3, scale.high + 0.3)
    axes.set_xlabel(f"MOS, {scale}")
    axes.grid(visible=True, axis="x")
    axes.set_axisbelow(True)
