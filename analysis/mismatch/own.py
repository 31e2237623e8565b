"""Sizes of the effects that the user's camera has: they may be wrong, which is no omitted physics.

A size counts as wrong where another is clearly likelier, and more than chance away from it.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import hypot, inf, sqrt

from pydantic import ValidationError

from analysis.mismatch.apart import as_far_apart
from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.finding import Mismatch, ParameterError
from analysis.mismatch.named import SHAPES
from analysis.mismatch.polish import polish, with_effects
from analysis.mismatch.predict import Predictor
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import LEAST_GAIN
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect

_CLEAR = 3.0  # standard errors between two sizes that no chance sets apart
_ROUNDS = 6  # of a fit, at most
_FEW_ROUNDS = 2  # where simulations take long: all is fitted again in the end
_FALLEN = 0.5  # of a size, below which it may be none: a fit of a logarithm hardly gets there
_LEFT = 0.5  # of a departure may be left where a size explains it
_LITTLE = 1e-3  # of a size: as good as none


@dataclass(frozen=True)
class Own:
    """One effect of the user's camera, whose size is fitted.

    Attributes
    ----------
    place
        Which of the camera's effects it is.
    name
        The parameter that is its size.
    model
        Its value as the user wrote it.
    effect
        As it is now.
    gain
        Log-likelihood of the bank's numbers that the new size is worth beside the user's.
    errors
        Standard error of the size, by its name.
    """

    place: int
    name: str
    model: float
    effect: Effect
    gain: float = 0.0
    errors: dict[str, float] = field(default_factory=dict)

    @property
    def value(self) -> float:
        """Its size."""
        return float(getattr(self.effect, self.name))

    @property
    def users(self) -> "Own":
        """The effect as the user wrote it; of dark currents as far apart in DN as they are."""
        effect = _of_size(self.effect, self.name, self.model) or self.effect
        return replace(self, effect=effect if self._none else as_far_apart(self.effect, effect))

    @property
    def proposal(self) -> Proposal:
        """The effect with its size free, unless that has vanished."""
        if self._none:
            return Proposal(self.effect, ())
        signed = _of_size(self.effect, self.name, -self.value) is not None
        return Proposal(self.effect, (self.name,), frozenset({self.name} if signed else ()))

    @property
    def _none(self) -> bool:
        return abs(self.value) <= _LITTLE * abs(self.model)

    @property
    def error(self) -> float:
        """Standard error of the size; of one that may as well be none, as likelihoods say it.

        What is drawn at random shows by its square: from none to the limit is no straight line.
        """
        fitted = self.errors.get(self.name, inf)
        if _CLEAR * fitted < abs(self.value) or self.gain <= 0:
            return fitted
        away = sqrt(2 * self.gain)
        if not self.effect.draws:
            return min(fitted, abs(self.model - self.value) / away)
        square = abs(self.model**2 - self.value**2) / away
        return min(fitted, sqrt(self.value**2 + square) - abs(self.value))

    @property
    def contradicted(self) -> bool:
        """Whether the recording contradicts the user's size."""
        return abs(self.value - self.model) > _CLEAR * self.error

    def like(self, effect: Effect) -> bool:
        """Return whether an effect is the same but for its size and its shape."""
        free = {self.name, *SHAPES}
        return effect.kind == self.effect.kind and effect.model_dump(
            exclude=free
        ) == self.effect.model_dump(exclude=free)

    @property
    def vanished(self) -> "Own":
        """The effect of a size that is as good as none."""
        effect = _of_size(self.effect, self.name, _LITTLE * self.model)
        return replace(self, effect=effect or self.effect, errors={})

    def fell_from(self, before: Effect) -> bool:
        """Return whether the effect is less than half of what it was, and not gone."""
        size = abs(float(getattr(before, self.name)))
        return not self._none and abs(self.value) < _FALLEN * size

    def beside(self, effect: Effect) -> "Own":
        """Return the effect as large as itself and another together: where a fit starts from."""
        more = float(getattr(effect, self.name))
        size = hypot(self.value, more) if effect.draws else self.value + more
        return replace(self, effect=_of_size(self.effect, self.name, size) or self.effect)


def sizes(camera: Camera) -> tuple[Own, ...]:
    """Return the effects of a camera that have one size, each the only one of its kind."""
    kinds = [effect.kind for effect in camera.effect]
    found = []
    for place, effect in enumerate(camera.effect):
        name = _size(effect)
        if name is not None and effect.kind in CANDIDATES and kinds.count(effect.kind) == 1:
            found.append(Own(place, name, float(getattr(effect, name)), effect))
    return tuple(found)


