"""How far the base model's numbers go with what is known of effects beside them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite

from pydantic import ValidationError

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.model import side_by_side
from analysis.mismatch.named import Named
from analysis.mismatch.own import Own
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect

_STEP = 0.2  # of a size: what base numbers do is straight so far
_SIDES = (1, -1)


@dataclass(frozen=True)
class Beside:
    """Base numbers beside an effect as it is, and beside one of another size.

    Attributes
    ----------
    before, after
        The fits.
    errors
        How many steps, from one to the other, the size's standard error is.
    """

    before: BaseFit
    after: BaseFit
    errors: float


def fitted_beside(state: State, some: Sequence[Named], sized: Sequence[Own] = ()) -> list[Beside]:
    """Return how base numbers go with each size of named effects that has an error.

    And with those of the user's effects that are `sized` otherwise than the user has them.
    Numbers are fitted beside effects as they were fitted. Of two that go together the error of one
    has a part that is the other's: what it moves by with the other, times its error. A step is an
    error, or a fifth of the size where that is less.
    """
    known = [
        (own.effect, {**own.proposal.errors, **own.errors})
        for own in some
        if own.effect is not None and own.proposal is not None
    ]
    known += [(own.effect, {own.name: own.error}) for own in sized]
    off = [one for effect, errors in known for one in _off(state.camera, effect, errors)]
    if not off:
        return []
    cameras = [state.camera, *(camera for camera, _ in off)]
    # Each begins where the state's fit ended, which another round may still move.
    before, *after = side_by_side(partial(_fitted, state), cameras, state.setting.jobs)
    return [Beside(before, fit, steps) for fit, (_, steps) in zip(after, off, strict=True)]


def _fitted(state: State, camera: Camera) -> BaseFit:
    return state.setting.calibrated(camera, state.calibrated).fit


def _off(
    camera: Camera, effect: Effect, errors: Mapping[str, float]
) -> Iterator[tuple[Camera, float]]:
    """Yield cameras with one size of an effect off by a step, and how many its error is."""
    if effect not in camera.effect:
        return
    place = camera.effect.index(effect)
    for name, error in errors.items():
        value = getattr(effect, name, None)
        if not isinstance(value, float) or not error > 0 or not isfinite(error):
            continue
        step = min(error, _STEP * abs(value) or error)
        for side in _SIDES:
            try:
                other = type(effect)(**{**effect.model_dump(), name: value + side * step})
            except ValidationError:
                continue
            effects = (*camera.effect[:place], other, *camera.effect[place + 1 :])
            yield camera.model_copy(update={"effect": effects}), error / step
            break
