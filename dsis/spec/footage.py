"""The user's image files of each content, and whether they are a still or a sequence."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dsis.imagefile import find_files
from dsis.spec.schema import NAME_MAX, Content


@dataclass(frozen=True)
class Footage:
    """The image files of one content; iterating gives the files.

    Attributes
    ----------
    name
        The content's name.
    paths
        One still, or a numbered sequence in order: one file per frame, perhaps more than needed.
    still
        Whether all frames are windows over one picture.
    """

    name: str
    paths: tuple[Path, ...]
    still: bool

    def __iter__(self) -> Iterator[Path]:
        return iter(self.paths)


def footage_of(content: Content, folder: Path) -> tuple[Footage, ...]:
    """Return the footage of a `[[content]]`: one per still, one sequence, nothing of a scene."""
    if content.stills is not None:
        found = find_files(folder, content.stills)
        return tuple(Footage(still_name(path), (path,), still=True) for path in found)
    paths = find_files(folder, content.files or ())
    return (Footage(content.name or "", paths, still=len(paths) == 1),) if paths else ()


def still_name(path: Path) -> str:
    """Return the content's name of a still: its file's, with what no name may hold replaced."""
    name = re.sub(r"[^A-Za-z0-9]+", "-", path.stem).strip("-")
    return name[:NAME_MAX].rstrip("-") or "still"
