"""Recordings: folders of raw frames of a camera or of the simulator, read and written.

`read_recording` gives a `Recording`; its frames are streamed, so that a recording may be larger
than memory. `write_recording` writes one that reads back equal.
"""

from dsis.recording.model import ExposurePlan, RecordedExposure, Recording, Sensor
from dsis.recording.reader import read_recording
from dsis.recording.writer import origin_of, write_recording

__all__ = [
    "ExposurePlan",
    "RecordedExposure",
    "Recording",
    "Sensor",
    "origin_of",
    "read_recording",
    "write_recording",
]
