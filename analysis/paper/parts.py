"""Which parts of the paper there are, and the folder that they are written into."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from analysis.paper.claims import recompute as claims
from analysis.paper.denoised import measure as denoised_frames
from analysis.paper.equation5 import recompute as equation5
from analysis.paper.fig1 import recompute as fig1
from analysis.paper.fig2 import recompute as fig2
from analysis.paper.fig3 import recompute as fig3
from analysis.paper.fig4 import recompute as fig4
from analysis.paper.fig5 import recompute as fig5
from analysis.paper.fig6 import recompute as fig6
from analysis.paper.fig6 import scores
from analysis.paper.page import render
from analysis.paper.part import Part
from analysis.paper.setting import Setting
from analysis.paper.table1 import recompute as table1
from analysis.paper.table2 import recompute as table2
from dsis import __version__
from dsis.errors import Fault, InputError
from dsis.outdir import UNFINISHED, result_folder

PAGE = "paper.html"
WRITTEN = frozenset({".html", ".csv", ".md", ".svg", ".png", ".new"})

DENOISED = frozenset({"claims", "table2"})  # the parts that need Table 2's frames

Recompute: TypeAlias = Callable[[Setting, Path], Part]

PARTS: dict[str, Recompute] = {
    "claims": claims,
    "fig1": fig1,
    "fig2": fig2,
    "table1": table1,
    "equation5": equation5,
    "fig3": fig3,
    "fig4": fig4,
    "fig5": fig5,
    "fig6": fig6,
    "table2": table2,
}
"""In the order of the page: what each draws goes into the folder that it is given."""


def write_paper(
    out: Path,
    setting: Setting,
    names: Sequence[str] = (),
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[Part, ...]:
    """Recompute the paper, or the parts named, and write page, figures and tables.

    `out` gets `paper.html`, which needs no network, figures as SVG and PNG, tables as CSV and
    Markdown. The same setting gives the same bytes on one machine. Work goes on in `out`.partial;
    of work that was interrupted or ended in an error, the frames of Table 2 that were finished are
    kept.

    Parameters
    ----------
    out
        New, empty, or an earlier result.
    setting
        Data, size, seed and threads.
    names
        Of `PARTS`; none: all.
    progress
        Told (done, total, what).

    Raises
    ------
    InputError
        There is no such part, the votes or the recording cannot be used, or `out` holds
        something else.
    """
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        allowed = f"must be one of {', '.join(PARTS)}"
        raise InputError([Fault("", "NAME", f"is {name!r}, {allowed}") for name in unknown])
    wanted = [name for name in PARTS if name in names or not names]
    _check_votes(setting, wanted)
    frames = 0 if DENOISED.isdisjoint(wanted) else setting.denoised_frames
    # The claims stand first on the page, and need what the others compute.
    order = sorted(wanted, key=lambda name: name == "claims")
    parts: dict[str, Part] = {}

    def tell(done: int, what: str) -> None:
        if progress is not None:
            progress(done, len(wanted) + frames, what)

    def tell_frame(frame: int) -> None:
        tell(frame, f"frame {frame + 1} of {frames} of table2")

    with result_folder(out, PAGE, keep=_not_ours, resume=_digest(setting, wanted)) as folder:
        if frames:  # they take longest, and come first: they alone outlast an interruption
            denoised_frames(setting, folder, tell_frame)
        for done, name in enumerate(order):
            tell(frames + done, name)
            parts[name] = PARTS[name](setting, folder)
            _write_tables(parts[name], folder)
        found = tuple(parts[name] for name in wanted)
        (folder / PAGE).write_bytes(render(found, setting, folder).encode())
    return found


def _write_tables(part: Part, folder: Path) -> None:
    for table in part.all_tables():
        (folder / f"{table.name}.csv").write_bytes(table.csv().encode())
        (folder / f"{table.name}.md").write_bytes(table.markdown().encode())


def _check_votes(setting: Setting, wanted: Sequence[str]) -> None:
    """Refuse before the work begins what would be refused in the middle of it."""
    if setting.votes is None and setting.scale is not None:
        raise InputError.of("--scale", "", "is that of people's votes: give --votes FILE too")
    if setting.votes is not None and not {"fig6", "claims"}.isdisjoint(wanted):
        scores(setting)  # kept for those parts


def _digest(setting: Setting, names: Sequence[str]) -> str:
    """Return what the result depends on: unfinished work of another is not gone on with."""
    return f"paper {__version__} {replace(setting, jobs=1)} {' '.join(names)}"


def _not_ours(out: Path) -> str | None:
    """Return what in an earlier result is no part of one."""
    kept = (p for p in out.iterdir() if p.suffix not in WRITTEN and p.name != UNFINISHED)
    return ", ".join(sorted(p.name for p in kept)) or None
