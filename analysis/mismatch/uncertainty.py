"""Parameters and their errors at the end: numbers that move together are not independent.

The score of the final fit is evaluated on every simulation of the final model. Its mean corrects
what the fit does wrong by itself, its covariance gives the sandwich error (Huber 1967).

Slopes are means over few simulated sensors. Their scatter adds to their squares what looks like
information (errors in variables: Fuller, "Measurement error models", 1987, section 1.2), so that
the information is made of products of different sensors: unbiased, however few pixels an effect
has.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.candidates.patterns import FALL_SIZE, RING_SIZE
from analysis.mismatch.formerror import form_of
from analysis.mismatch.layout import Layout
from analysis.mismatch.named import Plain
from analysis.mismatch.polish import (
    Free,
    free_of,
    moved,
    precisions,
    shifted,
    with_effects,
)
from analysis.mismatch.predict import Predictor
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
# A size, what shapes it, and of what that is a plain one.
_PLAIN = ((FALL_SIZE, RING_SIZE, 0.0), ("percent_full_scale", "exponent", 1.0))
_LARGEST = 0.7  # correction of a logarithm
_CLEAR = 0.9  # share of what slopes show that is theirs: more sensors are not needed
_LEAST = 0.05  # of it, from which on errors are said as if it were that much
_BY_CHANCE = float(scipy.stats.norm.cdf(3.0))  # quantile of a mean square, that chance makes
_LEAST_SENSORS = 2  # that show a scatter
_NORMAL = 1.96
_FARTHEST = 7.0  # end of a logarithm's interval: beyond a factor of 1000 nothing is known


@dataclass(frozen=True)
class Settled:
    """What was fitted, in the end.

    Attributes
    ----------
    effects
        In the order of their proposals.
    errors
        Standard errors of their free parameters.
    plain
        Effects of a shape that may as well be none, as they are with none, and errors of their
        sizes then; None: all others.
    """

    effects: tuple[Effect, ...]
    errors: tuple[dict[str, float], ...]
    plain: tuple[Plain | None, ...]


def settled(state: State, bare: Camera, proposals: Sequence[Proposal]) -> Settled:
    """Return effects and standard errors of their free parameters.

    1.96 errors are half the 95 % interval: by Student's law, for the variance is known from few
    simulations, and of a parameter whose logarithm is fitted to the farther end of its own
    interval. Numbers that tell a parameter and are off by far more than chance make its error
    larger, see `_misfit`.

    Parameters
    ----------
    state
        The final model, with the effects of `proposals` in it.
    bare
        Its camera without them.
    proposals
        Effects as fitted, and which parameters are free.
    """
    effects = tuple(p.effect for p in proposals)
    free = free_of(proposals)
    errors: tuple[dict[str, float], ...] = tuple({} for _ in proposals)
    if not free:
        return Settled(effects, errors, (None,) * len(effects))
    mean, known = state.null.mean, state.null.known
    score, inverse, weights = _information(state, bare, effects, free)
    rest = np.where(known, state.vector.values - mean, 0.0)
    drawn = np.where(known, np.nan_to_num(state.simulated) - mean, 0.0)
    simulated = drawn @ score.T
    count = len(simulated)
    covariance = np.atleast_2d(np.cov(simulated, rowvar=False)) * (1 + 1 / count)
    sandwich = inverse @ covariance @ inverse
    step = inverse @ (score @ rest)
    student = float(scipy.stats.t.ppf(0.975, count - 1))
    reach = student * np.sqrt(np.diag(sandwich))
    _, sd, _ = state.predictor().weights(mean)
    slopes = np.divide(score, weights, out=np.zeros_like(score), where=weights > 0).T
    left = np.where(weights > 0, np.vstack([rest - slopes @ step, drawn]), 0.0)
    wider = _misfit(slopes, sd, *np.split(left, [1]))
    reach *= wider
    corrected = effects
    for (i, name, signed), delta in zip(free, step, strict=True):
        limited = float(delta if signed else np.clip(delta, -_LARGEST, _LARGEST))
        changed = moved(corrected, i, name, signed, limited, as_is=True)
        corrected = corrected if changed is None else changed[0]
    # Where a parameter acts by a threshold the step is no guide: it must not make things worse.
    predictor, camera = state.predictor(), with_effects(bare, corrected)
    if camera is None or predictor.loglik(predictor.mean(camera)) < predictor.loglik(mean):
        corrected = effects
    layout = state.setting.layout
    for (i, name, signed), half in zip(free, reach, strict=True):
        errors[i][name] = _error(corrected[i], name, half, layout, signed=signed)
    square = student**2 * sandwich * np.outer(wider, wider)
    plain = [_plain(effect, i, free, square, layout) for i, effect in enumerate(corrected)]
    return Settled(corrected, errors, tuple(plain))


def _error(effect: Effect, name: str, half: float, layout: Layout, *, signed: bool) -> float:
    """Return the standard error of a parameter from half the interval of what was fitted."""
    value = abs(float(getattr(effect, name)))
    far = value * np.expm1(half) if half < _FARTHEST else np.inf
    own = half if signed else far
    return float(np.hypot(own / _NORMAL, value * form_of(effect, name, layout)))


def _plain(
    effect: Effect, which: int, free: Sequence[Free], square: Array, layout: Layout
) -> Plain | None:
    """Return a fall of light without a ring, or a parabola for a bend, if it may as well be that.

    By the regression of the size on the shape; `square` is the covariance of what was fitted, in
    halves of 95 % intervals.
    """
    own = {name: k for k, (i, name, _) in enumerate(free) if i == which}
    found = next((one for one in _PLAIN if {one[0], one[1]} <= own.keys()), None)
    if found is None:
        return None
    name, shape, none = found
    size, other = own[name], own[shape]
    off = float(getattr(effect, shape))
    off = off - none if free[other][2] else log(off / none)
    if not abs(off) <= np.sqrt(square[other, other]):
        return None
    share = float(square[size, other] / square[other, other])
    half = float(np.sqrt(max(square[size, size] - share**2 * square[other, other], 0.0)))
    signed = free[size][2]
    changed = moved((effect,), 0, name, signed, -share * off, as_is=True)
    if changed is None:
        return None
    alone = type(effect)(**(changed[0][0].model_dump() | {shape: none}))
    return alone, {name: _error(alone, name, half, layout, signed=signed)}


def _information(
    state: State, bare: Camera, effects: tuple[Effect, ...], free: Sequence[Free]
) -> tuple[Array, Array, Array]:
    """Return the score's weights (parameter, number), the inverse of its information, precisions.

    Sensors are added until their scatter is little beside the slopes, or as many as of a null.
    """
    replicates = max(state.setting.replicates, _LEAST_SENSORS)
    most = replicates if state.setting.large else min(state.setting.nulls, len(state.simulated))
    while True:
        predictor = state.predictor(replicates)
        slopes = _slopes(state, replicates, bare, effects, free)
        j = slopes.mean(0)
        weights = precisions(predictor, state.null.mean, j)
        slopes = np.where(weights[:, None] > 0, np.nan_to_num(slopes), 0.0)
        score = (slopes.mean(0) * weights[:, None]).T
        inverse, share = inverse_information(slopes, weights)
        if share > _CLEAR or replicates >= most:
            return score, inverse, weights
        replicates = min(2 * replicates, most)


def _misfit(slopes: Array, sd: Array, left: Array, drawn: Array) -> Array:
    """Return by how much errors of parameters are larger for numbers that do not fit: (parameter,).

    The mean of the squares of what is left, (1, number), in standard deviations, each weighted by
    what it tells of the parameter (Birge, Phys. Rev. 40, 1932): 1 for a law that holds. A full
    well, say, where charge is limited by another law, is told by numbers that remain far off. What
    chance makes of as many counts as 1: by the law of chi-squared, of fewer where the mean squares
    of simulated recordings scatter more, whose numbers are `drawn` about their mean, (recording,
    number). Channels of a frame that is far off are far off together.
    """
    told = (slopes / sd[:, None]) ** 2
    whole = np.maximum(told.sum(0), 1e-300)
    (birge,), alike = ((own / sd) ** 2 @ told / whole for own in (left, drawn))
    numbers = whole**2 / np.maximum((told**2).sum(0), 1e-300)
    scatter = alike.var(0, ddof=1) if len(alike) > 1 else np.zeros(alike.shape[1])
    numbers = np.maximum(np.minimum(numbers, 2 / np.maximum(scatter, 1e-300)), 1.0)
    chance = scipy.stats.chi2.ppf(_BY_CHANCE, numbers) / numbers
    return np.sqrt(np.where(birge > chance, birge, 1.0))


def _slopes(
    state: State, replicates: int, bare: Camera, effects: tuple[Effect, ...], free: Sequence[Free]
) -> Array:
    """Return how numbers move with each parameter: (replicate, number, parameter).

    From below it to above it: numbers that go with its square rise by an eighth more above it. Of a
    large recording, where a simulation takes long, above it alone.
    """
    alike = [state.setting.alike(effects[i]) for i, _, _ in free]
    sides = (1,) if state.setting.large else (1, -1)
    ways = [list(shifted(bare, effects, free, way)) for way in sides]
    asked = {same: state.predictor(1 if same else replicates) for same in set(alike)}
    for same, predictor in asked.items():
        predictor.ready(
            other
            for beside in ways
            for own, (other, _) in zip(alike, beside, strict=True)
            if own == same
        )
    size = state.null.mean.size
    columns = [
        np.broadcast_to(_slope(asked[same], both, size), (replicates, size))
        for same, both in zip(alike, zip(*ways, strict=True), strict=True)
    ]
    return np.stack(columns, 2)


def _slope(predictor: Predictor, both: Sequence[tuple[Camera | None, float]], size: int) -> Array:
    """Return the slope from below to above; where a camera is not allowed, from the state's own."""
    there = [(predictor.changes(other), by) for other, by in both if other is not None]
    if not there:
        return np.zeros(size)
    (first, up), (last, down) = there[0], (there[1] if len(there) > 1 else (0.0, 0.0))
    return np.asarray((first - last) / (up - down))


def inverse_information(slopes: Array, weights: Array) -> tuple[Array, float]:
    """Return the inverse information of slopes, and the share that is no scatter between sensors.

    What is unbiased is compared with the plain square in its own units, direction by direction.
    """
    count = len(slopes)
    total = slopes.sum(0)
    plain = (total * weights[:, None]).T @ total
    size = np.sqrt(np.maximum(np.diag(plain), 1e-12))
    values, vectors = np.linalg.eigh(plain / np.outer(size, size) + 1e-6 * np.eye(len(plain)))
    root = vectors / np.sqrt(values) / size[:, None]
    own = np.einsum("rnp,n,rnq->pq", slopes, weights, slopes, optimize=True)
    values, vectors = np.linalg.eigh(root.T @ (count / (count - 1) * (plain - own)) @ root)
    turned = root @ vectors * count
    share = float(values.min())
    return (turned / np.clip(values, _LEAST, 1.0)) @ turned.T, share
