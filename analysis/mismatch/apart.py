"""How far apart dark currents are: by their standard deviation, which pixels show."""

from dataclasses import dataclass

from analysis.currentlaw import of_all
from analysis.mismatch.candidates.currents import current_spread_of, dark_rate
from analysis.mismatch.finding import ParameterError
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.dark_current import MOST_APART, DarkCurrent

_CLEAR = 3.0  # standard errors between two sizes that no chance sets apart
_CALLS = frozenset({"fixed_pixel_variance", "outlying_pixels"})


def as_far_apart(before: Effect | None, after: Effect) -> Effect:
    """Return a dark current of a new mean, its pixels as far apart in DN as before."""
    if not isinstance(before, DarkCurrent) or not isinstance(after, DarkCurrent):
        return after
    if (
        not (before.log_sigma and before.dn_per_s and after.dn_per_s)
        or after.log_sigma != before.log_sigma
    ):
        return after
    sigma = of_all(before.log_sigma, before.dn_per_s / after.dn_per_s)
    return after.model_copy(update={"log_sigma": min(sigma, MOST_APART)})


def known_at_once(effect: Effect) -> bool:
    """Return whether a proposal is as good as a fit until base numbers are fitted beside it.

    Of a dark current with a spread levels and pixels say all. Numbers fitted without it have a
    black level and variances between those of darks: beside them another mean may be likelier,
    from which, far from what levels say once they are fitted anew, no step leads back.
    """
    return isinstance(effect, DarkCurrent) and effect.log_sigma > 0


@dataclass(frozen=True)
class Apart:
    """How far apart dark currents of a user's camera are.

    Attributes
    ----------
    place
        Which of the camera's effects they are.
    model, recorded, error
        Standard deviation of their logarithm: the user's, and as recorded, with its error.
    """

    place: int
    model: float
    recorded: float
    error: float


def apart_of_users(state: State, users: Camera, before: Apart | None) -> Apart | None:
    """Return how far apart the dark currents of a user's camera are; None: as the user says.

    Or it has none, or nothing that grows with time calls for it. What was measured `before` is
    measured once more.
    """
    own = [(i, e) for i, e in enumerate(users.effect) if isinstance(e, DarkCurrent)]
    called = {m.statistic for m in state.mismatches} & _CALLS
    if len(own) != 1 or not called or not own[0][1].dn_per_s:
        return None
    (place, effect), clues = own[0], state.clues()
    rate = dark_rate(clues)
    spread = None if rate is None else current_spread_of(clues, rate)
    if rate is None or spread is None:
        return None
    sigma = min(of_all(spread.log_sigma, rate / effect.dn_per_s), MOST_APART)
    error = sigma * spread.error / spread.log_sigma
    model = effect.log_sigma if before is None else before.model
    return Apart(place, model, sigma, error) if abs(sigma - model) > _CLEAR * error else None


def with_apart(camera: Camera, apart: Apart) -> Camera:
    """Return a camera whose dark currents are as far apart as was recorded."""
    effects = list(camera.effect)
    own = effects[apart.place]
    effects[apart.place] = own.model_copy(update={"log_sigma": apart.recorded})
    return camera.model_copy(update={"effect": tuple(effects)})


def wrong_spread(apart: Apart | None, camera: Camera) -> tuple[ParameterError, ...]:
    """Return that dark currents are otherwise apart than a user's camera has them.

    `camera` has them of the mean that was fitted in the end, about which they may be as they were.
    """
    if apart is None:
        return ()
    own = camera.effect[apart.place]
    recorded = own.log_sigma if isinstance(own, DarkCurrent) else apart.recorded
    error = recorded * apart.error / apart.recorded
    if abs(recorded - apart.model) <= _CLEAR * error:
        return ()
    name = "effect.dark_current.log_sigma"
    return (ParameterError(name, apart.model, recorded, error),)
