"""Variance from pairs of frames: equation (1) of the paper, with and without change of the mean."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan

from dsis.measures.estimate import Estimate, estimate
from dsis.measures.variance_components import Components


@dataclass(frozen=True)
class PairVariance:
    """Temporal variance from disjoint pairs of consecutive frames, DN^2.

    Attributes
    ----------
    variance
        (mean d^2 - mean(d)^2) / 2 of the difference d: a change of light or offset is removed.
    removed
        mean(d)^2 / 2: what was removed. Evidence of drift or flicker where it exceeds
        variance / pixels.
    uncorrected
        mean d^2 / 2, equation (1): their sum.
    pairs
        Number of pairs.
    squares
        mean d^2 of each, DN^2.
    """

    variance: Estimate
    removed: Estimate
    uncorrected: Estimate
    pairs: int
    squares: tuple[float, ...]


def pair_variance(
    squares: Sequence[float], means: Sequence[float], noise: Components
) -> PairVariance:
    """Return the pair variance of one channel.

    Parameters
    ----------
    squares, means
        mean d^2 (DN^2) and mean d (DN) of each pair.
    noise
        Components of the same frames; row and column noise is in the error.
    """
    pairs, size = len(squares), noise.rows * noise.columns
    removed = sum(mean**2 for mean in means) / pairs / 2
    uncorrected = sum(squares) / pairs / 2
    # Each pair is one degree of freedom of the T - 1 that the components rest on.
    share = (noise.frames - 1) / pairs
    error = noise.var_ms_pixel
    error += noise.var_ms_row / noise.columns**2 + noise.var_ms_column / noise.rows**2
    error_removed = 2 * removed**2 / (pairs + 2)
    null = 2 * noise.ms_pixel**2 / (pairs * size)
    null_removed = 2 * (noise.ms_pixel / size) ** 2 / pairs
    return PairVariance(
        estimate(uncorrected - removed, error * share, nan, null),
        estimate(removed, error_removed, noise.ms_pixel / size, null_removed),
        estimate(uncorrected, error * share + error_removed, nan, null),
        pairs,
        tuple(squares),
    )
