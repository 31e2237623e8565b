"""What a recording is: a sensor, its exposures, and their frames as a stream."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.model import Model
from dsis.recording.ahead import in_order
from dsis.recording.frameformat import read_frame
from dsis.recording.hygiene import Inspection

Kind = Literal["dark", "flat", "scene"]
Codes = NDArray[np.uint16]


class Sensor(Model):
    """The sensor that was recorded, as its owner states it.

    Attributes
    ----------
    name
        Any.
    cfa
        Colour of rows 0, 1 and columns 0, 1.
    black_level
        Nominal pedestal, DN; it may be wrong.
    white_level
        Largest code, DN.
    bit_depth
        Of the converter.
    """

    name: str
    cfa: Cfa
    black_level: Annotated[float, Field(ge=0)]
    white_level: Annotated[float, Field(gt=0)]
    bit_depth: Annotated[int, Field(ge=1, le=16)]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        largest = 2**self.bit_depth - 1
        if not self.white_level.is_integer():
            message = f"white_level is {self.white_level}, must be a whole number: it is a code"
            raise ValueError(message)
        if self.white_level > largest:
            message = f"white_level is {self.white_level:g}, must be <= {largest}: "
            message += f"the largest code of bit_depth = {self.bit_depth}"
            raise ValueError(message)
        if self.black_level >= self.white_level:
            message = f"black_level is {self.black_level:g}, must be below white_level "
            message += f"({self.white_level:g})"
            raise ValueError(message)
        return self


@dataclass(frozen=True)
class ExposurePlan:
    """An exposure without its frames: what is to be written.

    Attributes
    ----------
    name
        Unique in the recording.
    kind
        `dark`, `flat` (uniform light) or `scene` (static).
    exposure_time_s
        Exposure time, s.
    frames
        Number of frames.
    light
        Light per frame in any linear unit; None: unknown, or a dark.
    """

    name: str
    kind: Kind
    exposure_time_s: float
    frames: int
    light: float | None = None


@dataclass(frozen=True)
class RecordedExposure:
    """Frames of one light and one exposure time; attributes as those of `ExposurePlan`.

    Attributes
    ----------
    frames
        Absolute paths in the order recorded.
    """

    name: str
    kind: Kind
    exposure_time_s: float
    light: float | None
    frames: tuple[Path, ...]

    @property
    def plan(self) -> ExposurePlan:
        """The exposure without its frames."""
        count = len(self.frames)
        return ExposurePlan(self.name, self.kind, self.exposure_time_s, count, self.light)


@dataclass(frozen=True)
class Recording:
    """A recording whose headers have been checked; frames are read when they are asked for.

    Attributes
    ----------
    sensor
        What its owner states.
    exposures
        In the order of the file.
    rows, columns
        Size of every frame in pixels.
    folder
        Where it lies.
    """

    sensor: Sensor
    exposures: tuple[RecordedExposure, ...]
    rows: int
    columns: int
    folder: Path

    @property
    def grid(self) -> PixelGrid:
        """The pixels of a frame."""
        return PixelGrid(self.rows, self.columns, self.sensor.cfa)

    def exposure(self, name: str) -> RecordedExposure:
        """Return the exposure of that name; raise `KeyError` where there is none."""
        return {exposure.name: exposure for exposure in self.exposures}[name]

    def of_kind(self, kind: Kind) -> tuple[RecordedExposure, ...]:
        """Return the exposures of a kind, in order."""
        return tuple(exposure for exposure in self.exposures if exposure.kind == kind)

    def frame(self, exposure: RecordedExposure, index: int) -> Codes:
        """Return one frame, read from disk now: codes, uint16 (row, column).

        Raises `InputError` naming the file where it is damaged, has changed its size since the
        headers were checked, or holds codes above `white_level`.
        """
        path = exposure.frames[index]
        stored = read_frame(path)
        if stored.shape != (self.rows, self.columns):
            size = " x ".join(map(str, stored.shape))
            fact = f"has {size} pixels, must have {self.rows} x {self.columns} (rows x columns)"
            raise InputError.of(path, "", fact)
        largest = int(stored.max())
        if largest > self.sensor.white_level:
            top = f"{self.sensor.white_level:g}"
            fact = f"holds code {largest}, must hold none above white_level = {top}"
            raise InputError.of(path, "", fact)
        return np.ascontiguousarray(stored, np.uint16)

    def frames(
        self,
        exposure: RecordedExposure,
        which: Sequence[int] | None = None,
        *,
        ahead: int = 0,
        inspection: Inspection | None = None,
    ) -> Iterator[Codes]:
        """Yield the frames of an exposure, each read once: uint16 (row, column).

        Parameters
        ----------
        exposure
            One of `exposures`.
        which
            Numbers of the frames, from 0; None: all.
        ahead
            Threads that read ahead of who consumes (1 suffices mostly); 0: read on demand.
        inspection
            Looks at every frame on its way.
        """

        def read(index: int) -> Codes:
            codes = self.frame(exposure, index)
            if inspection is not None:
                inspection.look(exposure.name, index, codes)
            return codes

        numbers = range(len(exposure.frames)) if which is None else which
        return in_order(read, numbers, ahead)

    def remarks(self, threads: int = 1) -> tuple[str, ...]:
        """Return what a reader of any result must know of these frames; reads each frame once.

        Byte-identical, constant and saturated frames, clipped exposures, single frames, flats as
        dark as the darks, codes that share a factor: nothing of it is refused, all of it limits
        what the recording can show. Frames of exposures that seem to hold copies are read once
        more. See `dsis.recording.hygiene`.
        """
        inspection = Inspection(self.sensor.white_level)
        for exposure in self.exposures:
            for _ in self.frames(exposure, ahead=threads, inspection=inspection):
                pass
        return inspection.remarks(self.exposures, inspection.copies(self))
