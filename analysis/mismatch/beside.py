"""How far the base model's numbers go with what is known of effects that are named beside them."""

from collections.abc import Iterator, Sequence
from functools import partial
from math import isfinite

from pydantic import ValidationError

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.model import side_by_side
from analysis.mismatch.named import Named
from analysis.mismatch.state import State
from dsis.camera import Camera


def fitted_beside(state: State, some: Sequence[Named]) -> list[BaseFit]:
    """Return the base numbers beside each size of named effects that is one standard error off.

    Numbers are fitted beside effects as they were fitted. Of two that go together the error of one
    has a part that is the other's: what it moves by with the other, times its error.
    """
    cameras = [camera for own in some for camera in _off(state.camera, own)]
    return side_by_side(partial(_fitted, state), cameras, state.setting.jobs)


def _fitted(state: State, camera: Camera) -> BaseFit:
    return state.setting.calibrated(camera, state.calibrated).fit


def _off(camera: Camera, named: Named) -> Iterator[Camera]:
    """Yield cameras with one size of an effect off by its error: above, or else below."""
    effect = named.effect
    if effect is None or effect not in camera.effect or named.proposal is None:
        return
    place = camera.effect.index(effect)
    values = effect.model_dump()
    for name, error in {**named.proposal.errors, **named.errors}.items():
        value = values.get(name)
        if not isinstance(value, float) or not error > 0 or not isfinite(error):
            continue
        for off in (value + error, value - error):
            try:
                other = type(effect)(**{**values, name: off})
            except ValidationError:
                continue
            effects = (*camera.effect[:place], other, *camera.effect[place + 1 :])
            yield camera.model_copy(update={"effect": effects})
            break
