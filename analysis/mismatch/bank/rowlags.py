"""How alike the means of rows are that lie some rows apart: of rows that share their offsets."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number

Array = NDArray[np.float64]
ROW_LAGS = (1, 2, 4, 8)


def row_lags(power: Array, degrees: float) -> dict[str, Number]:
    """Return the correlations of row means by lag, from their temporal power.

    Parameters
    ----------
    power
        On half bins, of any unit: the squared transform of rows beside as many zeros, which holds
        the products of rows at every lag (Wiener and Khinchin), none around the frame's ends.
    degrees
        Independent frames in it.
    """
    rows = power.size - 1
    products = np.fft.irfft(power, 2 * rows)
    found = {}
    for lag in ROW_LAGS:
        pairs = rows - lag
        known = pairs > lag and products[0] > 0 and degrees > 0
        found[f"row_correlation of lag {lag}"] = (
            (float(products[lag] / products[0] * rows / pairs), 1 / sqrt(degrees * pairs))
            if known
            else UNKNOWN
        )
    return found
