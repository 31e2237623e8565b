"""What an effect needs to be diagnosed: statistics that call for it, parameters to start from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log

from pydantic import ValidationError

from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout
from dsis.effects import Effect, registry


@dataclass(frozen=True)
class Proposal:
    """An effect with parameters to start from.

    Attributes
    ----------
    effect
        The effect.
    free
        Its parameters that are fitted; others are fixed by the proposal.
    signed
        Those of them that may be negative: fitted as they are, others by their logarithm.
    errors
        Standard errors of parameters that the proposal has measured by itself.
    of_pixels
        What single pixels gain by the effect, nats, in place of counts of them; None: not asked.
    best_of
        How many were measured, of which this one explains most: one of its numbers says which.
    again
        An effect as it was measured anew beside this one, in place of the camera's own of its kind
        that had a part of this one; None: nothing was.
    """

    effect: Effect
    free: tuple[str, ...]
    signed: frozenset[str] = field(default_factory=frozenset)
    errors: Mapping[str, float] = field(default_factory=dict)
    of_pixels: float | None = None
    best_of: int = 1
    again: "Proposal | None" = None

    @property
    def price(self) -> float:
        """Nats that must be gained before anything is: chance gains them too.

        One for each number that the recording has chosen, or will; the log of how many the best
        was chosen of, in place of the number that says which.
        """
        numbers = len({*self.free, *self.errors})
        return numbers if self.best_of == 1 else numbers - 1 + log(self.best_of)


@dataclass(frozen=True)
class Candidate:
    """How one effect is recognised.

    Attributes
    ----------
    kind
        The effect.
    calls
        Statistics one of which must be off before the effect is tried.
    propose
        Gives proposals from the clues; empty: the effect cannot be what is seen.
    hints
        Further statistics that suffice for a trial, but need not show the effect.
    sane
        Whether a fitted effect is still one of its kind, and no stand-in for another.
    credited
        Effects that may have been credited with what this one explains: fitted with it.
    """

    kind: str
    calls: tuple[str, ...]
    propose: Callable[[Clues], Sequence[Proposal]]
    hints: tuple[str, ...] = ()
    sane: Callable[[Layout, Effect], bool] = lambda _layout, _effect: True
    credited: frozenset[str] = frozenset()


def measured(
    proposal: Proposal, values: Mapping[str, object], errors: Mapping[str, float]
) -> Proposal:
    """Return a proposal some of whose parameters were measured by themselves: fitted no more."""
    effect = type(proposal.effect)(**{**proposal.effect.model_dump(), **values})
    free = tuple(own for own in proposal.free if own not in values)
    return replace(proposal, effect=effect, free=free, errors={**proposal.errors, **errors})


def build(kind: str, **parameters: object) -> Effect | None:
    """Return an effect; None where its parameters are out of bounds."""
    try:
        return registry()[kind](**parameters)  # type: ignore[arg-type] # pydantic checks them
    except ValidationError:
        return None


def proposals(
    kind: str, free: Sequence[str], signed: Sequence[str] = (), **parameters: object
) -> list[Proposal]:
    """Return one proposal, or none where its parameters are out of bounds."""
    effect = build(kind, **parameters)
    if effect is None:
        return []
    return [Proposal(effect, tuple(free), frozenset(signed))]
