"""Which of the effects taken in the recording denies, and which the others make needless."""

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial, contradicted
from analysis.mismatch.displaced import displaced
from analysis.mismatch.edged import outlined
from analysis.mismatch.feigned import of_another
from analysis.mismatch.instance import LINES
from analysis.mismatch.named import Named
from analysis.mismatch.nopath import no_path
from analysis.mismatch.otherlags import alike
from analysis.mismatch.predict import Predictor
from analysis.mismatch.rank import LEAST_GAIN
from analysis.mismatch.resolved import carries, locates, resolved
from analysis.mismatch.standout import side_by_side
from analysis.mismatch.state import State
from analysis.mismatch.unmet import mirrored, unmet
from dsis.camera import Camera

Array = NDArray[np.float64]
LITTLE, NEEDLESS = "it would explain", "the others explain what it would explain"
NOTHING = "it explains nothing that differs for certain"
INSTEAD = "it takes the place of what"
_RESOLVED = 0.7  # share of what an effect touches that it must explain
_OF_TIME = frozenset({"dark_current", "rts"})  # what grows with time denies these, however little
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

    def denied(
        self, some: Sequence[Named], needed: Container[str] = frozenset()
    ) -> tuple[Named, str] | None:
        """Return the effect that the recording denies most, and why; None: it denies none.

        What takes the place of an effect that explains more than itself goes first, unless it is
        `needed`.
        """
        worst = self._worst(self._denial, some)
        if worst is None:
            return None
        weaker = self._in_place_of(worst[0], [one for one in some if one.name not in needed])
        return worst if weaker is None else (weaker, f"{INSTEAD} {worst[0].name} explains better")

    def _in_place_of(self, denied: Named, some: Sequence[Named]) -> Named | None:
        """Return the weakest effect without which the recording would not deny another.

        Each is judged beside the other: what is wrong itself explains little beside what is right.
        """
        if denied.proposal is None:
            return None
        most = self._predictor.worth(self._mean(denied))
        others = [n for n in some if n.proposal is not None and n.kind not in LINES]
        worths = {one.name: self._predictor.worth(self._mean(one)) for one in others}
        weaker = [one for one in others if worths[one.name] < most and one != denied]
        sure = self.state.predictor(max(self.nulls, self._predictor.replicates))
        for asked in (self._predictor, sure) if weaker else ():
            if self._shown(asked, denied, None):
                return None  # it is denied for something else
            weaker = [one for one in weaker if self._shown(asked, denied, one)]
        return min(weaker, key=lambda one: worths[one.name], default=None)

    def _shown(self, predictor: Predictor, named: Named, but: Named | None) -> bool:
        """Return whether statistics show what an effect predicts, were another not there."""
        another = None if but is None else self.without(but)
        without = self.without(named)
        return contradicted(self.state, predictor, named.kind, without, another) is None

    def _mean(self, named: Named) -> Array:
        return self._predictor.mean(self.without(named))

    def needless(self, some: Sequence[Named]) -> tuple[Named, str] | None:
        """Return the effect that explains least of what it changes, and why; None: all do."""
        return self._worst(self._needless, some)

    def denied_by_rest(
        self, some: Sequence[Named], first: frozenset[str]
    ) -> tuple[Named, str] | None:
        """Return the effect that is denied most by what is left, and why; None: none is.

        By what looks like it, by what calls for it, and where nothing did that differed at `first`.
        Lines, and telegraphs that were told so, are seen in whole frames besides.
        """
        left = {m.statistic for m in self.state.mismatches}
        asked = [
            one
            for one in some
            if one.kind not in LINES and not one.measured
            if left or one.kind in _OF_TIME or _hinted(one) or not _called(one, first)
        ]
        return self._worst(partial(self._left_open, first), asked)

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
        if named.measured:
            # What correlates pixels besides may hide it in numbers, not in frames.
            return _verdict(side_by_side(self.state, named.kind))
        if named.proposal is None:
            return self._of_path(predictor, named)
        without = self.without(named)
        denial = contradicted(self.state, predictor, named.kind, without)
        if denial is None:
            denial = of_another(self.state, named.proposal.effect, predictor.mean(without))
        return _verdict(denial)

    def _of_path(self, predictor: Predictor, named: Named) -> Verdict | None:
        """Return how a second read-out path is denied."""
        denial = displaced(self.state, named.kind, self.state.null.mean)
        return _verdict(denial or no_path(self.state, predictor.mean(self.without(named))))

    def _left_open(
        self, first: frozenset[str], predictor: Predictor, named: Named
    ) -> Verdict | None:
        if named.proposal is None:
            return self._of_path(predictor, named)
        mean = predictor.mean(self.without(named))
        denial = of_another(self.state, named.proposal.effect, mean)
        denial = denial or mirrored(self.state, named.proposal.effect, mean)
        denial = denial or alike(self.state, named.proposal.effect, mean)
        shown = outlined(self.state, named.proposal.effect)
        denial = denial or unmet(self.state, named.proposal.effect, mean, shown=shown)
        if denial is None and not (_called(named, first) or locates(self.state, mean)):
            return 1.0, NOTHING
        return _verdict(denial)

    def _needless(self, predictor: Predictor, named: Named) -> Verdict | None:
        if named.proposal is None:
            return None
        mean = predictor.mean(self.without(named))
        share = resolved(predictor, self.state, mean)
        if not named.measured and predictor.worth(mean) < LEAST_GAIN:
            return share, NEEDLESS
        # Where others have pixels that stand out, too, counts of them say whose they are.
        alone = named.of_pixels and predictor.counts.normal(mean)
        alone = alone or self._steps(named) or self._carries(named, mean)
        if share < _RESOLVED and not (named.measured or alone):
            return share, f"{LITTLE} {max(share, 0):.0%} of what it changes"
        if named.kind not in LINES and not locates(self.state, mean):  # frames show lines
            return 1.0, NOTHING
        return None

    def _steps(self, named: Named) -> bool:
        """Return whether an effect is the step between codes, and none is left unexplained.

        Shapes of noise that it rounds away hang on where in a step a level lies, which is hardly
        known; which codes occur does not.
        """
        if named.kind != "quantisation":
            return False
        return all(m.statistic != "code_spacing" for m in self.state.mismatches)

    def _carries(self, named: Named, without: Array) -> bool:
        """Return whether an effect is a residue, and all that follows codes is explained by it."""
        return named.kind == "adc_memory" and carries(self.state, without)


def _verdict(denial: Denial | None) -> Verdict | None:
    """Return a denial as a verdict."""
    return None if denial is None else (denial.share, denial.why)


def _hinted(named: Named) -> bool:
    """Return whether more than what calls for an effect leads to it."""
    return named.kind in CANDIDATES and bool(CANDIDATES[named.kind].hints)


def _called(named: Named, first: frozenset[str]) -> bool:
    """Return whether any of some statistics calls for an effect, or hints at it."""
    if named.kind not in CANDIDATES:
        return True
    own = CANDIDATES[named.kind]
    return not first.isdisjoint({*own.calls, *own.hints})
