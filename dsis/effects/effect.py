"""What a physical effect is: simulation (`apply`) and evidence (`contributions`) in one value.

An effect is a frozen model whose fields are its parameters, with units in their names, bounds, and
an example of each (`Field(examples=[...])`), strong enough to be measured: the contract test's.
Its stage says where light or charge meets it; the chain of a camera is sorted by (stage, rank):

* LIGHT: what changes the *expected* signal, before shot noise (fixed gain, flicker, shading, dark
  current). The image is the expected signal.
* CHARGE: what happens to collected charge, from shot noise on (crosstalk, saturation, lag).
* READ_OUT: what amplifiers and lines add (read noise, row noise, fixed offsets).
* CODE: what the converter does (unequal code widths, rounding, clipping).

An effect that changes only the *law* of the base noise names that link in `reshapes` and answers
in `reshape`; its `apply` has nothing left to do.

Images are float32, DN above black, a mosaic (row, column) or three full planes (row, column, 3).
Effects of single pixels treat a mosaic as the planes sampled. Effects that couple pixels couple
neighbouring sites of a mosaic, and each of three planes in itself.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.model import Model
from dsis.noise import Segments

Image = NDArray[np.float32]
MOST_DN = 1e12
"""Largest size of an effect, DN or DN/s: beyond every code, and single precision holds it."""


class Stage(IntEnum):
    """Where light, charge or signal meets the effect, in that order."""

    LIGHT = 0
    CHARGE = 1
    READ_OUT = 2
    CODE = 3


@dataclass(frozen=True)
class ReadOut:
    """What an effect may know of the camera.

    Attributes
    ----------
    cfa
        Its colour filter array, also where the image holds full planes.
    segments
        Variance against signal, by read-out segment.
    black_level_dn, white_level_dn
        Code of no light, and the largest code.
    """

    cfa: Cfa
    segments: Segments
    black_level_dn: float
    white_level_dn: float

    @property
    def full_scale_dn(self) -> float:
        """Largest signal above black that has a code, DN."""
        return self.white_level_dn - self.black_level_dn


class Exposure(NamedTuple):
    """What an effect may know of the frame it acts on.

    Attributes
    ----------
    grid
        The pixels that the image holds.
    frame
        Number of the frame, from 0.
    temporal
        Random fields that are new in each frame: draw with `frame`.
    sensor
        Random fields of the sensor, the same in all frames: draw without `frame`.
    expected_dn
        Signal that the light alone would give, DN above black: what selects the read-out segment
        and sets the shot noise. After the LIGHT stage it holds what that stage made of it.
    read_out
        The camera.
    earlier
        `earlier(k)` is the image that enters this effect k frames earlier.
    exposure_time_s
        Exposure time, s.
    threads
        Threads that a kernel may use.
    arriving
        The expected signal as it enters this effect; None: as the light alone gives it. See
        `arriving_dn`.
    """

    grid: PixelGrid
    frame: int
    temporal: Draw
    sensor: Draw
    expected_dn: Image
    read_out: ReadOut
    earlier: Callable[[int], Image]
    exposure_time_s: float = 0.0
    threads: int = 1
    arriving: Callable[[], Image] | None = None

    @property
    def arriving_dn(self) -> Image:
        """The expected signal as it enters the effect: what effects that `respond` make of it."""
        return self.expected_dn if self.arriving is None else self.arriving()


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """A uniformly lit recording of one channel at which contributions are stated.

    Attributes
    ----------
    signal_dn
        Expected signal, DN above black.
    slope_dn, read_variance_dn2
        m and t of the base model at this signal.
    segment
        Number of the read-out segment, from 0.
    full_scale_dn
        Largest signal above black that has a code.
    frames, rows, columns
        Size of the recording.
    exposure_time_s
        Exposure time, s.
    segment_from_dn
        Signal from which on that segment is read, DN above black.
    """

    signal_dn: float
    slope_dn: float
    read_variance_dn2: float
    segment: int
    full_scale_dn: float
    frames: int
    rows: int
    columns: int
    exposure_time_s: float = 0.0
    segment_from_dn: float = 0.0

    @property
    def shot_variance_dn2(self) -> float:
        """Variance of the base model's shot noise, DN^2."""
        return self.slope_dn * max(self.signal_dn, 0.0)

    @property
    def variance_dn2(self) -> float:
        """Temporal variance of a pixel, rounding to whole codes included, DN^2."""
        return self.shot_variance_dn2 + self.read_variance_dn2 + 1 / 12

    def components(
        self, pixel: float, row_mean: float, column_mean: float, frame_mean: float
    ) -> dict[str, float]:
        """Return what variances of pixels and of means over lines and frame are, as components.

        The balanced two-way model's estimates, in expectation, for noise of any covariance in
        space: whatever makes row means vary more than white noise does counts as row variance.
        All in DN^2.
        """
        h, w = self.rows, self.columns
        mean_row = h * w / (h - 1) * (row_mean - frame_mean)
        mean_column = h * w / (w - 1) * (column_mean - frame_mean)
        rest = pixel - row_mean - column_mean + frame_mean
        mean_pixel = h * w / ((h - 1) * (w - 1)) * rest
        mean_frame = h * w * frame_mean
        return {
            "pixel_variance": mean_pixel,
            "row_variance": (mean_row - mean_pixel) / w,
            "column_variance": (mean_column - mean_pixel) / h,
            "frame_variance": (mean_frame - mean_row - mean_column + mean_pixel) / (h * w),
        }

    def coupled(self, covariance_dn2: Mapping[tuple[int, int], float]) -> dict[str, float]:
        """Return the contributions of noise that couples neighbours.

        Parameters
        ----------
        covariance_dn2
            *Change* of the temporal covariance at each lag (row, column) of one half plane, (0, 0)
            included; lags that are left out, and the base noise, have none.
        """
        h, w = self.rows, self.columns
        pixel = row = column = frame = 0.0
        for (dy, dx), c in covariance_dn2.items():
            both = 1 if (dy, dx) == (0, 0) else 2
            pixel += c * (both == 1)
            row += both * c * (w - abs(dx)) / w**2 * (dy == 0)
            column += both * c * (h - abs(dy)) / h**2 * (dx == 0)
            frame += both * c * (h - abs(dy)) * (w - abs(dx)) / (h * w) ** 2
        found = self.components(pixel, row, column, frame)
        total = self.variance_dn2 + found["pixel_variance"]  # what is left beside rows and columns
        for dy, dx in ((0, 1), (1, 0), (1, 1), (0, 2), (2, 0)):
            found[f"correlation_{dy}_{dx}"] = covariance_dn2.get((dy, dx), 0.0) / total
        return found

    def filtered(
        self, variance_dn2: float, kernel: Mapping[tuple[int, int], float]
    ) -> dict[str, float]:
        """Return the contributions of a linear kernel that acts on white noise of a variance.

        Weights by (row, column) from the pixel itself; covariances are the kernel's correlation
        with itself. Pixels at the border, whose neighbours are fewer, count as any other: on 96 x
        64 pixels that is an error of 0.5 % of a correlation for weights of 0.05, 2 % for 0.2.
        """
        change = {(0, 0): -variance_dn2}
        for (y, x), a in kernel.items():
            for (v, u), b in kernel.items():
                lag = (v - y, u - x)
                if lag >= (0, 0):  # one half plane; the other mirrors it
                    change[lag] = change.get(lag, 0.0) + variance_dn2 * a * b
        return self.coupled(change)


