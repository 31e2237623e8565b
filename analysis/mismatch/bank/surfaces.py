"""Smooth surfaces of a map: how strong they are, and which way they lean."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import Number, ratio_root
from dsis.measures import Channel
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
LOW = "low order"
_BOWED = 2  # degree of surfaces that bow


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
    order = np.arange(size)[:, None] + np.arange(size)
    share = np.ones_like(coefficients)
    share[:, 0], share[0, :] = square / max(row, square), square / max(column, square)
    power = coefficients**2 * share
    found = {}
    for name, most in (("fixed_smooth_variance", size - 1), (f"fixed_smooth_variance of {LOW}", 2)):
        taken = (order > 0) & (order <= most)
        kinds = int(taken.sum())
        found[name] = ratio_root(float(power[taken].sum()) / kinds / square, kinds, dof)
    return found


def slopes(
    coefficients: Array, squares: tuple[float, float, float], shape: tuple[int, ...]
) -> dict[str, Number]:
    """Return the tilt along each axis and the fall to the corners, each in its own noise.

    Of the same coefficients and squares as `surfaces`; by the shape, rows and columns, a fall with
    the distance from the centre bends along both.
    """
    row, column, square = squares
    if len(coefficients) < 3:
        return {}
    down, across = max(row, square), max(column, square)
    smooth = Smooth.of(shape[0], shape[1])
    # Orthonormal polynomials have any sign: here they rise towards the last line.
    signed = np.outer(np.sign(smooth.along_rows[-1]), np.sign(smooth.along_columns[-1]))
    signed = coefficients * signed[: len(coefficients), : len(coefficients)]
    n, m = float(shape[0]) ** 2, float(shape[1]) ** 2
    fall = n * signed[2, 0] + m * signed[0, 2]
    return {
        "fixed_smooth_tilt of rows": (float(signed[1, 0]) / sqrt(down), 1.0),
        "fixed_smooth_tilt of columns": (float(signed[0, 1]) / sqrt(across), 1.0),
        "fixed_smooth_falloff": (float(fall) / sqrt(n**2 * down + m**2 * across), 1.0),
    }


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
