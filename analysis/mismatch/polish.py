"""Parameters of effects by Gauss-Newton steps on the bank's numbers, predicted by simulation."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from analysis.mismatch.apart import as_far_apart
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.predict import Predictor
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
STEP = 0.12  # of the logarithm, for the derivative
_OF_NOISE = 0.25  # standard deviations by which a full well moves for its derivative
_LEAST_STEP = 1e-5  # of single precision
_LARGEST = 1.2  # step of a logarithm
_CYCLIC = {"at_code": "period_codes"}
_SMALL = 0.05  # gain of log-likelihood below which another round is in vain
Free = tuple[int, str, bool]
"""Number of an effect, name of its parameter, whether it may be negative."""
_NU = 6.0


@dataclass(frozen=True)
class Polished:
    """Effects with fitted parameters.

    Attributes
    ----------
    effects
        As fitted.
    loglik
        Of the recorded numbers.
    mean
        The numbers predicted.
    errors
        Standard errors of the free parameters, by effect and name.
    """

    effects: tuple[Effect, ...]
    loglik: float
    mean: Array
    errors: tuple[dict[str, float], ...]


def polish(
    predictor: Predictor,
    camera: Camera,
    start: Sequence[Proposal],
    rounds: int = 2,
    slopes: Callable[[Effect], Predictor] | None = None,
) -> Polished | None:
    """Return `camera` with effects whose parameters are fitted; None where it is no camera.

    `camera` holds what stays as it is; the effects of `start` are added to it. `slopes` gives what
    tells how numbers move with the parameters of an effect, where fewer simulations do.
    """
    free = free_of(start)
    effects = tuple(p.effect for p in start)
    built = with_effects(camera, effects)
    if built is None:
        return None
    mean = predictor.mean(built)
    best = predictor.loglik(mean)
    errors: Array = np.full(len(free), np.inf)
    for _ in range(rounds if free else 0):
        step, errors, promised = _newton(predictor, camera, effects, free, mean, slopes)
        if promised < _SMALL:
            break
        better = _along(predictor, camera, effects, free, step, best)
        if better is None:
            break
        gained = better[2] - best
        effects, mean, best = better
        if gained < _SMALL:
            break
    by_effect: tuple[dict[str, float], ...] = tuple({} for _ in start)
    for (i, name, signed), error in zip(free, errors, strict=True):
        scale = 1.0 if signed else abs(float(getattr(effects[i], name)))
        by_effect[i][name] = float(error * scale)
    return Polished(effects, best, mean, by_effect)


def free_of(start: Sequence[Proposal]) -> list[Free]:
    """Return the free parameters of proposals, in order."""
    return [(i, name, name in p.signed) for i, p in enumerate(start) for name in p.free]


def needed(camera: Camera, start: Sequence[Proposal]) -> list[Camera | None]:
    """Return the cameras that the first round of a polish asks for."""
    effects = tuple(p.effect for p in start)
    moved = [other for other, _ in shifted(camera, effects, free_of(start))]
    return [with_effects(camera, effects), *moved]


def stepped(predictor: Predictor, camera: Camera, start: Sequence[Proposal]) -> Camera | None:
    """Return the camera after the first whole step of a polish, which asks for it next."""
    effects, free = tuple(p.effect for p in start), free_of(start)
    built = with_effects(camera, effects)
    if built is None or not free:
        return None
    step, _, promised = _newton(predictor, camera, effects, free, predictor.mean(built), None)
    own = _moved_by(effects, free, step) if promised >= _SMALL else None
    return None if own is None else with_effects(camera, own)


def _newton(
    predictor: Predictor,
    camera: Camera,
    effects: tuple[Effect, ...],
    free: Sequence[Free],
    mean: Array,
    slopes: Callable[[Effect], Predictor] | None,
) -> tuple[Array, Array, float]:
    """Return the Gauss-Newton step of the free parameters, their standard errors and its gain."""
    j = jacobian(predictor if slopes is None else slopes, camera, effects, free)
    score, inverse = information(predictor, mean, j)
    rest, _, _ = predictor.weights(mean)
    along = score @ rest
    step = inverse @ along
    return step, np.sqrt(np.diag(inverse)), float(step @ along) / 2


def jacobian(
    predictor: Predictor | Callable[[Effect], Predictor],
    camera: Camera,
    effects: tuple[Effect, ...],
    free: Sequence[Free],
) -> Array:
    """Return how the predicted numbers move with each free parameter: (number, parameter)."""
    own = [predictor if isinstance(predictor, Predictor) else predictor(effects[i])
           for i, _, _ in free]  # fmt: skip
    built, beside = with_effects(camera, effects), list(shifted(camera, effects, free))
    for most in sorted({one.replicates for one in own}):
        some = [other for one, (other, _) in zip(own, beside, strict=True)
                if one.replicates >= most]  # fmt: skip
        next(one for one in own if one.replicates == most).ready([built, *some])
    columns = [
        np.zeros(one.forms.size)
        if other is None or built is None
        else (one.mean(other) - one.mean(built)) / step
        for one, (other, step) in zip(own, beside, strict=True)
    ]
    return np.stack(columns, 1)


def shifted(
    camera: Camera, effects: tuple[Effect, ...], free: Sequence[Free], way: int = 1
) -> Iterator[tuple[Camera | None, float]]:
    """Yield the camera with each free parameter moved in turn, or None, and by how much.

    It moves up, or down where `way` is -1.
    """
    for i, name, signed in free:
        other = moved(effects, i, name, signed, way * _step(camera, effects[i], name))
        yield (None, 1.0) if other is None else (with_effects(camera, other[0]), other[1])


def _step(camera: Camera, effect: Effect, name: str) -> float:
    """Return the step of a parameter for its derivative: of its logarithm, or share of its size.

    A full well moves by a share of the noise there: farther off there is none, or nothing else.
    """
    if name != "full_well_dn":
        return STEP
    full: float = getattr(effect, name)
    noise = float(camera.segments.variance_dn2(np.array([full], np.float32))[0]) ** 0.5
    return float(np.clip(_OF_NOISE * noise / full, _LEAST_STEP, STEP))


def information(predictor: Predictor, mean: Array, j: Array) -> tuple[Array, Array]:
    """Return what residuals are multiplied by to a score (parameter, number), and its inverse.

    The second is the inverse information, were the numbers independent.
    """
    usable = np.where(np.isfinite(j), j, 0.0)
    score = (usable * precisions(predictor, mean, j)[:, None]).T
    normal = score @ usable
    size = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled = normal / np.outer(size, size) + 1e-6 * np.eye(len(normal))
    return score, np.linalg.pinv(scaled, rcond=1e-8) / np.outer(size, size)


def precisions(predictor: Predictor, mean: Array, j: Array) -> Array:
    """Return by how much each number's residual counts; 0 where it or a derivative is unknown."""
    rest, sd, known = predictor.weights(mean)
    known &= np.isfinite(j).all(1) & ~predictor.counts.repeated
    return np.where(known, (_NU + 1) / _NU / (1 + (rest / sd) ** 2 / _NU) / sd**2, 0.0)


