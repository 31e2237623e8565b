"""How strong a planted effect is, in standard deviations of the planter's own statistic.

The statistic is a weighted sum of the effect's evidence: weights are the pattern that the effect
makes over exposures and channels, divided by the null variances, at right angles to what re-fitting
the base model can do. z = (with - without) / sd of recordings without, frames' seeds being the
same with and without, so that their difference is the effect's alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from planter.calibration import levels
from planter.case import Case, Effect
from planter.evidence import COUNTED, EVIDENCE, Look
from planter.recipes import RECIPES

NULLS, PILOTS = 12, 4
TRIES = 14
CLOSE = 0.03  # of the wanted z; the nulls know their own sd to 20 % only
VISIBLE = 1e-9  # of the evidence's own size: less is rounding of the projection


class Unidentifiable(Exception):  # noqa: N818 # a fact about a layout, no failure
    """The recording cannot show this effect: a re-fit of the base model explains it all."""


@dataclass(frozen=True)
class Planting:
    """An effect scaled to a strength.

    Attributes
    ----------
    case
        The recording with the effect.
    z
        Where the planter's statistic stands.
    x, drawn
        Strength of the recipe, and its other parameters.
    evidence
        The share of z that each piece of evidence brings (empty where counted).
    """

    case: Case
    kind: str
    z: float
    x: float
    drawn: Mapping[str, Any]
    evidence: tuple[float, ...] = ()


class Scale:
    """The planter's statistic of one kind on one recording without it."""

    def __init__(self, case: Case, kind: str, drawn: Mapping[str, Any]) -> None:
        self.case, self.kind, self.drawn = case.without(kind), kind, drawn
        self.weights: np.ndarray | None = None

    def planted(self, x: float, seed_step: int = 0) -> Case:
        """Return the recording with the effect at strength x, or another one of its kind."""
        case = _other(self.case, seed_step)
        parameters = RECIPES[self.kind].parameters(self.case, self.drawn, x)
        return case.having(Effect(self.kind, parameters))

    def evidence(self, case: Case) -> np.ndarray:
        """Return the pieces of evidence in a recording."""
        parameters = RECIPES[self.kind].parameters(self.case, self.drawn, 1.0)
        return EVIDENCE[self.kind](Look(case), parameters).values

    @cached_property
    def without(self) -> np.ndarray:
        """Evidence of the case's own recording without the effect."""
        return self.evidence(self.case)

    @cached_property
    def nulls(self) -> np.ndarray:
        """Evidence of other recordings without the effect (recording, values)."""
        return np.array([self.evidence(_other(self.case, k)) for k in range(1, NULLS + 1)])

    def aim(self, x: float) -> None:
        """Set the weights from the pattern that the effect makes at strength x."""
        steps = range(1, PILOTS + 1)
        pilots = [self.evidence(self.planted(x, k)) - self.nulls[k - 1] for k in steps]
        pattern, sd = np.mean(pilots, 0), self.nulls.std(0, ddof=1)
        sd = np.maximum(sd, 1e-6 * sd.max() + 1e-30)
        parameters = RECIPES[self.kind].parameters(self.case, self.drawn, 1.0)
        free = EVIDENCE[self.kind](Look(self.case), parameters).nuisance
        seen = pattern / sd
        if free is not None:
            basis = np.linalg.svd(free / sd[:, None], full_matrices=False)
            basis_vectors = basis[0][:, basis[1] > 1e-9 * basis[1][0]]
            seen = seen - basis_vectors @ (basis_vectors.T @ seen)
        if np.linalg.norm(seen) <= max(VISIBLE * np.linalg.norm(pattern / sd), 1e-12):
            raise Unidentifiable(self.kind)
        self.weights = seen / sd

    def z(self, case: Case) -> float:
        """Return where the statistic of the case with the effect stands."""
        if self.kind in COUNTED:
            effect = case.planted(self.kind)
            return COUNTED[self.kind](Look(case), effect or {})
        gained = self.evidence(case) - self.without
        if self.kind == "poisson_shot_noise":
            gained = self._gained_elsewhere()
        return float(gained @ self.weights / np.std(self.nulls @ self.weights, ddof=1))

    def _gained_elsewhere(self) -> np.ndarray:
        """Return the mean gain of other recordings: counts share no deviates with a Gaussian."""
        steps = range(PILOTS + 1, NULLS + 1)
        return np.mean([self.evidence(self.planted(1.0, k)) - self.nulls[k - 1] for k in steps], 0)

    def shares(self, case: Case) -> tuple[float, ...]:
        """Return the share of z that each piece of evidence brings."""
        if self.weights is None:
            return ()
        parts = (self.evidence(case) - self.without) * self.weights
        return tuple(float(part) for part in parts / parts.sum())


