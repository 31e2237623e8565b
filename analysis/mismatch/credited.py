"""Effects that were credited with what another explains: both are fitted together.

Offsets that rows share are row noise too. Where white row noise was taken in first it has all of
their variance: beside it nothing that adds to that fits, until it gives some back. So have a filter
and charge that neighbours share what the other correlates, and a dark current the mean of a glow.
Hot pixels, taken in first, are too many where all dark currents differ.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, sqrt

from analysis.mismatch.apart import as_far_apart
from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.candidates.patterns import glowing
from analysis.mismatch.layout import Layout
from analysis.mismatch.named import Named, renewed
from analysis.mismatch.polish import with_effects
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.amp_glow import AmpGlow
from dsis.effects.hot_pixels import HotPixels

_SIGMA, _SHARE, _RATE = "sigma_dn", "fraction", "dn_per_s"
_MAY = frozenset(kind for own in CANDIDATES.values() for kind in own.credited)
_KEPT = 0.1  # of its size, that the credited effect keeps at least where a fit starts


def together(
    camera: Camera, proposal: Proposal, given: int, layout: Layout
) -> tuple[Camera, list[Proposal]]:
    """Return a camera, and what is fitted in it: a proposal, and what was credited with its part.

    The credited effect leaves the camera, and is proposed again with the variance, the share or the
    mean that the other leaves it. Where there is none the camera stays as it is, and so do its
    first effects, as many as are `given`: they are the user's. `layout` tells the mean of a glow.
    """
    place = _credited(camera, proposal.effect, given)
    if place is None:
        return camera, [proposal]
    credited = camera.effect[place]
    if isinstance(credited, HotPixels):
        own = proposal.again
        return (camera, [proposal]) if own is None else (_without(camera, place), [proposal, own])
    name = _size(credited)
    size, other = float(getattr(credited, name)), _part(proposal.effect, name, layout)
    left = sqrt(max(size**2 - other**2, 0.0)) if name == _SIGMA else size - other
    again = Proposal(_of_size(credited, name, max(left, _KEPT * size)), (name,))
    return _without(camera, place), [proposal, again]


def joined(camera: Camera, effects: Sequence[Effect], given: int) -> Camera | None:
    """Return a camera with what was fitted together; None where it cannot have it."""
    place = _credited(camera, effects[0], given) if len(effects) > 1 else None
    return with_effects(camera if place is None else _without(camera, place), effects)


def given_back(camera: Camera, effect: Effect, given: int, layout: Layout) -> Camera:
    """Return a camera without an effect in which what was credited has its part again.

    Variances add, and means: no effect is to gain what another would explain without it. Shares do
    not: of noise of light one has more of it, of all noise the other. Hot pixels stay as they are.
    """
    place = _credited(camera, effect, given)
    if place is None or isinstance(camera.effect[place], HotPixels):
        return camera
    credited = camera.effect[place]
    name = _size(credited)
    if name == _SHARE:
        return camera
    size, other = float(getattr(credited, name)), _part(effect, name, layout)
    again = _of_size(credited, name, hypot(size, other) if name == _SIGMA else size + other)
    effects = (*camera.effect[:place], again, *camera.effect[place + 1 :])
    return camera.model_copy(update={"effect": effects})


def kept_up(named: Sequence[Named], camera: Camera, given: int) -> list[Named]:
    """Return the effects named as a camera has them, in which one may have given some back.

    Or was measured again: then its errors are the new ones.
    """
    again = [one.proposal.again for one in named if one.proposal and one.proposal.again]
    return [
        _kept_up(one, camera.effect[given:], again) if one.kind in _MAY else one for one in named
    ]


def _kept_up(named: Named, effects: Sequence[Effect], again: Sequence[Proposal]) -> Named:
    same = [own for own in effects if own.kind == named.kind]
    if named.proposal is None or named.proposal.effect in same or len(same) != 1:
        return named
    anew = next((one for one in again if one.effect == same[0]), None)
    if anew is not None:
        return replace(named, proposal=anew, errors=dict(anew.errors))
    return renewed(named, named.proposal, same[0], named.errors)


def _credited(camera: Camera, effect: Effect, given: int) -> int | None:
    """Return which of the effects after the user's, the last one, may have an effect's part."""
    kinds = CANDIDATES[effect.kind].credited
    places = [i for i, own in enumerate(camera.effect) if i >= given and own.kind in kinds]
    return places[-1] if places else None


def _size(effect: Effect) -> str:
    """Return the name of the size of which an effect gives some back."""
    return next(name for name in (_SIGMA, _SHARE, _RATE) if hasattr(effect, name))


def _part(effect: Effect, name: str, layout: Layout) -> float:
    """Return what an effect has of a size; a glow of a dark current: the mean of the sensor."""
    size = float(getattr(effect, name))
    if isinstance(effect, AmpGlow):
        return size * float(
            glowing((layout.rows, layout.columns), effect.place, effect.extent).mean()
        )
    return size


def _of_size(effect: Effect, name: str, value: float) -> Effect:
    return as_far_apart(effect, type(effect)(**{**effect.model_dump(), name: value}))


def _without(camera: Camera, place: int) -> Camera:
    left = (*camera.effect[:place], *camera.effect[place + 1 :])
    return camera.model_copy(update={"effect": left})
