"""Votes straight out of the store of a session."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from dsis.manifest import MANIFEST
from dsis.session import export_votes
from dsis.session.store import STORE


def store_folder(path: Path) -> Path | None:
    """Return the stimuli folder whose store `path` is, or that `path` is; None: it is neither."""
    if path.is_dir():
        return path if (path / STORE).is_file() or (path / MANIFEST).is_file() else None
    return path.parent.parent if path.name == STORE.name else None


@contextmanager
def exported(folder: Path) -> Iterator[Path]:
    """Yield the `votes.csv` that `dsis votes` would write of a stimuli folder; it does not last.

    So the votes are those of an export, to the row. A session may be running: they are those of one
    moment.

    Raises
    ------
    InputError
        There is no store, it is of other stimuli, or it holds no vote.
    """
    with TemporaryDirectory(prefix="dsis-votes-") as temporary:
        out = Path(temporary) / "votes"
        export_votes(folder, out)
        yield out / "votes.csv"
