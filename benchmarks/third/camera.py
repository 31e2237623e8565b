"""A camera and the plan of its recording, as plain values."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


@dataclass(frozen=True)
class Exposure:
    """A row of equal frames: signal of green above black, light in the laboratory's own unit."""

    name: str
    kind: str
    signal_dn: float
    time_s: float
    light: float | None
    frames: int


@dataclass(frozen=True)
class Path:
    """A read-out path: its noise has the variance slope x signal + intercept."""

    slope: float
    intercept: float


@dataclass(frozen=True)
class Camera:
    """What is true of a camera; camera.toml may say something else.

    Attributes
    ----------
    response
        Response of the four sites of a mosaic, 2 x 2; ones for a camera without colours.
    high, switch_dn
        The second read-out path and the signal at which it takes over.
    timed
        Levels differ in exposure time; else in illumination.
    light_known
        recording.toml says how much light there was.
    scene_light
        The light of the scene, relative to its brightest place.
    """

    rows: int
    columns: int
    cfa: str
    bits: int
    black: float
    low: Path
    high: Path | None
    switch_dn: float | None
    shot: str
    response: Array
    spacing: str
    timed: bool
    light_known: bool
    exposures: tuple[Exposure, ...]
    scene_light: Array | None

    @property
    def white(self) -> int:
        """Largest code."""
        return int(2**self.bits - 1)

    @property
    def full(self) -> float:
        """Largest signal above black that has a code."""
        return self.white - self.black

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return self.rows * self.columns

    @property
    def mosaic(self) -> bool:
        """Whether it sees colours."""
        return self.cfa != "MONO"

    def count(self, kind: str) -> int:
        """Return the number of exposures of a kind."""
        return sum(exposure.kind == kind for exposure in self.exposures)

    def path_at(self, signal_dn: float) -> Path:
        """Return the path that reads a signal."""
        above = self.switch_dn is not None and signal_dn >= self.switch_dn
        return self.high if above and self.high is not None else self.low

    def grid(self) -> Array:
        """Return the rows and columns of all pixels."""
        return np.mgrid[0 : self.rows, 0 : self.columns].astype(np.float32)
