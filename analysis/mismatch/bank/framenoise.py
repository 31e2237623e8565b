"""Whether frames of one exposure are equally noisy: the variances of their pairs compared.

A sensor that warms, a supply that is noisy for a while, a burst in one frame: the variance of all
frames together does not show them.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, pairwise_sum
from dsis.measures import Channel

Array = NDArray[np.float64]
NAME = "frame_noise"


def unequal_noise(channel: Channel) -> tuple[float, int]:
    """Return how far variances of disjoint pairs of frames scatter, and degrees of freedom of that.

    Of single pixels, beyond what rows, columns and frames have in common. The variance of a pair
    of n degrees of freedom scatters by 2 / n of its square: that is 1. None, of no degree, with
    fewer than two pairs.
    """
    n, m = channel.mean_frame.shape
    squares = np.array(channel.pair_variance.squares)
    if len(squares) < 2:
        return np.nan, 0
    means = channel.row_means, channel.column_means, channel.frame_means
    return _scatter(squares, *means) * (n - 1) * (m - 1) / 2, len(squares) - 1


@kernel
def _scatter(squares: Array, rows: Array, columns: Array, frames: Array) -> float:
    """Return the relative variance of what lines and frames leave of mean squares of differences.

    `squares`: of disjoint pairs of successive frames; the means are of (frame, row), (frame,
    column) and (frame).
    """
    left = np.empty(squares.size)
    for p in range(squares.size):
        one, two = 2 * p, 2 * p + 1
        of_rows = of_columns = 0.0
        for y in range(rows.shape[1]):
            moved = rows[two, y] - rows[one, y]
            of_rows += moved * moved
        for x in range(columns.shape[1]):
            moved = columns[two, x] - columns[one, x]
            of_columns += moved * moved
        whole = frames[two] - frames[one]
        of_lines = of_rows / rows.shape[1] + of_columns / columns.shape[1]
        left[p] = squares[p] - of_lines + whole * whole
    mean = pairwise_sum(left) / left.size
    if not mean > 0:
        return np.nan
    scatter = 0.0
    for value in left:
        scatter += (value / mean - 1) * (value / mean - 1)
    return scatter / (left.size - 1)
