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
        Standard deviations under the final model by all its simulations but one: (simulation,
        statistic); nan where one cannot be judged.

    D is the mean squared difference from one simulation, standardised and averaged over
    simulations; Df that of two simulations of the final model. Each of these takes the recording's
    place in turn, and is no more measured by what it told itself than the recording is: a number
    that has told of its own spread is never far off. How far D scatters by chance, they tell as
    well: numbers hang together. Where D0 - Df is what chance makes of it in one of a hundred
    recordings, nothing was open: None.
    """
    simulations = len(after_sims)
    if simulations < _LEAST:
        message = f"gap_closed needs {_LEAST} simulations of the final model, not {simulations}"
        raise ValueError(message)
    known = np.isfinite(x_locked) & np.isfinite(before_sims).all(0) & np.isfinite(after_sims).all(0)
    known &= np.isfinite(sd).all(0) & (sd > 0).all(0)
    if not known.any():
        return None
    x, before, after, sd = (a[..., known] for a in (x_locked, before_sims, after_sims, sd))
    others = [np.arange(simulations) != i for i in range(simulations)]

    def distance(one: Array, sims: Array, i: int) -> float:
        return float((((one - sims) / sd[i]) ** 2).mean())

    of_before = np.array([[distance(x, one, i) for one in before] for i in range(simulations)])
    d0, each = float(of_before.mean()), of_before.mean(0)
    d1 = float(np.mean([distance(x, after[own], i) for i, own in enumerate(others)]))
    by_chance = np.array([distance(after[i], after[own], i) for i, own in enumerate(others)])
    df = float(by_chance.mean())
    scatter = float(by_chance.var(ddof=1)) * (1 + 1 / simulations)
    error = np.sqrt(scatter + float(each.var(ddof=1)) / len(before))
    if d0 - df < t.isf(_CHANCE, simulations - 1) * error:
        return None
    return (d0 - d1) / (d0 - df)
