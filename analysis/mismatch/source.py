"""Frames of a recording, kept in memory where they fit."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from dsis.recording import Recording
from dsis.recording.copies import Identity, Place, identity_of

_MOST_BYTES = 1_200_000_000


class Source:
    """Gives the frames of exposures by number; small recordings are read once.

    `identities` are those of the frames that were read, by exposure and number.
    """

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        count = sum(len(e.frames) for e in recording.exposures)
        self.keeps = count * recording.rows * recording.columns * 2 <= _MOST_BYTES
        self.kept: dict[Place, NDArray[np.uint16]] = {}
        self.identities: dict[Place, Identity | None] = {}

    def frames(self, exposure: str, numbers: Sequence[int]) -> Iterator[NDArray[np.uint16]]:
        """Yield frames (row, column) of an exposure in the order of `numbers`."""
        missing = [n for n in numbers if (exposure, n) not in self.kept]
        recorded = self.recording.exposure(exposure)
        if not self.keeps:
            for number, frame in zip(
                numbers, self.recording.frames(recorded, numbers, ahead=1), strict=True
            ):
                self._look((exposure, number), frame)
                yield frame
            return
        for number, frame in zip(
            missing, self.recording.frames(recorded, missing, ahead=1), strict=True
        ):
            self._look((exposure, number), frame)
            self.kept[exposure, number] = frame
        for number in numbers:
            yield self.kept[exposure, number]

    def stack(self, exposure: str, numbers: Sequence[int]) -> NDArray[np.uint16]:
        """Return frames (frame, row, column) of an exposure."""
        return np.stack(list(self.frames(exposure, numbers)))

    def _look(self, key: Place, frame: NDArray[np.uint16]) -> None:
        if key not in self.identities:
            self.identities[key] = identity_of(frame)
