"""The MOS report: one self-contained page, the figure, and the tables as CSV."""

from base64 import b64encode
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd

from analysis.figures import (
    DEMOSAICKERS,
    NOISES,
    draw_mos,
    has_conditions,
    simulated_mark,
)
from analysis.report.remarks import Counts, count_votes, observer_name, remarks
from analysis.report.stimuli import shown_stimuli
from analysis.scale import Description, describe_test
from analysis.scores import MOS_COLUMNS, OBSERVER_COLUMNS, observer_table, score_table
from analysis.screening import REMOVED_COLUMNS, remove_outliers, screen_bt500, screen_correlation
from analysis.table import codebook, to_csv
from analysis.votesfile import read_votes
from dsis import __version__
from dsis.errors import InputError
from dsis.outdir import UNFINISHED, result_folder

FILES = ("report.html", "mos.svg", "mos.png", "mos.csv", "observers.csv", "removed_votes.csv")
REMOVED_SHOWN = 200


@dataclass(frozen=True)
class Results:
    """Everything that a report shows."""

    counts: Counts
    scores: pd.DataFrame
    observers: pd.DataFrame
    removed: pd.DataFrame
    kurtosis: pd.DataFrame
    correlation: pd.DataFrame
    remarks: tuple[str, ...]
    stimuli: tuple[dict[str, object], ...] = ()


def write_report(votes_csv: Path, out: Path, scale: tuple[int, int] | None = None) -> None:
    """Write the MOS report of a file of votes: the files `FILES`, into the folder `out`.

    The page holds its figure and needs no network. The same votes give the same bytes. Work goes
    on in `out` + ".partial", which then takes the place of an earlier report.

    Parameters
    ----------
    votes_csv
        As `analysis.read_votes` takes it.
    out
        New, empty, or an earlier report.
    scale
        Lowest and highest grade; None: as the `datapackage.json` beside the votes says.

    Raises
    ------
    InputError
        The votes cannot be used (every row that is wrong is named), the scale is not known, or
        `out` holds something else.
    """
    test = describe_test(votes_csv, scale)
    votes = read_votes(votes_csv, scale)
    if count_votes(votes).scored == 0:
        raise InputError.of(votes_csv, "", "holds no valid vote on a test sequence")
    results = replace(analyse(votes, test), stimuli=tuple(shown_stimuli(votes_csv)))
    with result_folder(out, "mos.csv", keep=_not_ours) as partial:
        draw_mos(results.scores, test.scale, results.counts.simulated_share, partial / "mos")
        page = render(results, test, votes_csv.name, (partial / "mos.svg").read_bytes())
        for name, text in (
            ("mos.csv", to_csv(results.scores, MOS_COLUMNS)),
            ("observers.csv", to_csv(results.observers, OBSERVER_COLUMNS)),
            ("removed_votes.csv", to_csv(results.removed, REMOVED_COLUMNS)),
            ("report.html", page),
        ):
            (partial / name).write_text(text, encoding="utf-8", newline="")


def _not_ours(out: Path) -> str | None:
    """Return what in an earlier report is no part of one."""
    other = sorted(p.name for p in out.iterdir() if p.name not in (*FILES, UNFINISHED))
    return ", ".join(other) or None


def analyse(votes: pd.DataFrame, test: Description) -> Results:
    """Return the tables of a report and its remarks, from a table of votes."""
    counts = count_votes(votes)
    scores, observers = score_table(votes), observer_table(votes)
    removed = remove_outliers(votes).removed
    return Results(
        counts,
        scores,
        observers,
        removed,
        screen_bt500(votes),
        screen_correlation(votes),
        tuple(remarks(votes, test.scale, counts, scores, observers)),
    )


def render(results: Results, test: Description, votes_name: str, figure_svg: bytes) -> str:
    """Return the page: HTML that holds its style and its figure."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["grade"] = _grade
    environment.filters["percent"] = lambda share: f"{100 * share:.1f} %"
    return environment.get_template("report.html.jinja").render(
        title=test.title or "Mean opinion scores",
        scale=test.scale,
        votes_name=votes_name,
        counts=results.counts,
        mark=simulated_mark(results.counts.simulated_share),
        remarks=results.remarks,
        figure=b64encode(figure_svg).decode("ascii"),
        conditions=has_conditions(results.scores),
        levels=len(results.scores["level"].dropna().unique()) > 1,
        scores=_score_rows(results.scores),
        stimuli=results.stimuli,
        observers=_observer_rows(results),
        threshold=float(results.correlation["threshold"].iloc[0]),
        removed=_removed_rows(results.removed)[:REMOVED_SHOWN],
        tables={
            "mos.csv": codebook(MOS_COLUMNS),
            "observers.csv": codebook(OBSERVER_COLUMNS),
            "removed_votes.csv": codebook(REMOVED_COLUMNS),
        },
        version=__version__,
    )


def _grade(value: Any, digits: int = 2) -> str:
    """Return a number with a typographic minus; a dash where there is none."""
    if pd.isna(value):
        return "\u2013"
    return f"{value:.{digits}f}".replace("-", "\u2212")


def _rows(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]


def _score_rows(scores: pd.DataFrame) -> list[dict[str, Any]]:
    return [
        row
        | {
            "noise": NOISES.get(row["noise"], row["noise"]),
            "demosaic": DEMOSAICKERS.get(row["demosaic"], row["demosaic"]),
            "level": "" if np.isnan(row["level"]) else f"{row['level']:g}",
        }
        for row in _rows(scores)
    ]


def _observer_rows(results: Results) -> list[dict[str, Any]]:
    """Join the two screenings' numbers to the rows of `observers.csv`; all have one order."""
    screens = results.kurtosis[["outside", "balance", "above", "below"]]
    table = pd.concat([results.observers, screens], axis=1)
    names = observer_name(results.observers)
    return [row | {"name": name} for row, name in zip(_rows(table), names, strict=True)]


def _removed_rows(removed: pd.DataFrame) -> list[dict[str, Any]]:
    names = observer_name(removed)
    return [row | {"name": name} for row, name in zip(_rows(removed), names, strict=True)]
