"""For labs with a player of their own: printable score sheets, and the votes typed in from them."""

import csv
import hashlib
import io
from collections.abc import Iterable, Iterator
from pathlib import Path

import jinja2

from dsis.errors import Fault, InputError
from dsis.manifest import Manifest, read_manifest
from dsis.outdir import UNFINISHED, listed, result_folder
from dsis.session import events
from dsis.session.setup import Setup, current_setup
from dsis.session.steps import grade_words
from dsis.session.store import Row, Store, Vote, open_store

TO_TYPE = "votes-to-type.csv"
COLUMNS = ("observer", "presentation", "vote")
_TEMPLATE = Path(__file__).with_name("sheet.html.jinja")


def write_sheets(folder: Path, out: Path) -> int:
    """Write a score sheet and an operator's plan for every planned person; return how many.

    `P01-sheet.html` is for the observer and names no stimulus; `P01-plan.csv` is for who starts the
    clips; `votes-to-type.csv` has a line for every vote.

    Raises
    ------
    InputError
        Nobody has a plan, or `out` holds something else, votes that were typed in included.
    """
    manifest = read_manifest(folder)
    with open_store(folder, manifest) as store:
        people = [known.observer for known in store.observers() if not known.simulated]
        if not people:
            raise InputError.of(store.path, "", "nobody has a plan yet: dsis session DIR --plan")
        setup = current_setup(store, manifest.session)
        rows = {name: store.rows(name) for name in people}
    with result_folder(out, TO_TYPE, keep=_not_ours) as partial:
        lines: list[tuple[object, ...]] = []
        for name, planned in rows.items():
            sheet = _sheet(name, planned, manifest, setup)
            (partial / f"{name}-sheet.html").write_text(sheet, encoding="utf-8")
            _write_csv(partial / f"{name}-plan.csv", _PLAN, map(_planned, planned))
            lines += [(name, row.presentation.place, "") for row in planned if row.vote is None]
        _write_csv(partial / TO_TYPE, COLUMNS, lines)
    return len(people)


def read_typed_votes(folder: Path, path: Path) -> tuple[int, int]:
    """Store the votes in a table with `observer, presentation, vote`; return (stored, left blank).

    All of them or none; what is stored already with the same vote stays as it is. Nothing is known
    of dropped frames, and the votes say so.

    Raises
    ------
    InputError
        Faults of the table, all of them with their rows.
    """
    manifest = read_manifest(folder)
    lines = list(_read(path))
    with open_store(folder, manifest) as store, store.transaction():
        plans: _Plans = {}
        for row in store.rows():
            plans.setdefault(row.observer, {})[row.presentation.place] = row
        robots = {known.observer for known in store.observers() if known.simulated}
        found = [_checked(line, plans, robots, store.scale, path) for line in lines]
        faults = [entry for entry in found if isinstance(entry, Fault)]
        faults += _twice(lines, path)
        if faults:
            raise InputError(faults)
        new = [entry for entry in found if isinstance(entry, tuple) and entry[0].vote is None]
        _store_votes(store, new, hashlib.sha256(path.read_bytes()).hexdigest())
    return len(new), sum(entry is None for entry in found)


_PLAN = ("presentation", "session", "kind", "reference", "stimulus")
_Plans = dict[str, dict[int, Row]]  # by observer and place in the order
_Line = tuple[int, str, str, str]  # row in the file, and its cells


def _planned(row: Row) -> tuple[object, ...]:
    p = row.presentation
    return p.place, p.session, p.kind, p.reference, p.stimulus


