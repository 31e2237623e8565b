"""One frame as the mechanisms see it, and its keyed random generators."""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planter.case import Case, Plan, Segment

Image = np.ndarray  # float32 (row, column), DN
Mechanism = Callable[[Image, Mapping[str, Any], "View"], Image]


@dataclass(frozen=True)
class View:
    """Frame `frame` of exposure number `exposure`; frame -1 is the one before the first.

    `expected` is the signal without noise, DN above black; set once light has been collected.
    """

    case: Case
    exposure: int
    frame: int
    expected: Image | None = None

    @property
    def plan(self) -> Plan:
        """The exposure."""
        return self.case.exposures[self.exposure]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.case.rows, self.case.columns

    def fresh(self, purpose: str) -> np.random.Generator:
        """Return the generator of what is new in this frame."""
        return _keyed(self.case.seed, purpose, self.exposure, self.frame + 1)

    def of_exposure(self, purpose: str) -> np.random.Generator:
        """Return the generator of what develops over this exposure's frames."""
        return _keyed(self.case.seed, purpose, self.exposure)

    def of_sensor(self, purpose: str) -> np.random.Generator:
        """Return the generator of what is fixed in the sensor."""
        return _keyed(self.case.sensor_seed, purpose)

    def segment_map(self, value: Callable[[Segment], float]) -> Image:
        """Return a property of the read-out path that each pixel's expected signal selects."""
        segments = self.case.true_segments
        image = np.full(self.shape, value(segments[-1]), np.float32)
        for segment in reversed(segments[:-1]):
            image[self.expected < segment.upper_dn] = value(segment)
        return image


def normal(rng: np.random.Generator, shape: tuple[int, ...]) -> Image:
    """Return standard normal deviates, float32."""
    return rng.standard_normal(shape, dtype=np.float32)


def _keyed(seed: int, purpose: str, *numbers: int) -> np.random.Generator:
    key = np.random.SeedSequence([seed, zlib.crc32(purpose.encode()), *numbers])
    return np.random.Generator(np.random.SFC64(key))
