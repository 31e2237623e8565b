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
_MOST = 700.0  # nats: beyond that odds are no numbers
_FARTHEST = 37.0  # standard errors: nor are chances
LEAST = -log(FAMILY)  # nats


@dataclass(frozen=True)
class Jumping:
    """What whole frames say of few pixels that jump.

    Attributes
    ----------
    mismatch
        That they do, as all frames show it.
    effect
        Their mean numbers, of frames that are not locked; None: these tell none.
    """

    mismatch: Mismatch
    effect: Rts | None = None

    @classmethod
    def of(cls, gain: float, exposures: Iterable[str]) -> "Jumping":
        """Return it from the logarithm of the odds that pixels jump, nats.

        Frames without such pixels have odds of x in 1 / x of recordings at most (Markov's
        inequality), if their noise has one of the laws that jumps are told from.
        """
        chance = exp(-gain)
        where, z = Where(exposures=tuple(exposures)), min(float(norm.isf(chance / 2)), _FARTHEST)
        says = (
            "A few pixels jump between two levels from frame to frame: whole frames show it at "
            f"odds of {exp(min(gain, _MOST)):.1g} to 1."
        )
        return cls(Mismatch(NAME, z, chance, where, says))

    def beside(
        self, found: tuple[Mismatch, ...], effects: Iterable[Effect]
    ) -> tuple[Mismatch, ...]:
        """Return what differs from a camera with some effects, the largest departure first."""
        if any(isinstance(one, Rts) for one in effects):
            return found
        return tuple(sorted((*found, self.mismatch), key=lambda m: -abs(m.z)))
