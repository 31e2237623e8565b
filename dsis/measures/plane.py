"""The colour channels of a mosaic as planes, and what is summed over each alone."""

from dataclasses import dataclass, field

import numpy as np

from dsis.cfa import Cfa, pattern
from dsis.measures.fixed_pattern import Smooth
from dsis.measures.kernels import Sums

Region = tuple[slice, slice]


@dataclass
class Plane:
    """The pixels of one channel and what is summed over them alone.

    Attributes
    ----------
    name
        MONO, R, Gr (the green of red rows), Gb or B.
    pixels
        Where the channel lies in a frame: rows, columns.
    phases
        Its 2 x 2 phases (row parity, column parity).
    smooth
        Basis of smooth surfaces on the plane.
    power
        Sum of |FFT|^2 of d less its frame mean, half plane of a real transform.
    row_means, column_means, frame_means, surfaces
        One entry per frame, of d: (rows), (columns), scalar, coefficients of the smooth basis.
    pair_squares, pair_means
        Mean of (A - B)^2 and of A - B for the disjoint pairs of consecutive frames.
    """

    name: str
    pixels: Region
    phases: tuple[tuple[int, int], ...]
    smooth: Smooth
    power: Sums
    row_means: list[Sums] = field(default_factory=list)
    column_means: list[Sums] = field(default_factory=list)
    frame_means: list[float] = field(default_factory=list)
    surfaces: list[Sums] = field(default_factory=list)
    pair_squares: list[float] = field(default_factory=list)
    pair_means: list[float] = field(default_factory=list)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the plane."""
        return self.smooth.along_rows.shape[0], self.smooth.along_columns.shape[0]


def planes(cfa: Cfa, region: Region) -> tuple[Plane, ...]:
    """Return one plane per channel; raise ValueError where one has fewer than 2 x 2 pixels."""
    rows, columns = region
    if cfa is Cfa.MONO:
        everything = tuple((y, x) for y in (0, 1) for x in (0, 1))
        return (_plane("MONO", (slice(0, None), slice(0, None)), everything, region),)
    colours = pattern(cfa)
    planes = []
    for y in (0, 1):
        for x in (0, 1):
            row, column = (rows.start + y) % 2, (columns.start + x) % 2
            name = "RGB"[colours[row, column]]
            if name == "G":
                name += "r" if 0 in colours[row] else "b"
            planes.append(_plane(name, (slice(y, None, 2), slice(x, None, 2)), ((y, x),), region))
    return tuple(sorted(planes, key=lambda plane: ("R", "Gr", "Gb", "B").index(plane.name)))


def _plane(name: str, pixels: Region, phases: tuple[tuple[int, int], ...], region: Region) -> Plane:
    n, m = (
        len(range(part.stop - part.start)[inside])
        for part, inside in zip(region, pixels, strict=True)
    )
    if min(n, m) < 2:
        message = f"channel {name} has {n} x {m} pixels, must have at least 2 x 2"
        raise ValueError(message)
    return Plane(name, pixels, phases, Smooth.of(n, m), np.zeros((n, m // 2 + 1)))
