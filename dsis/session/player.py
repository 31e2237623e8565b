"""What shows the clips: the page itself, or a program for reference monitors in its place."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from dsis.session.cliplog import ClipLog
from dsis.session.clips import PlayerClip
from dsis.session.steps import Step


class Player(Protocol):
    """Shows presentations on a display of its own; the page then only asks for the votes."""

    def describe(self) -> Mapping[str, Any]:
        """Return program, version and settings, for the log; JSON can hold it."""

    def show(self, steps: Sequence[Step], clips: Mapping[str, PlayerClip]) -> tuple[ClipLog, ...]:
        """Show every step in order, grey at the end, and return a log for each clip shown.

        Raises
        ------
        DamagedError
            The program does not answer any more; the next call starts it again.
        """

    def close(self) -> None:
        """End the program."""
