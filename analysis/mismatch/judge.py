"""Which of the effects taken in the recording denies, and which the others make needless."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from analysis.mismatch.contradicted import contradicted
from analysis.mismatch.feigned import of_another
from analysis.mismatch.named import Named
from analysis.mismatch.predict import Predictor
from analysis.mismatch.rank import LEAST_GAIN
from analysis.mismatch.resolved import resolved
from analysis.mismatch.state import State
from dsis.camera import Camera

LITTLE, NEEDLESS = "it would explain", "the others explain what it would explain"
_RESOLVED = 0.7  # share of what an effect touches that it must explain
Verdict = tuple[float, str]
"""The share that an effect explains of what it changes, and why that is too little."""


@dataclass(frozen=True)
class Judge:
    """Judges the effects of one state.

    Attributes
    ----------
    state
        With all effects.
    without
        Gives the state's camera without one of them.
    nulls
        Simulations that are asked before an effect is judged badly.
    """

    state: State
    without: Callable[[Named], Camera]
    nulls: int

    def denied(self, some: Sequence[Named]) -> tuple[Named, str] | None:
        """Return the effect that the recording denies most, and why; None: it denies none."""
        return self._worst(self._denial, some)

    def needless(self, some: Sequence[Named]) -> tuple[Named, str] | None:
        """Return the effect that explains least of what it changes, and why; None: all do."""
        return self._worst(self._needless, some)

    @cached_property
    def _predictor(self) -> Predictor:
        return self.state.predictor()

    def _worst(
        self, judged: Callable[[Predictor, Named], Verdict | None], some: Sequence[Named]
    ) -> tuple[Named, str] | None:
        """Return the effect that is judged worst, and why.

        A few simulated recordings may show next to nothing of what one number a frame does: what
        they judge badly is judged once more by as many as a null takes.
        """
        predictor = self._predictor
        predictor.ready(self.without(named) for named in some)
        found = []
        for named in some:
            verdict = judged(predictor, named)
            if verdict is not None and self.nulls > predictor.replicates:
                verdict = judged(self.state.predictor(self.nulls), named)
            if verdict is not None:
                found.append((verdict[0], named, verdict[1]))
        worst = min(found, key=lambda one: one[0], default=None)
        return None if worst is None else worst[1:]

    def _denial(self, predictor: Predictor, named: Named) -> Verdict | None:
        without = self.without(named)
        denial = contradicted(self.state, predictor, named.kind, without)
        if denial is None and named.proposal is not None:
            denial = of_another(self.state, named.proposal.effect, predictor.mean(without))
        return None if denial is None else (denial.share, denial.why)

    def _needless(self, predictor: Predictor, named: Named) -> Verdict | None:
        if named.proposal is None:
            return None
        mean = predictor.mean(self.without(named))
        share = resolved(predictor, self.state, mean)
        if predictor.worth(mean) < LEAST_GAIN:
            return share, NEEDLESS
        if share < _RESOLVED:
            return share, f"{LITTLE} {max(share, 0):.0%} of what it changes"
        return None
