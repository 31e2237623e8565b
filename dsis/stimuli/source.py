"""Where the light of a content comes from: a window over a panorama or still, or a sequence.

Every source gives linear scene light at the sensor's pixels, after the optics, noise-free as far as
the footage is. Sources may be larger than the sensor by a whole factor (oversampling).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dsis.color import DisplayTransform
from dsis.imagefile import info, read
from dsis.optics import Optics, Pan, through_optics
from dsis.scenes import panorama
from dsis.spec import Content, Footage, Sequence, Test
from dsis.stimuli.panoramas import strip_of

Light = NDArray[np.float32]


class Source(ABC):
    """Linear scene light of one content, frame by frame."""

    @abstractmethod
    def light(self, frame: int) -> Light:
        """Return frame `frame` (from 0): float32 (row, column, 3), linear, 1 diffuse white."""


class Slid(Protocol):
    """Light after the optics in the sensor's rows, seen through a window."""

    def window(self, column: float, rows: int, columns: int) -> Light:
        """Return (rows, columns, 3), the first column at `column` of the finer grid."""
        ...


@dataclass(frozen=True)
class Slices:
    """A window at whole fine columns: exact, for nothing is computed.

    Attributes
    ----------
    light
        After the optics, float32 (row of the sensor, fine column, 3).
    step
        Fine columns per column of the sensor.
    """

    light: Light
    step: int

    def window(self, column: float, rows: int, columns: int) -> Light:
        """Return a copy of the columns from `column` on, which is a whole number."""
        first = int(column)
        return np.ascontiguousarray(
            self.light[:rows, first : first + self.step * columns : self.step]
        )


class Window(Source):
    """A window that slides to the right over one still image.

    The picture passes the optics once. Speeds of whole fine pixels are exact slices of it; others
    add a phase ramp to its spectrum.
    """

    def __init__(
        self, image: Light, optics: Optics, sequence: Sequence, scale: int, pan_px_per_frame: float
    ) -> None:
        self.sequence = sequence
        self.step = scale * pan_px_per_frame
        first_row = (image.shape[0] - scale * sequence.height) // 2
        travel = abs(self.step) * (sequence.frames - 1)
        self.start = np.floor((image.shape[1] - scale * sequence.width - travel) / 2)
        self.start += travel if self.step < 0 else 0.0
        self.slid: Slid
        if self.step == round(self.step):
            rows = slice(first_row, first_row + scale * sequence.height, scale)
            self.slid = Slices(through_optics(image, optics, scale)[rows].copy(), scale)
        else:
            self.slid = Pan.of(image, optics, scale, first_row=first_row)

    def light(self, frame: int) -> Light:
        """Return the window's light in frame `frame`."""
        place = float(self.start + self.step * frame)
        return self.slid.window(place, self.sequence.height, self.sequence.width)


class Numbered(Source):
    """A numbered sequence: one file per frame, centred on the sensor."""

    def __init__(
        self,
        paths: tuple[Path, ...],
        linear: Callable[[Light], Light],
        optics: Optics,
        sequence: Sequence,
        scale: int,
    ) -> None:
        self.paths, self.linear, self.optics = paths, linear, optics
        self.sequence, self.scale = sequence, scale

    def light(self, frame: int) -> Light:
        """Return the light of file number `frame`."""
        image = self.linear(read(self.paths[frame]))
        return Window(image, self.optics, self.sequence, self.scale, 0.0).light(0)


def source_of(content: Content, test: Test, transform: DisplayTransform) -> Source:
    """Return the source of a content of a test."""
    spec = test.spec
    size, scale = spec.sequence, content.scale
    strip = strip_of(content, size)
    if strip is not None:
        light = transform.scene_from_linear_rec709(panorama(strip))
        return Window(light, spec.optics, size, scale, content.pan_px_per_frame)
    footage = test.footage[content.name or ""]
    linear = _as_they_are if is_linear(content, footage) else transform.scene_from_display
    if footage.still:
        image = linear(read(footage.paths[0]))
        return Window(image, spec.optics, size, scale, content.pan_px_per_frame)
    return Numbered(footage.paths, linear, spec.optics, size, scale)


def is_linear(content: Content, footage: Footage) -> bool:
    """Tell whether files hold linear light: as the spec says, else floating-point files do."""
    if content.encoding is not None:
        return content.encoding == "linear"
    return info(footage.paths[0]).floating


def remarks_on(content: Content, test: Test) -> tuple[str, ...]:
    """Return what a reader of the results must know of a content's footage."""
    footage = test.footage.get(content.name or "")
    if footage is None or is_linear(content, footage):
        return ()
    says = "not noise-free, display-referred: the footage carries noise and rendering of its own, "
    says += "so the reference is not noise-free and linear light is an inversion of the view"
    return (f"{content.name}: {says}",)


def _as_they_are(image: Light) -> Light:
    return image
