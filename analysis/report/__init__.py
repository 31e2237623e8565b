"""The MOS report: one self-contained page, its figures, and the tables as CSV."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from analysis.labs import read_labs
from analysis.rejection import reject
from analysis.report.page import render
from analysis.report.pictures import FIGURES, draw_all
from analysis.report.remarks import count_votes
from analysis.report.results import Options, Results, analyse
from analysis.report.stimuli import shown_stimuli
from analysis.report.tables import TABLES, tables_of
from analysis.screening import THRESHOLD_SD
from analysis.table import to_csv
from dsis.errors import InputError
from dsis.outdir import UNFINISHED, result_folder

__all__ = ["FILES", "Options", "Results", "analyse", "write_report"]

PICTURES = tuple(f"{name}.{end}" for name in FIGURES for end in ("svg", "png"))
FILES = ("report.html", *PICTURES, *TABLES)
"""All that a report may hold; some figures only where there is something to show."""


def write_report(
    votes_files: Path | Sequence[Path],
    out: Path,
    scale: tuple[float, float] | None = None,
    *,
    rejected: Iterable[str] = (),
    accepted: Iterable[str] = (),
    threshold: float = THRESHOLD_SD,
    passes: int = 1,
) -> Results:
    """Write the MOS report of votes: the files `FILES`, into the folder `out`.

    The page holds its figures and needs no network. The same votes give the same bytes. Work goes
    on in `out` + ".partial", which then takes the place of an earlier report.

    Parameters
    ----------
    votes_files
        A file as `analysis.read_votes` takes it, or several: the laboratories of one test.
    out
        New, empty, or an earlier report.
    scale
        Lowest and highest grade; None: as the `datapackage.json` beside the votes, or the store,
        says.
    rejected, accepted
        Observers to leave out, named by hand and in a file of decisions (`analysis.reject`): never
        decided by the report itself.
    threshold, passes
        Of the removal of votes: standard deviations, and how often.

    Returns
    -------
    Results
        What the report shows.

    Raises
    ------
    InputError
        The votes cannot be used (every row that is wrong is named), the scale is not known, an
        observer to reject is not there, or `out` holds something else.
    """
    files = [votes_files] if isinstance(votes_files, Path) else list(votes_files)
    votes, test = read_labs(files, scale)
    if count_votes(votes).scored == 0:
        raise InputError.of(
            ", ".join(map(str, files)), "", "holds no valid vote on a test sequence"
        )
    votes, gone = reject(votes, rejected, accepted)
    results = analyse(votes, test, Options(threshold, passes, tuple(gone)))
    results = replace(results, stimuli=tuple(shown_stimuli(files[0])))
    with result_folder(out, "mos.csv", keep=_not_ours) as partial:
        figures = draw_all(votes, results, test.scale, partial)
        texts = {name: to_csv(table, TABLES[name]) for name, table in tables_of(results).items()}
        names = ", ".join(file.name for file in files)
        texts["report.html"] = render(results, test, names, figures)
        for name, text in texts.items():
            (partial / name).write_text(text, encoding="utf-8", newline="")
    return results


def _not_ours(out: Path) -> str | None:
    """Return what in an earlier report is no part of one."""
    other = sorted(p.name for p in out.iterdir() if p.name not in (*FILES, UNFINISHED))
    return ", ".join(other) or None
