"""How far apart dark currents are: by their standard deviation, which pixels show."""

from analysis.currentlaw import Spread, of_all
from analysis.mismatch.candidates.currents import current_spread_of, dark_rate
from analysis.mismatch.finding import ParameterError
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.dark_current import DarkCurrent

_MOST = 3.0  # that the effect allows
_CALLS = frozenset({"fixed_pixel_variance", "outlying_pixels"})


def as_far_apart(before: Effect | None, after: Effect) -> Effect:
    """Return a dark current of a new mean, its pixels as far apart in DN as before."""
    if not isinstance(before, DarkCurrent) or not isinstance(after, DarkCurrent):
        return after
    if not (before.log_sigma and after.dn_per_s) or after.log_sigma != before.log_sigma:
        return after
    sigma = of_all(before.log_sigma, before.dn_per_s / after.dn_per_s)
    return after.model_copy(update={"log_sigma": min(sigma, _MOST)})


def known_at_once(effect: Effect) -> bool:
    """Return whether a proposal is as good as a fit until base numbers are fitted beside it.

    Of a dark current with a spread levels and pixels say all. Numbers fitted without it have a
    black level and variances between those of darks: beside them another mean may be likelier,
    from which, far from what levels say once they are fitted anew, no step leads back.
    """
    return isinstance(effect, DarkCurrent) and effect.log_sigma > 0


def spread_of_users(state: State, users: Camera, *, again: bool) -> tuple[int, Spread] | None:
    """Return how far apart the dark currents are that a user's camera has alike, and its place.

    None: it has none, or has them apart itself, or nothing that grows with time calls for it.
    `again`: what was measured before is measured once more.
    """
    own = [(i, e) for i, e in enumerate(users.effect) if isinstance(e, DarkCurrent)]
    called = {m.statistic for m in state.mismatches} & _CALLS
    if len(own) != 1 or not called or (own[0][1].log_sigma and not again):
        return None
    clues = state.clues()
    rate = dark_rate(clues)
    spread = None if rate is None else current_spread_of(clues, rate)
    return None if spread is None else (own[0][0], spread)


def with_spread(camera: Camera, place: int, sigma: float) -> Camera:
    """Return a camera one of whose dark currents is so far apart."""
    effects = list(camera.effect)
    effects[place] = effects[place].model_copy(update={"log_sigma": sigma})
    return camera.model_copy(update={"effect": tuple(effects)})


def wrong_spreads(spread: Spread | None) -> tuple[ParameterError, ...]:
    """Return that dark currents differ which a user's camera has alike."""
    if spread is None:
        return ()
    name = "effect.dark_current.log_sigma"
    return (ParameterError(name, 0.0, spread.log_sigma, spread.error),)
