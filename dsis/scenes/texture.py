"""Procedural surface texture: smooth functions of position that have no grain at any size.

Everything is a function of world coordinates, so the same surface looks alike at every resolution,
and every function takes its footprint (the width of a pixel on the surface) and fades out what
would be finer than that: box filtering before sampling, the painter's cure for aliasing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float32]
CELLS = 256  # the lattice repeats after this many cells, in both directions


@dataclass(frozen=True)
class Texture:
    """Value noise on a lattice of random numbers drawn once from a seed.

    Attributes
    ----------
    lattice
        float32 (CELLS * CELLS,), uniform in -1..1.
    """

    lattice: Field

    @classmethod
    def of(cls, rng: np.random.Generator) -> "Texture":
        """Draw the lattice."""
        return cls((2 * rng.random(CELLS * CELLS) - 1).astype(np.float32))

    def cell(self, u: Field, v: Field, salt: int = 0) -> Field:
        """Return one number in -1..1 per unit cell: constant over windows, fields, panes."""
        i, j = np.floor(u).astype(np.int32), np.floor(v).astype(np.int32)
        return self._at(i + 7 * salt, j + 91 * salt)

    def value(self, u: Field, v: Field) -> Field:
        """Return smooth noise in -1..1 whose features are one unit wide; (u, v) broadcast."""
        i, j = np.floor(u), np.floor(v)
        s, t = u - i, v - j
        s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
        i, j = i.astype(np.int32), j.astype(np.int32)
        near, far = self._at(i, j), self._at(i, j + 1)
        near += s * (self._at(i + 1, j) - near)
        far += s * (self._at(i + 1, j + 1) - far)
        blended: Field = near + t * (far - near)
        return blended

    def fractal(self, u: Field, v: Field, octaves: int, footprint: Field | float = 0.0) -> Field:
        """Return a sum of octaves, each twice as fine, turned by 37 degrees, .55 as strong.

        Parameters
        ----------
        u, v
            Position; the coarsest features are one unit wide.
        octaves
            Number of octaves.
        footprint
            Width of a pixel in the same unit; an octave finer than two pixels is left out, softly.
        """
        total: Field = np.float32(0) * (u + v)
        weight = 1.0
        for octave in range(octaves):
            keep = np.clip(2 - 4 * np.float32(2**octave) * footprint, 0, 1)
            if not np.any(keep):
                break
            total += weight * keep * self.value(u, v)
            u, v = 1.6 * u - 1.2 * v + 31.7, 1.2 * u + 1.6 * v + 17.3
            weight *= 0.55
        return total

    def _at(self, i: NDArray[np.int32], j: NDArray[np.int32]) -> Field:
        found: Field = self.lattice.take(((j & (CELLS - 1)) << 8) + (i & (CELLS - 1)))
        return found


def pulse(u: Field, duty: float, footprint: Field | float) -> Field:
    """Return the coverage 0..1 of bars of width `duty` in the middle of every unit cell.

    The edges are as soft as the footprint (in cells); bars finer than a pixel become their mean.
    """
    edge = np.float32(duty / 2) - np.abs(u - np.floor(u) - np.float32(0.5))
    sharp = np.clip(edge / np.maximum(footprint, 1e-3) + 0.5, 0, 1)
    mean = np.clip(2 * np.asarray(footprint, np.float32) - 0.6, 0, 1)
    covered: Field = sharp + mean * (np.float32(duty) - sharp)
    return covered


def step(x: Field, low: float, high: float) -> Field:
    """Return 0 below `low`, 1 above `high`, smooth between them."""
    t = np.clip((x - np.float32(low)) / np.float32(high - low), 0, 1)
    smooth: Field = t * t * (3 - 2 * t)
    return smooth
