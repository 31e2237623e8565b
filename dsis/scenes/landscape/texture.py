"""Smooth noise on arrays, for the relief: octaves that fade out where the grid is coarser."""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.compiled import kernel
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

    lattice: NDArray[np.float32]

    @classmethod
    def of(cls, seed: int) -> Self:
        """Draw the lattice from a seed."""
        draw = Draw(seed, ("scenes", "relief"))
        lattice = draw.uniform("lattice", PixelGrid(CELLS, CELLS, Cfa.MONO, 0, 0)).ravel()
        return cls((2 * lattice - 1).astype(np.float32))

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
        total = np.empty(np.broadcast_shapes(u.shape, v.shape))
        x, y, gap = (
            np.broadcast_to(np.asarray(a, np.float64), total.shape).ravel()
            for a in (u, v, footprint)
        )
        _add_octaves(total.reshape(-1), self.lattice, x, y, gap, octaves)
        return total


@kernel
def _value(lattice: NDArray[np.float32], u: float, v: float) -> float:
    """Return smooth noise in -1..1 with features one unit wide."""
    i, j = math.floor(u), math.floor(v)
    s, t = u - i, v - j
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    left, right = i & (CELLS - 1), (i + 1) & (CELLS - 1)
    row, below = (j & (CELLS - 1)) * CELLS, ((j + 1) & (CELLS - 1)) * CELLS
    low = lattice[row + left] + s * (lattice[row + right] - lattice[row + left])
    high = lattice[below + left] + s * (lattice[below + right] - lattice[below + left])
    return float(low + t * (high - low))


@kernel
def _add_octaves(
    total: NDArray[np.float64],
    lattice: NDArray[np.float32],
    u: NDArray[np.float64],
    v: NDArray[np.float64],
    footprint: NDArray[np.float64],
    octaves: int,
) -> None:
    """Write the sum for each of the points (point,)."""
    for n in range(total.size):
        x, y, weight, width = u[n], v[n], 1.0, footprint[n]
        total[n] = 0.0
        for _ in range(octaves):
            keep = min(max(2.0 - 4.0 * width, 0.0), 1.0)
            if keep == 0.0:
                break
            total[n] += weight * keep * _value(lattice, x, y)
            x, y = 1.6 * x - 1.2 * y + 31.7, 1.2 * x + 1.6 * y + 17.3
            weight *= 0.55
            width *= 2.0


def ramp(x: Field, low: float, high: float) -> Field:
    """Return 0 below `low`, 1 above `high` (either may be the larger), smooth between them."""
    t = np.clip((x - low) / (high - low), 0, 1)
    smooth: Field = t * t * (3 - 2 * t)
    return smooth
