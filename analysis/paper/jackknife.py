"""Averages of second moments over images, with their standard errors."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.covariance import LagCovariance, averaged


def with_error(
    parts: Sequence[LagCovariance], statistic: Callable[[LagCovariance], NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a statistic of all images taken together and its jackknife standard error.

    Images of different size count as their pixels do. With one image the error is NaN. Efron,
    "The jackknife, the bootstrap and other resampling plans", SIAM 1982, chapter 3.
    """
    whole = statistic(averaged(parts))
    n = len(parts)
    if n < 2:
        return whole, np.full_like(whole, np.nan)
    without: NDArray[Any] = np.stack(
        [statistic(averaged([*parts[:i], *parts[i + 1 :]])) for i in range(n)]
    )
    spread = np.square(without - without.mean(axis=0)).sum(axis=0)
    return whole, np.sqrt(spread * (n - 1) / n)
