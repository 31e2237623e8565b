"""How much of the gap between recording and simulation the final model closes."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

Array = NDArray[np.float64]
_LEAST = 4
_CHANCE = 0.01  # that no gap is called open: only an open one can be closed


def gap_closed(x_locked: Array, before_sims: Array, after_sims: Array, sd: Array) -> float | None:
    """Return (D0 - D1) / (D0 - Df) of contracts, section 4; None: there was no gap.

    Parameters
    ----------
    x_locked
        Measures of the locked frames: (statistic,).
    before_sims, after_sims
        The same of simulations of both models: (simulation, statistic), at least four.
    sd
        Standard deviations under the final model: (statistic,); nan where one cannot be judged.

    D is the mean squared difference from one simulation, standardised and averaged over
    simulations; Df that of two simulations of the final model. How far D scatters by chance, its
    simulations tell, each in the recording's place: numbers hang together. Where D0 - Df is what
    chance makes of it in one of a hundred recordings, nothing was open: None.
    """
    simulations = len(after_sims)
    if simulations < _LEAST:
        message = f"gap_closed needs {_LEAST} simulations of the final model, not {simulations}"
        raise ValueError(message)
    known = np.isfinite(x_locked) & np.isfinite(before_sims).all(0) & np.isfinite(after_sims).all(0)
    known &= np.isfinite(sd) & (sd > 0)
    if not known.any():
        return None
    x, before, after = (a[..., known] / sd[known] for a in (x_locked, before_sims, after_sims))
    d0, d1 = (float(((x - sims) ** 2).mean()) for sims in (before, after))
    rest = np.array([((one - after) ** 2).mean() for one in after]) * simulations
    by_chance = rest / (simulations - 1)  # each is no distance from itself
    df = float(by_chance.mean())
    of_before = np.array([((x - one) ** 2).mean() for one in before])
    scatter = float(by_chance.var(ddof=1)) * (1 + 1 / simulations)
    error = np.sqrt(scatter + float(of_before.var(ddof=1)) / len(before))
    if d0 - df < t.isf(_CHANCE, simulations - 1) * error:
        return None
    return (d0 - d1) / (d0 - df)
