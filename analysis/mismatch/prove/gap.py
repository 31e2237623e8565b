"""How much of the gap between recording and simulation the final model closes."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_LEAST = 4
_OPEN = 3.0  # standard errors by which the gap must be open before it can be closed


def gap_closed(x_locked: Array, before_sims: Array, after_sims: Array) -> float | None:
    """Return (D0 - D1) / (D0 - Df) of contracts, section 4; None: there was no gap.

    Parameters
    ----------
    x_locked
        Measures of the locked frames: (statistic,).
    before_sims, after_sims
        The same of simulations of both models: (simulation, statistic), at least four.

    D is the mean squared difference from one simulation, standardised by the final model's spread
    between simulations and averaged over simulations; Df that of two simulations of the final
    model. Where D0 - Df is below three standard errors of D0, nothing was open: None.
    """
    simulations = len(after_sims)
    if simulations < _LEAST:
        message = f"gap_closed needs {_LEAST} simulations of the final model, not {simulations}"
        raise ValueError(message)
    known = np.isfinite(x_locked) & np.isfinite(before_sims).all(0) & np.isfinite(after_sims).all(0)
    # The mean of 1 / s^2 of few draws is larger than 1 / sigma^2.
    sd = after_sims.std(0, ddof=1) * np.sqrt((simulations - 1) / (simulations - 3))
    known &= sd > 0
    if not known.any():
        return None
    x, before, after = (a[..., known] / sd[known] for a in (x_locked, before_sims, after_sims))
    d0, d1 = (float(((x - sims) ** 2).mean()) for sims in (before, after))
    df = 2.0  # two draws of unit variance
    error = np.sqrt(8 / x.size)  # of a mean of squared normal deviates of variance 2
    if d0 - df < _OPEN * error:
        return None
    return (d0 - d1) / (d0 - df)
