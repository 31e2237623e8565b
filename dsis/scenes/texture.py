"""Procedural texture: smooth functions of position that have no grain at any resolution.

A surface is a function of world coordinates, so it looks alike at every resolution. Functions take
the footprint (the width of a pixel on the surface) and fade out what is finer than that: filtering
before sampling, so that nothing twinkles when the picture moves.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

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
        rng = np.random.Generator(np.random.PCG64(seed))
        return cls(2 * rng.random(CELLS * CELLS, np.float32) - 1)

    def cell(self, u: Field, v: Field, salt: int = 0) -> Field:
        """Return one number in -1..1 for every unit cell: what differs from pane to pane."""
        i, j = np.floor(u).astype(np.int32), np.floor(v).astype(np.int32)
        return self._at(i + 7 * salt, j + 91 * salt)

    def value(self, u: Field, v: Field) -> Field:
        """Return smooth noise in -1..1 with features one unit wide; u and v broadcast."""
        i, j = np.floor(u), np.floor(v)
        s, t = u - i, v - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
        i, j = i.astype(np.int32), j.astype(np.int32)
        low, high = self._at(i, j), self._at(i, j + 1)
        low += s * (self._at(i + 1, j) - low)
        high += s * (self._at(i + 1, j + 1) - high)
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
            Width of a pixel in the same unit; octaves finer than two pixels fade out.
        """
        total: Field = np.zeros(np.broadcast_shapes(u.shape, v.shape), np.float32)
        weight, width = 1.0, np.asarray(footprint, np.float32)
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


def pulse(u: Field, duty: float, footprint: Field | float) -> Field:
    """Return the coverage 0..1 by bars of width `duty` in the middle of every unit cell.

    Edges are as soft as the footprint (in cells); bars finer than a pixel become their mean.
    """
    width = np.asarray(footprint, np.float32)
    inside = duty / 2 - np.abs(u - np.floor(u) - 0.5)
    sharp = np.clip(inside / np.maximum(width, 1e-3) + 0.5, 0, 1)
    covered: Field = sharp + np.clip(2 * width - 0.6, 0, 1) * (duty - sharp)
    return covered


def step(x: Field, low: float, high: float) -> Field:
    """Return 0 below `low`, 1 above `high` (either may be the larger), smooth between them."""
    t = np.clip((x - low) / (high - low), 0, 1)
    smooth: Field = t * t * (3 - 2 * t)
    return smooth