def _write_csv(path: Path, header: tuple[str, ...], lines: Iterable[tuple[object, ...]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(lines)
    path.write_text(text.getvalue(), encoding="utf-8", newline="")


def _sheet(name: str, rows: list[Row], manifest: Manifest, setup: Setup) -> str:
    template = jinja2.Template(_TEMPLATE.read_text(encoding="utf-8"), autoescape=True)
    worst, best = manifest.session.scale
    text: str = template.render(
        title=manifest.title,
        observer=name,
        lab=setup.lab,
        instructions=setup.instructions,
        grades=list(range(worst, best + 1)) if best - worst < 11 else [],
        scale=(worst, best),
        labels=manifest.session.labels,
        words=setup.grade_words or grade_words(manifest.session),
        presentations=[row.presentation for row in rows if row.vote is None],
    )
    return text


def _read(path: Path) -> Iterator[_Line]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not UTF-8 text"
        raise InputError.of(path, "", f"cannot be read: {reason}") from None
    # Spreadsheets of some countries write semicolons.
    first = text.partition("\n")[0]
    reader = csv.reader(io.StringIO(text), delimiter=";" if ";" in first else ",")
    header = [cell.strip() for cell in next(reader, [])]
    if tuple(header) != COLUMNS:
        fact = f"has the columns {header}, must have {', '.join(COLUMNS)}"
        raise InputError.of(path, "", fact)
    for number, cells in enumerate(reader, 2):
        if any(cell.strip() for cell in cells):
            observer, place, vote = ([cell.strip() for cell in cells] + ["", "", ""])[:3]
            yield number, observer, place, vote


def _checked(
    line: _Line,
    plans: _Plans,
    robots: set[str],
    scale: tuple[int, int],
    path: Path,
) -> tuple[Row, int] | Fault | None:
    """Return the presentation and the vote of a line, what is wrong there, or None: left blank."""
    number, observer, place, text = line

    def fault(key: str, fact: str) -> Fault:
        return Fault(str(path), f"row {number}: {key}", fact)

    if observer not in plans or observer in robots:
        return fault("observer", _nobody(observer, plans, robots))
    row = plans[observer].get(int(place)) if place.isdecimal() else None
    if row is None:
        return fault("presentation", f"{place!r} is not in the plan of {observer!r}")
    if not text:
        return None
    grade = int(text) if text.removeprefix("-").isdecimal() else None
    if grade is None or not scale[0] <= grade <= scale[1]:
        fact = f"is {text!r}, must be a whole number from {scale[0]} to {scale[1]}"
        return fault("vote", fact)
    if row.vote is not None and row.vote.vote != grade:
        return fault("vote", f"is {grade}, but {row.vote.vote} is stored already")
    return row, grade


def _nobody(observer: str, plans: _Plans, robots: set[str]) -> str:
    """Return why no votes of this observer can be typed."""
    if observer in robots:
        return f"{observer!r} is a simulated observer"
    people = listed(sorted(plans.keys() - robots)) or "nobody"
    return f"{observer!r} has no plan; who has: {people}"


def _twice(lines: list[_Line], path: Path) -> Iterator[Fault]:
    seen: dict[tuple[str, int | str], int] = {}
    for number, observer, place, _ in lines:
        same = int(place) if place.isdecimal() else place  # 01 is 1
        first = seen.setdefault((observer, same), number)
        if first != number:
            fact = f"{place} of {observer} is in row {first} already"
            yield Fault(str(path), f"row {number}: presentation", fact)


def _store_votes(store: Store, new: list[tuple[Row, int]], sha256: str) -> None:
    begun = {fact["observer"] for fact in store.events("began")}
    for observer in sorted({row.observer for row, _ in new} - begun):
        store.log("began", observer=observer)
    for row, grade in new:
        vote = Vote(grade, None, events.now(), True, None, False)
        store.record_vote(row.id, vote, details={"typed_from_sha256": sha256})
    store.log("typed", votes=len(new), file_sha256=sha256)


def _not_ours(out: Path) -> str | None:
    """Return what in earlier sheets would be missed: votes typed in, or files of others."""
    if (out / TO_TYPE).is_file() and any(vote for *_, vote in _read(out / TO_TYPE)):
        return f"votes in {TO_TYPE}"
    ours = ("-sheet.html", "-plan.csv")
    known = {TO_TYPE, UNFINISHED}
    other = [p.name for p in out.iterdir() if p.name not in known and not p.name.endswith(ours)]
    return ", ".join(sorted(other)) or None
