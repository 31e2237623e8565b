"""How alike the means of lines are that lie some lines apart: of lines that share offsets."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.linemeans import Axis
from analysis.mismatch.bank.scalars import UNKNOWN, Number

Array = NDArray[np.float64]
LINE_LAGS = (1, 2, 4, 8)


def line_lags(power: Array, degrees: float, axis: Axis) -> dict[str, Number]:
    """Return the correlations of means of rows or columns by lag, from their temporal power.

    Parameters
    ----------
    power
        On half bins, of any unit: the squared transform of lines beside as many zeros, which holds
        the products of lines at every lag (Wiener and Khinchin), none around the frame's ends.
    degrees
        Independent frames in it.
    axis
        Whose lines they are.
    """
    lines = power.size - 1
    products = np.fft.irfft(power, 2 * lines)
    found = {}
    for lag in LINE_LAGS:
        pairs = lines - lag
        known = pairs > lag and products[0] > 0 and degrees > 0
        found[f"{axis}_correlation of lag {lag}"] = (
            (float(products[lag] / products[0] * lines / pairs), 1 / sqrt(degrees * pairs))
            if known
            else UNKNOWN
        )
    return found