class Effect(Model, ABC):
    """One mechanism beyond the base model; subclasses set `kind` and the class attributes.

    Attributes
    ----------
    stage, rank
        Its place in the chain; equal places go by kind.
    reference
        Where it is described.
    measures
        The measures that it may change.
    confounders
        What resembles it, and what tells them apart: one or two sentences.
    reshapes
        Kind of the base link whose deviates it redraws; empty: none.
    grows_with_time
        Whether it needs the exposure time.
    draws
        Whether it draws, or redraws, anything at random; what does not is the same on every sensor.
    looks_back
        Whether it asks for earlier frames: cameras share what others make of the same image.
    responds
        Whether behind the light it is a law of the signal alone, that makes of the expected signal
        what it makes of a frame's, on average: bends it, cuts it, scales it, shares it out.
    """

    kind: str
    stage: ClassVar[Stage]
    rank: ClassVar[int] = 0
    reference: ClassVar[str]
    measures: ClassVar[frozenset[str]]
    confounders: ClassVar[str]
    reshapes: ClassVar[str] = ""
    grows_with_time: ClassVar[bool] = False
    draws: ClassVar[bool] = True
    looks_back: ClassVar[bool] = False
    responds: ClassVar[bool] = False

    @abstractmethod
    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Return what the effect makes of `image`; the given array is left as it is."""

    def reshape(self, deviates: Image, exposure: Exposure) -> Image:
        """Return deviates of mean 0 and variance 1 in the place of standard normal ones.

        Only where `reshapes` names the base link that draws them; `exposure.grid` and
        `exposure.expected_dn` are those of `deviates`.
        """
        del exposure
        return deviates

    @property
    def changes(self) -> frozenset[str]:
        """The measures that this one may change: of `measures`, those of its form."""
        return self.measures

    @property
    def drawn(self) -> bool:
        """Whether this one draws anything at random: as `draws` says, of its form."""
        return self.draws

    @property
    def asks_what_arrives(self) -> bool:
        """Whether it asks for the expected signal as it arrives: it hangs on what responds."""
        return False

    @property
    def exchanges(self) -> bool:
        """Whether neighbouring sites exchange what they hold, as `exchanged` says."""
        return type(self).exchanged is not Effect.exchanged

    def exchanged(self, image: Image) -> Image:
        """Return what becomes of charge that neighbours exchange, nothing else of the effect.

        Of a mosaic's mean charge: the levels that its colours then have.
        """
        return image

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter to this one: the margin a crop needs."""
        return 0

    def unfit_for(self, read_out: ReadOut) -> str:
        """Return why a camera cannot have this effect; empty if it can."""
        del read_out
        return ""

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the effect adds to each measure it names in `measures`, where known.

        Independent additive effects add exactly this; for others it is the leading order, or the
        measure is left out and a prediction needs the simulation.
        """
        del point
        return {}
