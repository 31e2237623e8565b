"""Pixels that jump, as whole frames show them: what differs, though no number of the bank does."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import exp, log

from scipy.stats import norm

from analysis.mismatch.finding import Mismatch, Where
from analysis.mismatch.locate import FAMILY
from dsis.effects import Effect
from dsis.effects.rts import Rts

NAME = "jumping_pixels"
_MOST = 37.0  # standard errors: beyond that chances are no numbers
LEAST = -log(FAMILY)  # nats


@dataclass(frozen=True)
class Jumping:
    """What whole frames say of few pixels that jump.

    Attributes
    ----------
    mismatch
        That they do.
    effect
        The most likely numbers.
    """

    mismatch: Mismatch
    effect: Rts

    @classmethod
    def of(cls, gain: float, effect: Rts, exposures: Iterable[str]) -> "Jumping":
        """Return it from the logarithm of the odds that pixels jump, nats.

        Frames without such pixels have odds of x in 1 / x of recordings at most (Markov's
        inequality).
        """
        chance = exp(-gain)
        where, z = Where(exposures=tuple(exposures)), min(float(norm.isf(chance / 2)), _MOST)
        says = (
            "A few pixels jump between two levels from frame to frame: "
            f"whole frames show it at {z:.3g} standard errors."
        )
        return cls(Mismatch(NAME, z, chance, where, says), effect)

    def beside(
        self, found: tuple[Mismatch, ...], effects: Iterable[Effect]
    ) -> tuple[Mismatch, ...]:
        """Return what differs from a camera with some effects, the largest departure first."""
        if any(isinstance(one, Rts) for one in effects):
            return found
        return tuple(sorted((*found, self.mismatch), key=lambda m: -abs(m.z)))
