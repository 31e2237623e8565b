"""The page of a report: HTML that holds its style and its figures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analysis.figures import DEMOSAICKERS, NOISES, condition_name, simulated_mark
from analysis.figures_mos import has_conditions
from analysis.inference.design import CELL
from analysis.page import embedded, render_page
from analysis.report.methods import methods
from analysis.report.remarks import observer_name
from analysis.report.results import Results
from analysis.report.tables import columns_of
from analysis.scale import Description
from analysis.table import codebook
from dsis import __version__

REMOVED_SHOWN = 200
SCORES_SHOWN = 300
EFFECTS_SHOWN = 60
TEMPLATE = Path(__file__).with_name("report.html.jinja")


def render(
    results: Results, test: Description, votes_name: str, figures: Mapping[str, bytes]
) -> str:
    """Return the page; `figures` holds the SVG of each figure by name."""
    paragraphs, references = methods(results, test.scale)
    values = {
        "title": test.title or "Mean opinion scores",
        "scale": test.scale,
        "votes_name": votes_name,
        "counts": results.counts,
        "options": results.options,
        "mark": simulated_mark(results.counts.simulated_share),
        "remarks": results.remarks,
        "conclusions": results.conclusions,
        "figures": {name: embedded(svg) for name, svg in figures.items()},
        "conditions": has_conditions(results.scores),
        "levels": len(results.scores["level"].dropna().unique()) > 1,
        "scores": _named(results.scores)[:SCORES_SHOWN],
        "more_scores": max(0, len(results.scores) - SCORES_SHOWN),
        "n_removed": int(results.scores["n_removed"].sum()),
        "p910_degenerate": results.p910_degenerate,
        "dmos": [row | {"kind": "test"} for row in _named(results.dmos)][:SCORES_SHOWN],
        "models": _rows(results.models),
        "sos": results.sos,
        "retest": results.retest,
        "order": _rows(results.order),
        "contrasts": _compared(results.contrasts)[:EFFECTS_SHOWN],
        "effects": _compared(averages(results.modelled.effects))[:EFFECTS_SHOWN],
        "modelled": results.modelled,
        "stimuli": results.stimuli,
        "observers": _observer_rows(results),
        "proposal": _with_names(results.proposal),
        "threshold": float(results.correlation["threshold"].iloc[0]),
        "removed": _with_names(results.removed)[:REMOVED_SHOWN],
        "methods": paragraphs,
        "references": references,
        "tables": {
            name: codebook(columns) for name, columns in columns_of(results.options).items()
        },
        "version": __version__,
    }
    filters = {
        "grade": _grade,
        "percent": lambda share: f"{100 * share:.1f} %",
        "chance": _chance,
    }
    return render_page(TEMPLATE, values, filters)


def _grade(value: Any, digits: int = 2) -> str:
    """Return a number with a typographic minus; a dash where there is none."""
    if pd.isna(value):
        return "\u2013"
    return f"{value:.{digits}f}".replace("-", "\u2212")


def _chance(p: Any) -> str:
    """Return a p-value as journals print it."""
    if pd.isna(p):
        return "\u2013"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]


def _named(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows with conditions as people call them."""
    return [
        row
        | {
            "noise": NOISES.get(row["noise"], row["noise"]),
            "demosaic": DEMOSAICKERS.get(row["demosaic"], row["demosaic"]),
            "level": "" if np.isnan(row["level"]) else f"{row['level']:g}",
        }
        for row in _rows(table)
    ]


def averages(effects: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that average over pairs; all rows where none does."""
    wide = effects[effects["grain"] != CELL]
    return wide if len(wide) else effects


def _compared(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows with treatment and held factor as people call them."""
    words = ("treatment", "within")
    return [row | {word: condition_name(row[word]) for word in words} for row in _rows(table)]


def _observer_rows(results: Results) -> list[dict[str, Any]]:
    """Join the screenings' numbers to the rows of `observers.csv`; all have one order."""
    screens = results.kurtosis[["outside", "balance", "above", "below"]]
    rejected = results.screens["rejected"]
    others = {
        f"{method}_rejected": rejected[results.screens["method"] == method].to_numpy(dtype=np.bool_)
        for method in ("p913", "inconsistency")
    }
    table = pd.concat([results.observers, screens], axis=1).assign(**others)
    names = observer_name(results.observers)
    return [row | {"name": name} for row, name in zip(_rows(table), names, strict=True)]


def _with_names(table: pd.DataFrame) -> list[dict[str, Any]]:
    names = observer_name(table)
    return [row | {"name": name} for row, name in zip(_rows(table), names, strict=True)]
