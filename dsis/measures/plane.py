"""The colour channels of a mosaic as planes, and what is summed over planes of one size."""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.cfa import Cfa, pattern
from dsis.measures import kernels
from dsis.measures.fixed_pattern import Smooth
from dsis.measures.kernels import Frame, Sums

Region = tuple[slice, slice]
Transforms = NDArray[np.complex64]


@dataclass(frozen=True)
class Plane:
    """The pixels of one channel.

    Attributes
    ----------
    name
        MONO, R, Gr (the green of red rows), Gb or B.
    start, step
        First row and column in the array that is measured, and the step of both.
    smooth
        Basis of smooth surfaces on the plane.
    """

    name: str
    start: tuple[int, int]
    step: int
    smooth: Smooth

    @property
    def pixels(self) -> Region:
        """Where the channel lies in the array: rows, columns."""
        return slice(self.start[0], None, self.step), slice(self.start[1], None, self.step)

    @property
    def place(self) -> tuple[int, int, int]:
        """First row, first column and step."""
        return *self.start, self.step

    @property
    def phases(self) -> tuple[tuple[int, int], ...]:
        """Its 2 x 2 phases (row parity, column parity)."""
        if self.step == 1:
            return ((0, 0), (0, 1), (1, 0), (1, 1))
        return (self.start,)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the plane."""
        return self.smooth.along_rows.shape[0], self.smooth.along_columns.shape[0]


@dataclass
class Sheets:
    """Planes of one size and their sums over frames.

    Attributes
    ----------
    planes
        The planes.
    places
        First row, first column and step of each: (plane, 3).
    power
        Sum of |FFT|^2 of d less its frame mean: (plane, row, columns // 2 + 1).
    surfaces
        Of each frame, coefficients of the smooth basis: (plane, row degree, column degree).
    images
        d less its frame mean, of the last frame: (plane, row, column).
    """

    planes: tuple[Plane, ...]
    places: NDArray[np.int64]
    power: Sums
    images: Frame
    surfaces: list[Sums] = field(default_factory=list)

    @classmethod
    def of(cls, planes: tuple[Plane, ...]) -> "Sheets":
        """Return the sums of planes of one size, before the first frame."""
        n, m = planes[0].shape
        places = np.array([plane.place for plane in planes])
        power = np.zeros((len(planes), n, m // 2 + 1))
        return cls(planes, places, power, np.empty((len(planes), n, m), np.float32))

    def lines(self, row_sums: Sums, column_sums: Sums) -> tuple[Sums, Sums]:
        """Return the means of rows (plane, frame, row) and of columns (plane, frame, column).

        Sums are those of each frame: (frame, row, column parity), (frame, row parity, column).
        """
        _, n, m = self.images.shape
        if self.planes[0].step == 1:
            return row_sums.sum(2)[None] / m, column_sums.sum(1)[None] / n
        starts = [plane.start for plane in self.planes]
        rows = np.array([row_sums[:, y::2, x] for y, x in starts])
        columns = np.array([column_sums[:, y, x::2] for y, x in starts])
        return rows / m, columns / n

    def start(self) -> None:
        """Take the first frame: it differs from itself by nothing."""
        size = self.planes[0].smooth.degree + 1
        self.surfaces.append(np.zeros((len(self.planes), size, size)))

    def add(self, difference: Frame, means: Sums) -> None:
        """Take a further frame, less the mean of each phase (2, 2)."""
        kernels.split(difference, self.places, means, self.images)
        self.surfaces.append(self.planes[0].smooth.coefficients(self.images))

    def transformed(self, threads: int) -> Transforms:
        """Take the power of the last frame; return its transforms."""
        transforms: Transforms = scipy.fft.rfft2(self.images, workers=threads)
        kernels.add_power(transforms, self.power)
        return transforms


def planes(cfa: Cfa, region: Region) -> tuple[Plane, ...]:
    """Return one plane per channel; raise ValueError where one has fewer than 2 x 2 pixels."""
    starts = region[0].start % 2, region[1].start % 2
    return _planes(cfa, starts, tuple(part.stop - part.start for part in region))


@lru_cache(maxsize=32)
def _planes(cfa: Cfa, starts: tuple[int, int], shape: tuple[int, ...]) -> tuple[Plane, ...]:
    """Return the planes of an array of a shape, whose first row and column have a parity each."""
    rows, columns = shape
    if cfa is Cfa.MONO:
        return (_plane("MONO", (0, 0), 1, (rows, columns)),)
    colours = pattern(cfa)
    found = []
    for y in (0, 1):
        for x in (0, 1):
            row, column = (starts[0] + y) % 2, (starts[1] + x) % 2
            name = "RGB"[colours[row, column]]
            if name == "G":
                name += "r" if 0 in colours[row] else "b"
            found.append(_plane(name, (y, x), 2, ((rows + 1 - y) // 2, (columns + 1 - x) // 2)))
    return tuple(sorted(found, key=lambda plane: ("R", "Gr", "Gb", "B").index(plane.name)))


def sheets(planes: tuple[Plane, ...]) -> tuple[Sheets, ...]:
    """Return the planes by their size."""
    by_shape: dict[tuple[int, int], list[Plane]] = {}
    for plane in planes:
        by_shape.setdefault(plane.shape, []).append(plane)
    return tuple(Sheets.of(tuple(alike)) for alike in by_shape.values())


def _plane(name: str, start: tuple[int, int], step: int, shape: tuple[int, int]) -> Plane:
    n, m = shape
    if min(n, m) < 2:
        message = f"channel {name} has {n} x {m} pixels, must have at least 2 x 2"
        raise ValueError(message)
    return Plane(name, start, step, Smooth.of(n, m))
