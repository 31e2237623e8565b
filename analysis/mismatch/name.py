"""Which physics explains the mismatches: add the best effect, fit all again, look again."""

from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, measured
from analysis.mismatch.clues import NO_LINE
from analysis.mismatch.codegain import gain_by_codes
from analysis.mismatch.contradicted import refuted
from analysis.mismatch.credited import joined, kept_up
from analysis.mismatch.displaced import displaced
from analysis.mismatch.fitted import WEAK, Fitted
from analysis.mismatch.forgiving import to_forgive
from analysis.mismatch.forms import in_form
from analysis.mismatch.instance import LINES, Frequency, frequency_of, instance
from analysis.mismatch.instep import in_step
from analysis.mismatch.judge import INSTEAD, NEEDLESS, NOTHING, Judge
from analysis.mismatch.memory import Memory
from analysis.mismatch.named import Named
from analysis.mismatch.phase import ABSENT, WholeFrames
from analysis.mismatch.polish import with_effects
from analysis.mismatch.rank import (
    LEAST_GAIN,
    SURE_CHANCE,
    SURE_GAIN,
    TOLD_APART,
    Ranked,
    behind,
    ranked,
    replicates_for,
)
from analysis.mismatch.resolved import differ, gained, opened
from analysis.mismatch.rowtold import AS_WELL, as_shown, unlike_frames
from analysis.mismatch.segments import Path, spiky
from analysis.mismatch.state import State
from analysis.mismatch.ties import akin, bends_as_well, by_numbers, plainest, ties, twin
from dsis.camera import Camera
from dsis.effects import Effect

Array = NDArray[np.float64]
_MOST_EFFECTS = 20  # some may have to go again
_CHOSEN = frozenset({"adc_memory", "dual_gain"})  # a period, a gap between levels
_MOST_LINES = 5  # further ones stay unexplained, located
_ROUNDS, _FEW_ROUNDS = 6, 3  # of a search that goes on; of a large recording
_FORGIVING = 2  # rounds after which what was dropped may come back


