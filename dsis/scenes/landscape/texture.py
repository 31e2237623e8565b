"""Smooth noise on arrays, for the relief: octaves that fade out where the grid is coarser."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.grid import PixelGrid

Field = NDArray[np.floating[Any]]  # float32; for the stubs, times a Python float is float64
CELLS = 256  # the lattice repeats after this many cells, in both directions


@dataclass(frozen=True)
class Texture:
    """Value noise: a lattice of random numbers, smoothly interpolated.

    Attributes
    ----------
    lattice
        float32 (CELLS * CELLS,), uniform in -1..1.
    """

    lattice: Field

    @classmethod
    def of(cls, seed: int) -> Self:
        """Draw the lattice from a seed."""
        draw = Draw(seed, ("scenes", "relief"))
        return cls(2 * draw.uniform("lattice", PixelGrid(CELLS, CELLS, Cfa.MONO, 0, 0)).ravel() - 1)

    def value(self, u: Field, v: Field) -> Field:
        """Return smooth noise in -1..1 with features one unit wide; u and v broadcast."""
        i, j = np.floor(u), np.floor(v)
        s, t = u - i, v - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
        i, j = i.astype(np.int32), j.astype(np.int32)
        low, high = self._at(i, j), self._at(i, j + 1)
        low = low + s * (self._at(i + 1, j) - low)
        high = high + s * (self._at(i + 1, j + 1) - high)
        blended: Field = low + t * (high - low)
        return blended

    def fractal(self, u: Field, v: Field, octaves: int, footprint: Field | float = 0.0) -> Field:
        """Return a sum of octaves, each twice as fine, .55 as strong, and turned by 37 degrees.

        Parameters
        ----------
        u, v
            Position; the coarsest features are one unit wide.
        octaves
            Number of octaves.
        footprint
            Spacing of the points in the same unit; octaves finer than two of them fade out.
        """
        total: Field = np.zeros(np.broadcast_shapes(u.shape, v.shape))
        weight, width = 1.0, np.asarray(footprint)
        for octave in range(octaves):
            keep = np.clip(2 - 4 * 2**octave * width, 0, 1)
            if not keep.any():
                break
            total += weight * keep * self.value(u, v)
            u, v = 1.6 * u - 1.2 * v + 31.7, 1.2 * u + 1.6 * v + 17.3
            weight *= 0.55
        return total

    def _at(self, i: NDArray[np.int32], j: NDArray[np.int32]) -> Field:
        found: Field = self.lattice.take(((j & (CELLS - 1)) << 8) + (i & (CELLS - 1)))
        return found


def ramp(x: Field, low: float, high: float) -> Field:
    """Return 0 below `low`, 1 above `high` (either may be the larger), smooth between them."""
    t = np.clip((x - low) / (high - low), 0, 1)
    smooth: Field = t * t * (3 - 2 * t)
    return smooth
