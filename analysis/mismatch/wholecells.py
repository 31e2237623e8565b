"""A mosaic of an odd number of rows or columns, without the last one: colours lie on one grid."""

from dataclasses import dataclass, fields

import numpy as np

from dsis.cfa import Cfa
from dsis.recording import RecordedExposure, Recording
from dsis.recording.model import Codes


@dataclass(frozen=True)
class Cropped(Recording):
    """The first rows and columns of a recording.

    Attributes
    ----------
    stored
        The recording as it lies on disk.
    """

    stored: Recording

    def frame(self, exposure: RecordedExposure, index: int) -> Codes:
        """Return one frame as `Recording.frame` does, cropped."""
        return np.ascontiguousarray(self.stored.frame(exposure, index)[: self.rows, : self.columns])


def unseen(recording: Recording) -> tuple[int, int]:
    """Return how many rows and columns of frames as stored are not looked at."""
    if not isinstance(recording, Cropped):
        return 0, 0
    stored = recording.stored
    return stored.rows - recording.rows, stored.columns - recording.columns


def whole_cells(recording: Recording) -> Recording:
    """Return a recording of whole 2 x 2 cells; one that has no colours, or even sizes, as it is."""
    rows, columns = (n - n % 2 for n in (recording.rows, recording.columns))
    if recording.sensor.cfa is Cfa.MONO or (rows, columns) == (recording.rows, recording.columns):
        return recording
    values = {field.name: getattr(recording, field.name) for field in fields(Recording)}
    return Cropped(**(values | {"rows": rows, "columns": columns}), stored=recording)
