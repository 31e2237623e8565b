"""Shading of a gain map: the fall-off from the centre to the corners that the vocabulary has."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.parts import Pattern

Floats = NDArray[np.float64]

LEAST_LINES = 32  # of a plane: fewer do not tell a bend from what rows differ by
LEAST_SHARE = 0.5  # of the smooth pattern, below which this fall-off does not describe it
_LEAST_Z = 4.0  # rows and columns are few: 3 would be passed once in 100 sensors


def falloff(
    planes: Sequence[tuple[Floats, Pattern]],
    sites: Sequence[tuple[slice, slice]],
    shape: tuple[int, int],
) -> tuple[float, float] | None:
    """Return f of 1 - f r^2 / R^2 and its standard error; None where it is not seen.

    Parameters
    ----------
    planes
        Gain relative to the mean of each channel, (row, column), and its parts.
    sites
        Where each channel lies in a frame.
    shape
        Rows and columns of a frame; R is the distance from its centre to a corner.
    """
    found, errors, explained, smooth = [], [], 0.0, 0.0
    rows, columns = shape
    squared = (rows / 2) ** 2 + (columns / 2) ** 2
    for (gain, pattern), (down, across) in zip(planes, sites, strict=True):
        if min(gain.shape) < LEAST_LINES:
            return None
        y = (np.arange(rows)[down] - (rows - 1) / 2) ** 2 / squared
        x = (np.arange(columns)[across] - (columns - 1) / 2) ** 2 / squared
        mean = float(y.mean() + x.mean())
        y, x = y - y.mean(), x - x.mean()
        by_row, by_column = x.size * float(y @ y), y.size * float(x @ x)
        product = x.size * float(gain.mean(1) @ y) + y.size * float(gain.mean(0) @ x)
        slope = product / (by_row + by_column)
        variance = by_row * pattern.row.square + by_column * pattern.column.square
        # gain = (1 - f s) / (1 - f mean), slope its derivative by s = r^2 / R^2.
        found.append(-slope / (1 - slope * mean))
        errors.append(np.sqrt(variance) / (by_row + by_column) / (1 - slope * mean) ** 2)
        explained += slope * product / gain.size
        smooth += pattern.smooth.variance
    value = float(np.mean(found))
    # Colours share the light that falls off, rows and columns too: their errors do not average out.
    error = float(np.mean(errors))
    if not _LEAST_Z * error < value <= 1 or explained < LEAST_SHARE * smooth:
        return None
    return value, error
