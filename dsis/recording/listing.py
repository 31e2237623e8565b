"""What a description of a recording lists, before any frame has been looked at."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dsis.errors import Fault
from dsis.recording.model import RecordedExposure, Sensor


@dataclass(frozen=True)
class Listed:
    """An exposure and where in the description it stands, for messages."""

    place: str
    exposure: RecordedExposure


@dataclass(frozen=True)
class Listing:
    """A description that has been read; frames may still be missing or unfit.

    Attributes
    ----------
    file
        The description.
    sensor
        None where it is at fault.
    exposures
        Those that could be understood.
    size
        Rows and columns that the description demands; None: it leaves them to the frames.
    faults
        What is wrong with the description itself.
    """

    file: Path
    sensor: Sensor | None
    exposures: tuple[Listed, ...]
    size: tuple[int, int] | None = None
    faults: tuple[Fault, ...] = field(default=())


def absolute(folder: Path, name: str) -> Path:
    """Return the absolute path of a file named in a description that lies in `folder`."""
    return Path(os.path.normpath(folder.absolute() / Path(name).expanduser()))


NAMED = 3  # faults of one kind that are told one by one


def counted(faults: Sequence[Fault], what: str, named: int = 1) -> list[Fault]:
    """Return up to `named` faults of one kind as they are, of more the first and their number."""
    if len(faults) <= named:
        return list(faults)
    first = faults[0]
    return [replace(first, fact=f"{first.fact} (the first of {len(faults)} {what})")]
