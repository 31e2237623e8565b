"""Where the light of a content comes from: a window over a panorama or still, or a sequence.

Every source gives linear scene light at the sensor's pixels, after the optics, noise-free as far as
the footage is. Sources may be larger than the sensor by a whole factor (oversampling).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.color import DisplayTransform
from dsis.imagefile import info, read
from dsis.optics import Optics, through_optics
from dsis.scenes import FEWEST_ROWS, panorama
from dsis.spec import Content, Footage, Sequence, Test

Light = NDArray[np.float32]

_CONTEXT_PX = 64  # sensor pixels beside the window that a fractional shift sees


class Source(ABC):
    """Linear scene light of one content, frame by frame."""

    @abstractmethod
    def light(self, frame: int) -> Light:
        """Return frame `frame` (from 0): float32 (row, column, 3), linear, 1 diffuse white."""


class Window(Source):
    """A window that slides to the right over one still image.

    Speeds of whole fine pixels are exact slices of one picture that has passed the optics; others
    shift it by a phase ramp in the same Fourier step.
    """

    def __init__(
        self, image: Light, optics: Optics, sequence: Sequence, scale: int, pan_px_per_frame: float
    ) -> None:
        self.optics, self.sequence, self.scale = optics, sequence, scale
        self.step = scale * pan_px_per_frame
        self.whole = self.step == round(self.step)
        self.image = through_optics(image, optics, scale) if self.whole else image
        spare = image.shape[0] - scale * sequence.height
        self.first_row = spare // 2
        travel = abs(self.step) * (sequence.frames - 1)
        self.start = (image.shape[1] - scale * sequence.width - travel) / 2
        self.start = np.floor(self.start) + (travel if self.step < 0 else 0.0)

    def light(self, frame: int) -> Light:
        """Return the window's light in frame `frame`."""
        place = self.start + self.step * frame
        column = int(np.floor(place))
        if self.whole:
            return self._sampled(self.image, self.first_row, column)
        margin = _CONTEXT_PX * self.scale
        left = max(0, column - margin)
        right = min(self.image.shape[1], column + self.scale * self.sequence.width + margin)
        shift = (0.0, -(place - column) / self.scale)
        seen = through_optics(self.image[:, left:right], self.optics, self.scale, shift_px=shift)
        return self._sampled(seen, self.first_row, column - left)

    def _sampled(self, image: Light, row: int, column: int) -> Light:
        s, size = self.scale, self.sequence
        window = image[row : row + s * size.height : s, column : column + s * size.width : s]
        return np.ascontiguousarray(window)


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
    if content.scene is not None:
        travel = int(np.ceil(abs(content.pan_px_per_frame) * (size.frames - 1)))
        rows = max(FEWEST_ROWS, scale * size.height)  # of which the window shows the middle
        image = panorama(content.scene, content.scene_seed, rows, scale * (size.width + travel))
        light = transform.scene_from_linear_rec709(image)
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
