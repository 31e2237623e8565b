"""What a search has taken in, and cameras without it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log1p

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.instance import LINES, instance
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.shading import Shading

_OF_FRAMES = LINES | {"rts"}
APART = 1.96  # standard errors of a size whose interval of 95 % reaches none
_CLEAR = 3.0  # standard errors of an effect's size that is no chance
SHAPES = frozenset(
    {
        "length_pixels",
        "gain_length_pixels",
        "length_rows",
        "at_code",
        "period_codes",
        "full_well_dn",
        "softness_dn",
        "spread_percent",
        "exponent",
        "seam",
        "anisotropy",
        "diagonal",
        "extent",
    }
)
# A bend is named by its size at full scale: levels below know that no better than its exponent.
_FAR_FROM_LEVELS = {"percent_full_scale": "exponent"}


Plain = tuple[Effect, dict[str, float]]
"""An effect of a plain shape, and standard errors of its sizes."""


@dataclass(frozen=True)
class Named:
    """An effect taken in.

    Attributes
    ----------
    kind
        Its name; `dual_gain` is a second read-out segment.
    proposal
        The effect with its free parameters; None for `dual_gain`.
    errors
        Standard errors of the parameters.
    gain
        Log-likelihood of the bank's numbers that it is worth beside the others.
    rivals
        Other effects tried in its place: kind, and by how much they were worse.
    switch_dn
        Of a second read-out segment.
    plain
        The effect with its errors as it is without a shape that may as well be none: see
        `uncertainty.settled`.
    """

    kind: str
    proposal: Proposal | None
    errors: dict[str, float]
    gain: float
    rivals: tuple[tuple[str, float], ...]
    switch_dn: float = float("nan")
    plain: Plain | None = None

    @property
    def effect(self) -> Effect | None:
        """The effect; None: it is a second read-out segment."""
        return None if self.proposal is None else self.proposal.effect

    @property
    def name(self) -> str:
        """Its kind, and of a line its frequency, of a decay its edge: there may be several."""
        return instance(self.kind, self.effect)

    @property
    def measured(self) -> bool:
        """Whether frames show it by themselves: lines, telegraphs, light of a measured shape."""
        own = self.proposal
        shown = self.kind in _OF_FRAMES or self.light is not None
        return shown and own is not None and not own.free

    @property
    def light(self) -> Shading | None:
        """The light of flats as it was measured; None: it is none."""
        effect = self.effect
        return effect if isinstance(effect, Shading) and effect.field else None

    @property
    def of_pixels(self) -> bool:
        """Whether single pixels show it: what numbers have of few scatters like themselves."""
        return self.proposal is not None and self.proposal.of_pixels is not None


def unclear(named: Named, *, at_random: bool = False) -> str:
    """Return why an effect is not told from none by its own size; empty: it is.

    Asked of what draws nothing at random, whose size is known as a mean is; of the rest only
    where `at_random`, and only whether the interval of 95 % reaches none. Where an error is
    unknown, or is that of a shape which is sure itself, nothing is said. What is sure of a `plain`
    shape is there, whatever else its shape may be.
    """
    effect = named.effect
    if named.proposal is None or effect is None or effect.draws > at_random:
        return ""
    if named.plain is not None and not unclear(_plain(named, *named.plain), at_random=at_random):
        return ""
    clear = APART if effect.draws else _CLEAR
    sizes = {
        name: own
        for name, own in _sizes(named).items()
        if not _sure(named, effect, _FAR_FROM_LEVELS.get(name, ""))
    }
    signed = named.proposal.signed
    if not sizes or any(
        not isfinite(error) or _errors_of(value, error, signed=name in signed) > clear
        for name, (value, error) in sizes.items()
    ):
        return ""
    return f"its size is less than {clear:g} of its standard errors ({_said(sizes)})"


def _plain(named: Named, effect: Effect, errors: dict[str, float]) -> Named:
    """Return an effect of a plain shape: of its parameters those are free that have an error."""
    proposal = (
        None
        if named.proposal is None
        else replace(named.proposal, effect=effect, free=tuple(errors))
    )
    return replace(named, proposal=proposal, errors=errors, plain=None)


def _errors_of(value: float, error: float, *, signed: bool) -> float:
    """Return how many standard errors a size is from none.

    Of its logarithm, where that is fitted: the error reaches to the farther end of its interval.
    """
    if not error > 0:
        return inf if value else 0.0
    if signed:
        return abs(value) / error
    return APART / log1p(APART * error / abs(value)) if value else 0.0


def _sure(named: Named, effect: Effect, shape: str) -> bool:
    """Return whether a shape was fitted, and is known."""
    fitted = named.proposal is not None and shape in named.proposal.free
    return fitted and abs(float(getattr(effect, shape))) > _CLEAR * named.errors.get(shape, inf)


def renewed(named: Named, proposal: Proposal, effect: Effect, errors: dict[str, float]) -> Named:
    """Return an effect named with other parameters and their errors."""
    return replace(
        named,
        proposal=replace(proposal, effect=effect),
        errors=errors,
    )


def camera_without(camera: Camera, effects: Sequence[Effect], given: Camera) -> Camera:
    """Return a camera without some of its effects; those that the user's camera has stay."""
    left = list(camera.effect)
    for effect in effects:
        for i in range(len(left) - 1, len(given.effect) - 1, -1):
            if left[i] == effect:
                del left[i]
                break
    return camera.model_copy(update={"effect": tuple(left)})


def vague(named: Named, errors: float = 1.0, *, unknown: bool = False) -> str:
    """Return why an effect that draws at random has no size; empty: one exceeds so many errors.

    Where the error of one is not known nothing is said, unless what is `unknown` counts as none.
    """
    sizes = _sizes(named)
    if not sizes or any(
        abs(value) >= errors * error if isfinite(error) else not unknown
        for value, error in sizes.values()
    ):
        return ""
    times = "" if errors == 1 else f"{errors:g} times "
    return f"no size of it exceeds {times}its standard error ({_said(sizes)})"


def told_by_itself(named: Named) -> bool:
    """Return whether a size is away from none by 1.96 errors of what was fitted, its logarithm.

    Of few frames the size is never known well, however clear it is that they wander: 1.96 of its
    own errors reach to the farther end of its interval.
    """
    signed = () if named.proposal is None else named.proposal.signed
    return any(
        isfinite(error) and _errors_of(value, error, signed=name in signed) >= APART
        for name, (value, error) in _sizes(named).items()
    )


def _sizes(named: Named) -> dict[str, tuple[float, float]]:
    """Return free sizes, which are no shapes, and their errors; infinite: not known."""
    effect, own = named.effect, named.proposal
    if effect is None or own is None:
        return {}
    return {
        name: (float(getattr(effect, name)), named.errors.get(name, inf))
        for name in own.free
        if name not in SHAPES
    }


def _said(sizes: Mapping[str, tuple[float, float]]) -> str:
    return ", ".join(
        f"{name.replace('_', ' ')} {value:.3g} ± {error:.2g}"
        for name, (value, error) in sizes.items()
    )
