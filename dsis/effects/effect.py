"""What a physical effect is: simulation (`apply`) and evidence (`contributions`) in one value.

An effect is a frozen model whose fields are its parameters, with units in their names, bounds, and
an example of each (`Field(examples=[...])`), strong enough to be measured: the contract test's.
Its stage says where light or charge meets it; the chain of a camera is sorted by (stage, rank):

* LIGHT: what changes the *expected* signal, before shot noise (fixed gain, flicker, shading, dark
  current). The image is the expected signal.
* CHARGE: what happens to collected charge, from shot noise on (crosstalk, saturation, lag).
* READ_OUT: what amplifiers and lines add (read noise, row noise, fixed offsets).
* CODE: what the converter does (unequal code widths, rounding, clipping).

Images are float32, DN above black, a mosaic (row, column) or three full planes (row, column, 3).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.model import Model

Image = NDArray[np.float32]


class Stage(IntEnum):
    """Where light, charge or signal meets the effect, in that order."""

    LIGHT = 0
    CHARGE = 1
    READ_OUT = 2
    CODE = 3


@dataclass(frozen=True)
class Exposure:
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
    exposure_time_s
        Exposure time, s; 0 where it is unknown.
    threads
        Threads that a kernel may use.
    """

    grid: PixelGrid
    frame: int
    temporal: Draw
    sensor: Draw
    expected_dn: Image
    exposure_time_s: float = 0.0
    threads: int = 1


@dataclass(frozen=True)
class OperatingPoint:
    """A uniformly lit recording at which contributions are stated.

    Attributes
    ----------
    signal_dn
        Expected signal, DN above black.
    exposure_time_s
        Exposure time, s.
    """

    signal_dn: float
    exposure_time_s: float = 0.0


class Effect(Model, ABC):
    """One mechanism beyond the base model; subclasses set `kind`, `stage` and `reference`."""

    kind: str
    stage: ClassVar[Stage]
    rank: ClassVar[int] = 0
    reference: ClassVar[str]
    measures: ClassVar[frozenset[str]]

    @abstractmethod
    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Return what the effect makes of `image`; the given array is left as it is."""

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the effect adds to each measure it names in `measures`, where known.

        Independent additive effects add exactly this; for others it is the leading order, or the
        measure is left out and a prediction needs the simulation.
        """
        del point
        return {}