@dataclass
class Search(Fitted):
    """The search from a base state; `run` leaves the result in the attributes."""

    refused: dict[str, str] = field(default_factory=dict)
    tied: dict[str, Ranked | Path] = field(default_factory=dict)
    doubted: dict[str, str] = field(default_factory=dict)
    apart: list[Array] = field(default_factory=list)  # what one of two makes that frames show
    settled: list[tuple[str, Frequency]] = field(default_factory=list)
    absent: set[Frequency] = field(default_factory=set)  # peaks that were no line
    lines: WholeFrames | None = None  # of all frames of a small recording
    measuring: WholeFrames | None = None  # of those that are not locked
    memory: Memory = field(default_factory=Memory)
    least: float = SURE_GAIN  # for an effect to be taken in
    asked: tuple[State, State] | None = None  # with what differs in all frames, and without

    def run(self) -> State:
        """Return the final state."""
        return self.further(self.lit(self.base), again=bool(self.named))

    def begun(self, state: State) -> State:
        """Return the state with what is strong: parameters are fitted, and all is judged, later."""
        return self._sought(self.lit(state), strong=True)

    def resumed(self, state: State) -> State:
        """Return the final state of a search that goes on with more frames than before.

        What too few frames denied may be proposed again. What is chosen among many, which more
        frames tell better, is looked for once more, and everything fitted once more.
        """
        self.memory, self.refused, self.tied, self.sized = Memory(), {}, {}, set()
        state = self.lit(state)
        for named in [n for n in self.named if n.kind in _CHOSEN]:
            self.named.remove(named)
            bare = self.without(state, named)
            state = State.of(self.setting, bare, self.step, draft=True, near=state)
        lines = [frequency_of(n.proposal.effect) for n in self.named if n.proposal is not None]
        self.settled = [(kind, f) for f in lines if f is not None for kind in sorted(LINES)]
        self.rough = bool(self.named)
        return self.further(state, again=bool(self.named))

    def further(self, state: State, *, again: bool = False) -> State:
        """Return the final state of a search that goes on from one.

        What was dropped had hidden something: it is looked for once more. An effect that explained
        some of what it changes, beside others or without them, may come back, once. What differs
        only since all was fitted together, or in all frames, is looked for as well. `again`: what
        is named is judged even where nothing is added.
        """
        forgiven: dict[str, str] = {}
        dropped: list[Named] = []
        for number in range(_FEW_ROUNDS if self.setting.large else _ROUNDS):
            known = len(self.named)
            state = self._sought(state)
            if len(self.named) == known and not again:
                break
            again = False
            sought = state.mismatches
            state = self._polished(state)
            taken = list(self.named)
            state = self._asked_of_all(self._pruned(state))
            kept = {one.name for one in self.named}
            dropped += [one for one in taken if one.name not in kept]
            gone = any(one.name not in kept for one in taken)
            if not (gone or differ(sought, state.mismatches)) or not state.mismatches:
                break
            left = [one for one in dropped if one.name not in forgiven]
            forgiven |= self._forgiven(left) if number < _FORGIVING else {}
        gone_on = sorted(forgiven.keys() - {one.name for one in self.named})
        self.refused |= self.doubted | {name: forgiven[name] for name in gone_on}
        return state

    def _asked_of_all(self, state: State) -> State:
        """Return the state with what differs in all frames of a small recording beside its camera.

        Whether something differs is asked of all frames, what it is of those that are not locked:
        effects are judged by the state without, see `_pruned`.
        """
        if self.whole is None:
            return state
        asked = self.named or self.own  # else it was asked before
        off = self.of_all(state.camera) if asked else self.base
        seen = replace(state, mismatches=off.mismatches)
        self.polished = seen if self.polished is state else self.polished
        self.asked = (seen, state)
        return seen

    def _forgiven(self, dropped: Sequence[Named]) -> dict[str, str]:
        """Let effects be proposed again, see `to_forgive`, and return why they went."""
        found = {}
        for one in to_forgive(self.refused, dropped, self.named):
            found[one.name] = self.refused.pop(one.name)
            line = frequency_of(one.effect)
            self.settled = [own for own in self.settled if own != (one.kind, line)]
        return found

    def _sought(self, state: State, *, strong: bool = False) -> State:
        """Return the state with every effect that the search takes in; of those that are `strong`.

        What is like an effect of the camera is no second one: the size of that is fitted again. So
        are, where nothing more is found, sizes that mismatches call for, and before that those of
        which a recording shows less than the model: what stands in for less is soon wrong.
        """
        while state.mismatches and len(self.named) < _MOST_EFFECTS:
            added = self._best(state)
            again = None if added is None else self._own(added[0])
            if again is not None:
                state = self._resized(state, [again])
                continue
            least = 0.0 if added is None else added[0].gain
            later = strong or (self.setting.large and least >= WEAK)  # simulations take long
            some = [] if later else self._called(state, less=added is not None)
            sized = self._resized(state, some, least) if some else state
            if sized is not state:
                rough = self.setting.large and self.rough and added is not None and least < WEAK
                state = self._polished(sized) if rough else sized
                continue
            if added is None:
                break
            if self._feigned(state, added[0].gain):
                state, before = self._polished(state), state
                if state is not before:
                    continue
            self._take(added[0])
            self.named = kept_up(self.named, added[1], self.setting.given)
            self.rough |= added[0].gain >= WEAK
            state = State.of(self.setting, added[1], self.step, draft=True, near=state)
        if not state.mismatches:
            self.ties = []  # what was undecided on the way is explained
            self.doubted = {}
        return state

    def _take(self, named: Named) -> None:
        self.named.append(named)
        self.sized = set()
        if (line := frequency_of(named.effect)) is not None:
            self.settled += [(kind, line) for kind in sorted(LINES)]

    def _refuse(self, kind: str, effect: Effect | None, why: str) -> None:
        self.refused[instance(kind, effect)] = why
        if (line := frequency_of(effect)) is not None:
            self.settled.append((kind, line))

    def drop(self, state: State, named: Named, why: str) -> State:
        """Return the state without an effect, which is refused from now on."""
        bare = State.of(self.setting, self.without(state, named), self.step, near=state)
        return self._asked_of_all(self._dropped(bare, named, why))

    def _dropped(self, bare: State, named: Named, why: str) -> State:
        self._refuse(named.kind, named.effect, why)
        self.named.remove(named)
        self.named = kept_up(self.named, bare.camera, self.setting.given)
        self.memory.gains.clear()  # what it hid may gain more than before
        self.sized = set()
        return bare

    def considered(self, undecided: Container[str]) -> tuple[str, ...]:
        """Return in words what was not named, and why; not what is `undecided`."""
        said = [
            f"Considered and not named: {name}: {why}."
            for name, why in self.refused.items()
            if name not in undecided
        ]
        if self.absent:
            said.append(f"Looked at and no line: {len(self.absent)} peak(s): {ABSENT}.")
        return tuple(said)

    def _best(self, state: State) -> tuple[Named, Camera] | None:
        """Return the effect that explains most, and the camera with it."""
        left = self._left()
        off = {m.statistic for m in state.mismatches}
        path = self.path(state) if "dual_gain" in left and "pixel_variance" in off else None
        silent = spiky(state, path)  # its variances say nothing yet, unless there is nothing else
        fitted = self._decided(state, None if silent else path)
        if (fitted and silent) or any(pair[1] is path for pair in self.ties):
            path = None
        most = fitted[0].gain if fitted else 0.0
        fits = [one for pair in self.ties for one in pair if one.kind in CANDIDATES]
        bent = [one.gain for one in fits if "pixel_variance" in CANDIDATES[one.kind].calls]
        tied = max(bent, default=0.0)
        if path is not None and path.gain > max(self.least, most, tied):
            rivals = behind(path.kind, path.gain, fitted)
            error = {"switch_dn": path.error_dn}
            found = Named(path.kind, None, error, path.gain, rivals, path.switch_dn)
            return found, path.camera
        if not fitted or most < self._least(state, fitted[0].kind):
            return None
        best = fitted[0]
        camera = joined(state.camera, best.polished.effects, self.setting.given)
        rivals = behind(best.kind, best.gain, fitted[1:])
        if path is not None:
            rivals = (*rivals, ("dual_gain", best.gain - path.gain))
        proposal = replace(best.proposal, effect=best.polished.effects[0])
        errors = best.polished.errors[0]
        known = None if self.measuring is None else self.measuring.measured(proposal.effect)
        if known is not None:  # better than from the heights of peaks, or sums over pixels
            proposal = measured(proposal, *known)
            errors = dict(proposal.errors)
            camera = with_effects(state.camera, [proposal.effect])
        named = Named(best.kind, proposal, errors, best.gain, rivals)
        return None if camera is None else (named, camera)

    def _least(self, state: State, kind: str) -> float:
        """Return the gain from which an effect is taken in: at odds of 20 against none.

        Of all kinds of the vocabulary; where what calls for it is sure, of those that this calls
        for. Less for lines: whole frames show them besides.
        """
        if self.least > SURE_GAIN:
            return self.least
        if kind in LINES:
            return LEAST_GAIN
        sure = {m.statistic for m in state.mismatches if m.p_adjusted < SURE_CHANCE}
        if not sure.intersection(CANDIDATES[kind].calls):
            return self.least
        rivals = sum(bool(sure.intersection(own.calls)) for own in CANDIDATES.values())
        return min(TOLD_APART + log(rivals), self.least)

    def _left(self) -> frozenset[str]:
        full = LINES if sum(n.kind in LINES for n in self.named) >= _MOST_LINES else frozenset()
        return self.vocabulary - self._done() - full

    def _done(self) -> frozenset[str]:
        return frozenset({*(n.name for n in self.named), *self.refused})

    def _decided(self, state: State, path: Path | None = None) -> list[Ranked]:
        """Return the effects that may be claimed; the best of pairs that tie are put aside.

        Neither of two that tie over the same numbers is claimed, nor what explains the same, and
        worse. What is taken in besides may decide: they are tried again in the next round.
        """
        self.ties, self.doubted, self.apart = [], {}, []
        while True:
            apart = [*self.apart, *(one.mean for pair in self.ties for one in pair)]
            settled = tuple(self.settled)
            left = self._left() - self.doubted.keys() - akin(self.ties)
            fitted = ranked(
                state, left, self.memory, self.step, settled, apart, self._possible, self._shown
            )
            if len(self.settled) > len(settled):
                continue  # a line was refused: behind it another may be
            before = len(self.doubted)
            fitted = as_shown(state, self.lines, plainest(state, fitted))
            fitted = in_form(state, self.camera, fitted)
            fitted = self._undoubted(state, fitted)
            if len(self.doubted) > before:
                continue  # all that was fitted of a kind is denied: others were too far behind it
            if not fitted or fitted[0].gain < LEAST_GAIN:
                return fitted
            tied = (one for one in fitted[1:] if ties(state, fitted[0], one))
            rival: Ranked | Path | None = next(tied, self._named_otherwise(fitted[0]))
            rival = rival or bends_as_well(state, fitted[0], path)
            if self._shown(fitted[0].proposal.effect) < SURE_GAIN:  # else frames tell it from all
                rival = rival or twin(state, fitted[0], self.vocabulary, self.memory, self.step)
            if rival is None:
                return fitted
            if (told := by_numbers(state, self.camera.noise, fitted, rival)) is not None:
                return told
            self.ties.append((fitted[0], rival))
            self.tied |= {fitted[0].kind: rival, rival.kind: fitted[0]}

    def _named_otherwise(self, best: Ranked) -> Ranked | Path | None:
        """Return the rival that tied before, if it only is no rival since its kind was named.

        Amplifiers of the two halves say nothing of those of even and odd rows.
        """
        rival, named = self.tied.get(best.kind), {n.kind for n in self.named}
        return rival if rival is not None and rival.kind in named - LINES else None

    def _undoubted(self, state: State, fitted: list[Ranked]) -> list[Ranked]:
        """Leave out the best as long as a statistic which calls for it denies it, for this round.

        That of which nothing is left is doubted, until what is named besides shows another of it.
        """
        while fitted and fitted[0].gain >= LEAST_GAIN and fitted[0].kind not in LINES:
            best, *others = fitted
            predictor = state.predictor(replicates_for(self.setting, [best.proposal.effect]))
            denial = refuted(state, predictor, best.kind, best.polished, self._left())
            denial = denial or unlike_frames(state, self.lines, best, others)
            if (denial := denial or displaced(state, best.kind, best.polished.mean)) is None:
                break
            fitted = others
            if all(one.name != best.name for one in others):
                self.doubted[best.name] = denial.why
                self.apart += [best.mean] if denial.why.startswith(AS_WELL) else []
                break
        return fitted

    def _possible(self, effect: Effect) -> bool:
        """Return whether an effect may be tried: not again, and as whole frames show its line."""
        if instance(effect.kind, effect) in self._done() | self.doubted.keys():
            return False
        if any(own.place in self.sized and own.like(effect) for own in self._sizes()):
            return False
        if self.lines is None or not self.lines.shown(effect):
            return self.lines is None
        denial = self.lines.denial(effect) or in_step(self.setting, effect)
        if denial == ABSENT:
            line = frequency_of(effect)
            self.settled += [(NO_LINE, line)] if line is not None else []
            self.absent |= {line} if line is not None else set()
        elif denial is not None:
            self._refuse(effect.kind, effect, denial)
        return denial is None

    def _shown(self, effect: Effect, without: State | None = None) -> float:
        """Return what whole frames gain by a line, or codes; minus infinity: nothing of either."""
        by_codes = gain_by_codes(self.setting, effect, without)
        return by_codes if self.lines is None else max(by_codes, self.lines.gain(effect))

    def denied(self, state: State) -> tuple[Named, str] | None:
        """Return the effect that the recording denies most, and why; None: it denies none."""
        return self._judge(state).denied(self.named)

    def _pruned(self, state: State) -> State:
        """Drop effects that the others make needless, and those that leave what they touch.

        Where few pixels make a number, a model with them allows it anything: what would be left
        open without an effect, clearly, needs it whatever the likelihoods say.
        """
        state = self.asked[1] if self.asked and state is self.asked[0] else state
        needed: set[str] = set()
        while self.named:
            judge = self._judge(state)
            # Denied ones first: they may explain what is another's.
            worst = judge.denied(self.named, needed)
            worst = worst or judge.needless([n for n in self.named if n.name not in needed])
            if worst is None:
                break
            bare = State.of(self.setting, self.without(state, worst[0]), self.step, near=state)
            if self._needed(state, bare, *worst):
                needed.add(worst[0].name)
                continue
            state = self._dropped(bare, *worst)
        return state

    def _needed(self, state: State, bare: State, named: Named, why: str) -> bool:
        """Return whether a state without an effect shows that it is no needless one after all."""
        if why == NOTHING:
            return self.explained_by(named, state, bare)
        if why.startswith((NEEDLESS, INSTEAD)) and opened(state, bare):
            return True
        if why != NEEDLESS or (own := named.proposal) is None:
            return False
        gain = gained(state, bare, own.effect, replicates_for(self.setting, [own.effect]))
        return max(gain, self._shown(own.effect, bare)) - own.price >= self._least(bare, named.kind)

    def _judge(self, state: State) -> Judge:
        return Judge(state, lambda named: self.without(state, named), self.setting.nulls)
