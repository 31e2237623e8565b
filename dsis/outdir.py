"""Result folders: work goes on in `DIR.partial`; a finished result takes its place in one step."""

import shutil
from pathlib import Path

from dsis.errors import InputError


def partial_of(out: Path) -> Path:
    """Return the folder in which work on `out` goes on."""
    whole = out.absolute()
    return whole.with_name(whole.name + ".partial")


def check_replaceable(out: Path, mark: str, kept: str | None = None) -> None:
    """Refuse an `out` that dsis must not replace.

    Parameters
    ----------
    out
        The folder that a command is to write.
    mark
        A file that every earlier result of this command holds.
    kept
        A file or folder that must not be lost with an earlier result.
    """
    if not out.exists():
        return
    if not out.is_dir():
        raise InputError.of(out, "", "is a file; give a folder for the results")
    if any(out.iterdir()) and not (out / mark).is_file():
        raise InputError.of(out, "", f"is not empty and holds no {mark}: give another folder")
    if kept is not None and (out / kept).exists():
        raise InputError.of(out, "", f"holds {kept}, which would be lost: give another folder")


def finish(partial: Path, out: Path) -> None:
    """Put the finished `partial` in the place of `out`; an earlier result goes last."""
    old = out.with_name(out.name + ".replaced")
    if old.exists():
        shutil.rmtree(old)
    if out.exists():
        out.rename(old)
    partial.rename(out)
    if old.exists():
        shutil.rmtree(old)