def strength(case: Case, kind: str, drawn: Mapping[str, Any], x: float) -> Planting:
    """Return the effect planted at strength x of its recipe, and its z."""
    scale = Scale(case, kind, drawn)
    if kind in EVIDENCE:
        scale.aim(x)
    return _planting(scale, x)


def calibrate(case: Case, kind: str, z: float, drawn: Mapping[str, Any] | None = None) -> Planting:
    """Return the case with the effect planted so that its statistic stands at z.

    Parameters
    ----------
    case
        A recording, with or without other effects.
    kind
        The effect; raises `Unidentifiable` where the recording cannot show it.
    z
        Wanted strength. Where no camera could reach it, and for kinds of natural steps
        (quantisation), the result's own z says what was reached.
    drawn
        Parameters besides the strength; None: drawn by the case's seed.
    """
    recipe = RECIPES[kind]
    if drawn is None:
        drawn = recipe.draw(np.random.default_rng([case.seed, 5]), case)
    if kind == "poisson_shot_noise":
        return _electrons(case, z)
    if kind == "quantisation":
        return strength(case, kind, drawn, 1.0)
    scale, x = Scale(case, kind, drawn), 1.0
    for _ in range(2):  # the pattern is that of about the final strength
        if kind in EVIDENCE:
            scale.aim(x)
        x = _solved(scale, z, x, recipe.power, recipe.most)
    return _planting(scale, x)


def _planting(scale: Scale, x: float) -> Planting:
    found = scale.planted(x)
    return Planting(found, scale.kind, scale.z(found), x, scale.drawn, scale.shares(found))


def _solved(scale: Scale, wanted: float, x: float, power: int, most: float) -> float:
    """Return the strength at which z is as wanted: steps in log strength, the closest one kept."""
    best, best_miss = x, np.inf
    low, high = 0.0, most
    for _ in range(TRIES):
        z = scale.z(scale.planted(x))
        miss = abs(np.log(max(z, 1e-3) / wanted))
        if miss < best_miss:
            best, best_miss = x, miss
        if miss < CLOSE or (z < wanted and x >= most):
            break
        low, high = (x, high) if z < wanted else (low, x)
        step = np.clip((wanted / max(z, 0.3)) ** (1 / power), 0.2, 5)
        x = x * step if low < x * step < high else np.sqrt(max(low, high / 100) * high)
    return float(best)


def _electrons(case: Case, wanted: float) -> Planting:
    """Return Poisson counts in a camera of as many electrons as make the skew stand at z."""
    aimed = wanted
    for _ in range(3):  # the closed form is near, its part that finite frames take is measured
        factors = np.geomspace(1e-3, 1e3, 601)
        expected = np.array([_skew_z(_with_gain(case, factor)) for factor in factors])
        factor = float(factors[np.argmin(np.abs(expected - aimed))])
        found = strength(_with_gain(case, factor), "poisson_shot_noise", {}, 1.0)
        if abs(np.log(max(found.z, 0.3) / wanted)) < 3 * CLOSE:
            break
        aimed *= float(np.clip(wanted / max(found.z, 0.3), 0.5, 2))
    return found


def _with_gain(case: Case, factor: float) -> Case:
    segments = tuple(replace(s, slope=s.slope * factor) for s in case.segments)
    return replace(case, segments=segments)


def _skew_z(case: Case) -> float:
    """Return about the z of the skewness: its third moment is slope^2 S, its error sqrt(6 / n)."""
    total = 0.0
    for signal, samples in levels(case):
        path = next(s for s in case.segments if s.upper_dn is None or signal < s.upper_dn)
        variance = path.slope * signal + path.intercept + 1 / 12
        total += (path.slope**2 * signal) ** 2 / variance**3 * samples / 6
    return float(np.sqrt(total))


def _other(case: Case, step: int) -> Case:
    """Return another recording by another sensor of the same kind; step 0: the same."""
    # Seeds of cases are small; other recordings' seeds lie far off.
    return replace(case, seed=case.seed + step * 2**40, sensor_seed=case.sensor_seed + step * 2**40)
