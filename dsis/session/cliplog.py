"""What a player knows of one showing of one clip."""

from typing import Annotated, Any, Literal

from pydantic import Field

from dsis.model import Model

NonNegative = Annotated[float, Field(ge=0)]


class ClipLog(Model):
    """One clip of a presentation as it was shown.

    Attributes
    ----------
    show
        Which clip of the pair.
    frames
        (frame, time in ms after the first) of every frame that was painted, ascending; empty where
        the player counts only.
    longest_interval_ms
        Longest time that one frame stayed; None: the player counts only.
    hidden
        The picture was not on the screen for some of the time.
    dropped
        Frames that a player with counters of its own did not show; None: they follow from `frames`.
    counters
        What such a player says besides.
    """

    show: Literal["reference", "test"]
    frames: tuple[tuple[Annotated[int, Field(ge=0)], float], ...] = ()
    longest_interval_ms: NonNegative | None = None
    hidden: bool = False
    dropped: Annotated[int, Field(ge=0)] | None = None
    counters: dict[str, Any] = Field(default_factory=dict)
