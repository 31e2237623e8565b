"""What photon transfer needs of a recording: structural types, so that it runs without files."""

from collections.abc import Iterator, Sequence, Sized
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa


class Sensor(Protocol):
    """The sensor of a recording; levels in DN."""

    @property
    def name(self) -> str: ...  # noqa: D102 - the field's standard terms
    @property
    def cfa(self) -> Cfa: ...  # noqa: D102
    @property
    def black_level(self) -> float: ...  # noqa: D102
    @property
    def white_level(self) -> float: ...  # noqa: D102
    @property
    def bit_depth(self) -> int: ...  # noqa: D102


class RecordedExposure(Protocol):
    """Frames taken under the same light for the same time."""

    @property
    def name(self) -> str: ...  # noqa: D102 - the field's standard terms
    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def exposure_time_s(self) -> float: ...  # noqa: D102
    @property
    def light(self) -> float | None: ...  # noqa: D102
    @property
    def frames(self) -> Sized: ...  # noqa: D102


class Recorded(Protocol):
    """A recording: its sensor, its exposures and their frames, uint16 (row, column)."""

    @property
    def sensor(self) -> Sensor: ...  # noqa: D102 - the field's standard terms
    @property
    def exposures(self) -> Sequence[Any]: ...  # noqa: D102
    def frames(self, exposure: Any, /) -> Iterator[NDArray[np.uint16]]: ...  # noqa: D102


def channel_names(cfa: Cfa) -> tuple[tuple[str, str], tuple[str, str]]:
    """Return the channel at (row parity, column parity): R, Gr, Gb, B, or MONO everywhere."""
    if cfa is Cfa.MONO:
        return (("MONO", "MONO"), ("MONO", "MONO"))
    letters = cfa.value
    rows = [letters[:2], letters[2:]]

    def name(row: str, letter: str) -> str:
        return letter if letter != "G" else "G" + ("r" if "R" in row else "b")

    first, second = ((name(row, row[0]), name(row, row[1])) for row in rows)
    return (first, second)
