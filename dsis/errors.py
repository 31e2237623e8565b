"""The tree of errors.

::

    DsisError
    |-- InputError        what the user gave is wrong: file, key, value, what was allowed
    |-- DamagedError      what lies on disk is not what its manifest says
    |-- WorkersLostError  workers died again and again before the work was done (dsis.workers)

The command line prints the message of either, without a traceback, and leaves with status 2 and 1.
Inner code states the bare fact; the boundary that knows the file adds it as a `Fault`.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self


class DsisError(Exception):
    """Base of everything that dsis raises on purpose."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong in the user's input.

    Attributes
    ----------
    file
        The file (or option) that holds it, as the user named it.
    key
        Path inside that file, `sequence.width` or `content[0].name`; empty: the file itself.
    fact
        What is wrong, with the value found and what was allowed.
    """

    file: str
    key: str
    fact: str

    def __str__(self) -> str:
        return ": ".join(part for part in (self.file, self.key, self.fact) if part)


class InputError(DsisError):
    """The user's input cannot be used; carries every fault that was found."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[Fault, ...]]]:
        """Travel from a process with the faults; exceptions do so with their message alone."""
        return type(self), (self.faults,)

    @classmethod
    def of(cls, file: object, key: str, fact: str) -> Self:
        """Return the error for a single fault."""
        return cls([Fault(str(file), key, fact)])


class DamagedError(DsisError):
    """Files differ from what their manifest says they are."""