def _along(
    predictor: Predictor,
    camera: Camera,
    effects: tuple[Effect, ...],
    free: Sequence[Free],
    step: Array,
    best: float,
) -> tuple[tuple[Effect, ...], Array, float] | None:
    """Return effects, numbers and likelihood after the longest of three steps that gains."""
    for shrink in (1.0, 0.4, 0.15):
        own = _moved_by(effects, free, step * shrink)
        built = None if own is None else with_effects(camera, own)
        if own is None or built is None:
            continue
        mean = predictor.mean(built)
        value = predictor.loglik(mean)
        if value > best:
            return own, mean, value
    return None


def _moved_by(
    effects: tuple[Effect, ...], free: Sequence[Free], step: Array
) -> tuple[Effect, ...] | None:
    """Return the effects with all free parameters moved; None where a value is not allowed."""
    own: tuple[Effect, ...] | None = effects
    for (i, name, signed), delta in zip(free, step, strict=True):
        limited = delta if signed else float(np.clip(delta, -_LARGEST, _LARGEST))
        changed = None if own is None else moved(own, i, name, signed, limited, as_is=True)
        own = None if changed is None else changed[0]
    return own


def moved(
    effects: tuple[Effect, ...],
    which: int,
    name: str,
    signed: bool,
    step: float,
    *,
    as_is: bool = False,
) -> tuple[tuple[Effect, ...], float] | None:
    """Return effects with one parameter moved, and by how much in the parameter that is fitted.

    How far apart pixels are, in DN, maps say, whatever is fitted.
    """
    effect = effects[which]
    value = float(getattr(effect, name))
    if signed:
        by = step if as_is else _size(effect, name) * step
        new = value + by
    else:
        by = step
        new = exp(log(max(value, 1e-12)) + step)
    try:
        changed = type(effect)(**{**effect.model_dump(), name: new})
    except ValidationError:
        return None
    return (*effects[:which], as_far_apart(effect, changed), *effects[which + 1 :]), by


def _size(effect: Effect, name: str) -> float:
    """Return what a step of a parameter that may be negative is a share of."""
    period = _CYCLIC.get(name)
    if period is not None:  # where zero lies says nothing
        return float(getattr(effect, period)) / 4
    return abs(float(getattr(effect, name))) or 1.0


def with_effects(camera: Camera, effects: Sequence[Effect]) -> Camera | None:
    """Return a camera with effects added; None where it cannot have them."""
    values = {name: getattr(camera, name) for name in Camera.model_fields}
    values["effect"] = (*camera.effect, *effects)
    try:
        return Camera.model_validate(
            {("schema" if k == "schema_" else k): v for k, v in values.items()}
        )
    except ValidationError:
        return None
