"""Observers needed to show a difference of MOS: power of the t test, several comparisons."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, chdtri, ndtr
from scipy.stats import chi2, t

from analysis.holm import holm
from dsis.errors import Fault, InputError

Correction = Literal["bonferroni", "holm"]
OBSERVERS_MAX = 100_000
HOLM_RUNS = 20_000  # tests in all; the standard error of a power of 0.8 is then below 0.003
HOLM_COMPARISONS_MAX = 1000
SEED = 1
_NODES = 200


@dataclass(frozen=True)
class Plan:
    """What a test shall show.

    Attributes
    ----------
    difference
        Of two mean opinion scores, grades.
    sd
        Paired: of an observer's difference of two votes; else of the votes; grades.
    comparisons
        How many are made; each has this difference.
    correction
        `bonferroni`; or `holm`, simulated for independent comparisons: never needs more.
    paired
        The same observers judge both; else two groups, of the size that is returned each.
    power
        Chance that a given comparison shows its difference.
    alpha
        Family-wise error, two-sided.
    """

    difference: float
    sd: float
    comparisons: int = 1
    correction: Correction = "bonferroni"
    paired: bool = True
    power: float = 0.8
    alpha: float = 0.05


def observers_needed(plan: Plan) -> int:
    """Return the smallest number of observers (per group, if not paired) that has the power.

    Raises
    ------
    InputError
        A number that is none of a plan, or more than 10^5 observers would be needed.
    """
    _check(plan)
    low, high = 2, 4
    while power_of(plan, high) < plan.power:
        low, high = high, 2 * high
        if high > OBSERVERS_MAX:
            fact = f"is {plan.difference:g}: more than {OBSERVERS_MAX} observers are needed"
            raise InputError.of("--difference", "", fact)
    if power_of(plan, 2) >= plan.power:
        return 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if power_of(plan, middle) >= plan.power else (middle, high)
    return high


def power_of(plan: Plan, observers: int) -> float:
    """Return the chance that a comparison with `observers` shows its difference.

    Noncentral t with n - 1 degrees of freedom and noncentrality difference / sd sqrt(n); two
    groups: 2 n - 2 and difference / sd sqrt(n / 2).
    """
    _check(plan)
    if plan.correction == "holm" and plan.comparisons > 1:
        return _power_after_holm(plan, observers)
    freedom, shift = _freedom(plan, observers), _noncentrality(plan, observers)
    limit = float(t.ppf(1 - plan.alpha / (2 * plan.comparisons), freedom))
    return _beyond(limit, freedom, shift)


def _beyond(limit: float, freedom: int, shift: float) -> float:
    """Return the chance that a noncentral t lies beyond +-limit.

    Given s, the estimated sd over the true one, it is Phi(shift - limit s) + Phi(-shift - limit s);
    the integral over s is a sum over Gauss-Legendre nodes. (SciPy's noncentral t has holes, nan, in
    its far tail.)
    """
    ends = np.sqrt(chdtri(freedom, [1 - 1e-15, 1e-15]) / freedom)
    x, weight = _legendre()
    s = ends[0] + (ends[1] - ends[0]) * (x + 1) / 2
    density = 2 * freedom * s * chi2.pdf(freedom * s**2, freedom)
    inside = weight * (ends[1] - ends[0]) / 2 * density
    return min(1.0, float(inside @ (ndtr(shift - limit * s) + ndtr(-shift - limit * s))))


def _freedom(plan: Plan, observers: int) -> int:
    return observers - 1 if plan.paired else 2 * observers - 2


def _noncentrality(plan: Plan, observers: int) -> float:
    effective = observers if plan.paired else observers / 2
    return abs(plan.difference) / plan.sd * math.sqrt(effective)


def _power_after_holm(plan: Plan, observers: int) -> float:
    """Simulate families of independent comparisons and count what Holm lets pass."""
    freedom, shift = _freedom(plan, observers), _noncentrality(plan, observers)
    families = max(HOLM_RUNS // plan.comparisons, 200)
    random = np.random.Generator(np.random.PCG64(SEED))
    shape = (families, plan.comparisons)
    # Inverse of the distributions at one set of uniforms: the power is then monotone in n.
    normal = random.standard_normal(shape) + shift
    chi_square = chdtri(freedom, random.random(shape))
    statistic = normal / np.sqrt(chi_square / freedom)
    p = betainc(freedom / 2, 0.5, freedom / (freedom + statistic**2))
    return float(np.mean([(holm(family) <= plan.alpha).mean() for family in p]))


@cache
def _legendre() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, weight = np.polynomial.legendre.leggauss(_NODES)
    return x, weight


def _check(plan: Plan) -> None:
    numbers = (
        ("--difference", plan.difference, plan.difference != 0, "other than 0"),
        ("--sd", plan.sd, plan.sd > 0, "above 0"),
        ("--power", plan.power, plan.alpha < plan.power < 1, f"above {plan.alpha:g} and below 1"),
        ("--alpha", plan.alpha, 0 < plan.alpha < 1, "between 0 and 1"),
        ("--comparisons", plan.comparisons, plan.comparisons >= 1, "at least 1"),
    )
    faults = [
        Fault(name, "", f"is {value:g}, must be {allowed}")
        for name, value, sound, allowed in numbers
        if not (sound and math.isfinite(value))
    ]
    if plan.correction == "holm" and plan.comparisons > HOLM_COMPARISONS_MAX:
        fact = f"is {plan.comparisons}, must be at most {HOLM_COMPARISONS_MAX} with Holm"
        faults.append(Fault("--comparisons", "", fact))
    if faults:
        raise InputError(faults)
