"""Smooth surfaces of a map: how strong they are, and which way they lean."""

from dataclasses import dataclass
from functools import lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import Number, ratio_root
from dsis.compiled import kernel, pairwise_sum
from dsis.measures import Channel
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
LOW = "low order"
_OF_LOW = f"fixed_smooth_variance of {LOW}"
_BOWED, _OF_RING = 2, 4  # degree of surfaces that bow, and of a ring
RING = "fixed_smooth_ring"
_ROUNDED = 1e-9


def surfaces(
    coefficients: Array, squares: tuple[float, float, float], dof: float
) -> dict[str, Number]:
    """Return the power of smooth surfaces: of all, and of those of second degree at most.

    Parameters
    ----------
    coefficients
        (row degree, column degree), in units of the map's noise.
    squares
        Mean squares of rows, columns and pixels: lines that differ make polynomials along one axis.
    dof
        Of the pixels' mean square.
    """
    row, column, square = squares
    size = len(coefficients)
    shares = square / max(row, square), square / max(column, square)
    found = {}
    for name, most in (("fixed_smooth_variance", size - 1), (_OF_LOW, 2)):
        power, kinds = _power(coefficients, most, *shares)
        found[name] = ratio_root(power / kinds / square, kinds, dof)
    return found


@kernel
def _power(coefficients: Array, most: int, of_rows: float, of_columns: float) -> tuple[float, int]:
    """Return the sum of squares of coefficients of a total degree of 1 to `most`, and their number.

    Of polynomials along rows alone, and along columns alone, a share counts.
    """
    size = len(coefficients)
    squares, count = np.empty(size * size), 0
    for i in range(size):
        for j in range(size):
            if 0 < i + j <= most:
                square = coefficients[i, j] * coefficients[i, j]
                if i == 0:
                    square *= of_columns
                elif j == 0:
                    square *= of_rows
                squares[count] = square
                count += 1
    return pairwise_sum(squares[:count]), count


def slopes(
    coefficients: Array, squares: tuple[float, float, float], shape: tuple[int, ...]
) -> dict[str, Number]:
    """Return the tilt along each axis and the fall to the corners, each in its own noise.

    Of the same coefficients and squares as `surfaces`; by the shape, rows and columns, a fall with
    the distance from the centre bends along both. What is lighter between centre and corner, beside
    all that leans and bows, is a ring: of planes that have polynomials of degree 4.
    """
    row, column, square = squares
    if len(coefficients) < 3:
        return {}
    down, across = max(row, square), max(column, square)
    tilt_down, tilt_across, bow_down, bow_across = (
        sign * float(coefficients[place])
        for sign, place in zip(_rising(shape[0], shape[1]), _LOWEST, strict=True)
    )
    n, m = float(shape[0]) ** 2, float(shape[1]) ** 2
    fall = n * bow_down + m * bow_across
    ring = _ringed(shape[0], shape[1])[: len(coefficients), : len(coefficients)]
    noise = np.full(ring.shape, square)
    noise[:, 0], noise[0] = down, across
    scatter = sqrt(float((ring**2 * noise).sum()))
    return {
        "fixed_smooth_tilt of rows": (tilt_down / sqrt(down), 1.0),
        "fixed_smooth_tilt of columns": (tilt_across / sqrt(across), 1.0),
        "fixed_smooth_falloff": (fall / sqrt(n**2 * down + m**2 * across), 1.0),
        **({RING: (float((ring * coefficients).sum()) / scatter, 1.0)} if scatter else {}),
    }


_LOWEST = ((1, 0), (0, 1), (2, 0), (0, 2))  # degrees of tilts and bows along rows and columns


@lru_cache(maxsize=64)
def _rising(rows: int, columns: int) -> tuple[float, ...]:
    """Return the signs with which polynomials of the degrees `_LOWEST` rise to the last line.

    Orthonormal ones have any.
    """
    smooth = Smooth.of(rows, columns)
    signed = np.outer(np.sign(smooth.along_rows[-1]), np.sign(smooth.along_columns[-1]))
    return tuple(float(signed[place]) for place in _LOWEST)


@lru_cache(maxsize=64)
def _ringed(rows: int, columns: int) -> Array:
    """Return coefficients of a ring's light, s (1 - s), of degree 3 and more: (degree, degree).

    s is the square of the distance from the centre, 1 in the corner.
    """
    y, x = ((np.arange(size) - (size - 1) / 2)[:, np.newaxis] for size in (rows, columns))
    s = (y**2 + x.T**2) / (rows**2 + columns**2) * 4
    found = Smooth.of(rows, columns).coefficients(s * (1 - s))
    order = np.add.outer(np.arange(len(found)), np.arange(len(found)))
    own = np.where((order > _BOWED) & (order <= _OF_RING), found, 0.0)
    own[np.abs(own) < _ROUNDED * np.abs(found).max()] = 0.0
    own.flags.writeable = False
    return own


@dataclass(frozen=True, eq=False)
class Leaning:
    """How one channel of one exposure leans and bows.

    Attributes
    ----------
    coefficients
        Of orthonormal polynomials of the mean frame, of first and second degree: (shape,), DN.
    noise_dn2
        Variance of each, by the temporal noise of the pixels.
    """

    coefficients: Array
    noise_dn2: float


def leaning(channel: Channel, frames: int) -> Leaning:
    """Return how a channel's mean of so many frames leans and bows."""
    mean = channel.mean_frame
    found = Smooth.of(*mean.shape).coefficients(mean)
    order = np.arange(len(found))[:, None] + np.arange(len(found))
    own = found[(order > 0) & (order <= _BOWED)]
    return Leaning(own, channel.estimates["pixel_variance"].value / frames)