def _size(effect: Effect) -> str | None:
    """Return the parameter that is an effect's size; None: it has none, or is none."""
    fields = type(effect).model_fields.items()
    needed = [
        name
        for name, own in fields
        if own.is_required() and own.annotation is float and name not in SHAPES
    ]
    if len(needed) != 1:
        return None
    little = _of_size(effect, needed[0], _LITTLE * float(getattr(effect, needed[0])))
    return None if little is None else needed[0]


def _of_size(effect: Effect, name: str, value: float) -> Effect | None:
    """Return an effect of another size; None where it is out of bounds."""
    try:
        return type(effect)(**{**effect.model_dump(), name: value})
    except ValidationError:
        return None


def called(some: Iterable[Own], mismatches: Iterable[Mismatch]) -> list[Own]:
    """Return the effects that mismatches call for."""
    off = {m.statistic for m in mismatches}
    return [own for own in some if own.value and off & set(CANDIDATES[own.effect.kind].calls)]


def explained(some: Iterable[Own], before: State, after: State) -> bool:
    """Return whether each of some sizes leaves less than half of what called for it."""
    then, now = ({m.statistic: abs(m.z) for m in one.mismatches} for one in (before, after))
    for own in some:
        calls = [s for s in CANDIDATES[own.effect.kind].calls if s in then]
        if calls and all(now.get(s, 0.0) > _LEFT * then[s] for s in calls):
            return False
    return True


def eased(statistics: Collection[str], before: State, after: State) -> bool:
    """Return whether less than half is left of the farthest that any of some statistics is off."""
    then, now = (
        max((abs(m.z) for m in one.mismatches if m.statistic in statistics), default=0.0)
        for one in (before, after)
    )
    return now <= _LEFT * then


def resized(camera: Camera, some: Iterable[Own]) -> Camera:
    """Return a camera whose own effects have the sizes of some."""
    effects = list(camera.effect)
    for own in some:
        effects[own.place] = own.effect
    return camera.model_copy(update={"effect": tuple(effects)})


def without_own(camera: Camera, some: Iterable[Own]) -> Camera:
    """Return a camera without some of its own effects."""
    places = {own.place for own in some}
    left = tuple(e for i, e in enumerate(camera.effect) if i not in places)
    return camera.model_copy(update={"effect": left})


def refitted(state: State, some: Sequence[Own]) -> list[Own]:
    """Return those of the state's own effects whose size the recording contradicts, fitted.

    All are fitted together, and again without the one that gains least, as long as there is one
    whose size may be the user's.
    """
    left = list(some)
    count = replicates_for(state.setting, [own.effect for own in some])
    predictor = state.predictor(count)
    rounds = _FEW_ROUNDS if state.setting.large else _ROUNDS
    while left:
        bare = without_own(state.camera, left)
        polished = polish(predictor, bare, [own.proposal for own in left], rounds)
        if polished is None:
            break
        fitted = [
            replace(own, effect=effect, errors=errors)
            for own, effect, errors in zip(left, polished.effects, polished.errors, strict=True)
        ]
        loglik = polished.loglik
        for i, own in enumerate(fitted):
            if abs(own.value) < _FALLEN * abs(own.model):
                none = _loglik(predictor, bare, fitted, i, own.vanished)
                if none > loglik:
                    fitted[i], loglik = own.vanished, none
        gained = [
            replace(own, gain=loglik - _loglik(predictor, bare, fitted, i, own.users))
            for i, own in enumerate(fitted)
        ]
        doubtful = [own for own in gained if own.gain < LEAST_GAIN or not own.contradicted]
        if not doubtful:
            return gained
        least = min(doubtful, key=lambda own: own.gain)
        left = [own for own in left if own.place != least.place]
    return []


def _loglik(
    predictor: Predictor, bare: Camera, some: Sequence[Own], which: int, other: Own
) -> float:
    """Return the log-likelihood of the recorded numbers with one of some effects otherwise."""
    effects = [other.effect if i == which else own.effect for i, own in enumerate(some)]
    camera = with_effects(bare, effects)
    return -inf if camera is None else predictor.loglik(predictor.mean(camera))


def wrong_sizes(some: Iterable[Own]) -> tuple[ParameterError, ...]:
    """Return the sizes of the camera's own effects that the recording contradicts."""
    return tuple(
        ParameterError(f"effect.{own.effect.kind}.{own.name}", own.model, own.value, own.error)
        for own in some
    )
