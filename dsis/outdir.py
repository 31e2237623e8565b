"""Result folders: one rule for all commands on what is held, resumed, replaced and never lost.

Work goes on in `DIR.partial`; a finished result takes the place of `DIR` by renaming. One process
at a time holds a `DIR`. What dsis did not write is never deleted: a `DIR`, `DIR.partial` or
`DIR.replaced` that holds anything else is refused before work begins. A kill at any moment leaves
the old result or what the next run puts right:

==================================== ============================================================
left behind                          the next run
==================================== ============================================================
`DIR.partial`                        goes on there (resumable), or begins anew
`DIR.partial` and `DIR.replaced`     puts the old result back as `DIR`, then the same
`DIR` and `DIR.replaced`             removes the old result
==================================== ============================================================
"""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from dsis.errors import DsisError, InputError

UNFINISHED = "journal.jsonl"
"""Marks a folder in which dsis is at work: what lies in it may be deleted.

Its first line names the work; a command that can resume adds lines of its own.
"""


_NAMED = 5
_OF_SYSTEMS = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})  # made again by themselves


def listed(names: Sequence[str]) -> str | None:
    """Return the first few of these names, and how many more there are; None where there are none.

    What `keep` of a `result_folder` says of files that dsis did not write.
    """
    names = [name for name in names if name.rpartition("/")[2] not in _OF_SYSTEMS]
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "") or None


@contextmanager
def said_of(out: Path) -> Iterator[None]:
    """Say that `out`, which the user named, cannot be written, and what the system says of it."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, f"cannot be written: {error.strerror}", str(out)) from None


def check_parents(out: Path) -> None:
    """Refuse a place below a file: no folder can be made there."""
    there = next((path for path in out.absolute().parents if path.exists()), None)
    if there is not None and not there.is_dir():
        raise InputError.of(out, "", f"lies below {there}, which is a file: give another place")


def _nothing(folder: Path) -> str | None:
    """Keep nothing."""
    del folder
    return None


@contextmanager
def result_folder(
    out: Path,
    mark: str,
    *,
    keep: Callable[[Path], str | None] = _nothing,
    resume: str | None = None,
) -> Iterator[Path]:
    """Yield the folder to work in; when the block ends without an error it takes `out`'s place.

    Parameters
    ----------
    out
        Where the result goes.
    mark
        A file that every finished result of this command holds.
    keep
        Says what in an earlier result (or unfinished work) must not be lost; None: nothing.
    resume
        Digest of all that decides the result: unfinished work of the same digest is handed over,
        of another is refused, unless nothing of it was finished. None: begin with an empty folder.

    Raises
    ------
    InputError
        `out` is no place for a result, holds something else, or another process is at work on it.
    """
    out = Path(os.path.abspath(out))  # noqa: PTH100 - resolve() would follow a link at `out`
    if not out.name:
        raise InputError.of(out, "", "is no place for results: give a folder")
    partial, replaced = (out.with_name(out.name + end) for end in (".partial", ".replaced"))
    with _held(out):
        with said_of(out):
            check_parents(out)
            _put_right(out, replaced, mark)
            _check_replaceable(out, mark, keep)
            _make_ready(partial, keep, resume)
        try:
            yield partial
        except DsisError:
            # What the input cannot give leaves nothing behind, unless frames were finished.
            if _nothing_finished(partial / UNFINISHED):
                shutil.rmtree(partial)
            raise
        if out.exists():
            shutil.rmtree(replaced, ignore_errors=True)
            out.rename(replaced)
        partial.rename(out)
        (out / UNFINISHED).unlink()
        shutil.rmtree(replaced, ignore_errors=True)


def _put_right(out: Path, replaced: Path, mark: str) -> None:
    """Put back the result that a killed run had moved aside."""
    if replaced.exists() and not (replaced / mark).is_file():
        raise InputError.of(replaced, "", f"holds no {mark}: move it away, dsis needs the name")
    if replaced.exists() and not out.exists():
        replaced.rename(out)


def _check_replaceable(out: Path, mark: str, keep: Callable[[Path], str | None]) -> None:
    if not out.exists():
        return
    if not out.is_dir():
        raise InputError.of(out, "", "is a file; give a folder for the results")
    if any(out.iterdir()) and not (out / mark).is_file():
        raise InputError.of(out, "", f"is not empty and holds no {mark}: give another folder")
    lost = keep(out)
    if lost is not None:
        raise InputError.of(out, "", f"holds {lost}, which would be lost: give another folder")


def _make_ready(partial: Path, keep: Callable[[Path], str | None], resume: str | None) -> None:
    """Make the folder to work in: empty, or with unfinished work of the same digest."""
    journal = partial / UNFINISHED
    ours = journal.is_file()
    if partial.exists() and not ours and (not partial.is_dir() or any(partial.iterdir())):
        raise InputError.of(partial, "", "is in the way and not of dsis: move it away")
    if ours:
        lost = keep(partial)
        if lost is not None:
            raise InputError.of(partial, "", f"holds {lost}, which would be lost: move it away")
        found = _first_line(journal)
        another = found != resume
        if resume is None or found is None or (another and _nothing_finished(journal)):
            shutil.rmtree(partial)
        elif another:
            fact = "holds unfinished work of another spec, seed or version: remove it, or give "
            raise InputError.of(partial, "", fact + "another folder with --out")
    partial.mkdir(parents=True, exist_ok=True)
    if not journal.exists():
        journal.write_bytes(json.dumps({"build": resume}).encode() + b"\n")


def _nothing_finished(journal: Path) -> bool:
    """Tell whether a journal has no line but its first: nothing is lost with such work."""
    return journal.read_bytes().count(b"\n") <= 1


def _first_line(journal: Path) -> str | None:
    """Return the digest of the work that a journal belongs to; None where it names none."""
    with journal.open("rb") as file:
        line = file.readline()
    try:
        found = json.loads(line)["build"]
    except (ValueError, KeyError, TypeError):
        return None
    return found if isinstance(found, str) else None


@contextmanager
def _held(out: Path) -> Iterator[None]:
    """Hold `out` for this process; locks lie in one folder beside other temporary files."""
    folder = Path(tempfile.gettempdir()) / "dsis-locks"
    folder.mkdir(exist_ok=True)
    with suppress(PermissionError):  # another user's: it is open to all already
        folder.chmod(0o1777)
    name = hashlib.blake2b(os.fsencode(out), digest_size=8).hexdigest()
    lock = FileLock(folder / f"{name}.lock", mode=0o666)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError.of(out, "", "another process is at work on it") from None
    try:
        yield
    finally:
        lock.release()
