"""Which physics explains the mismatches: add the best effect, fit all again, look again."""

from collections.abc import Container, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.choice import Choice
from analysis.mismatch.credited import kept_up
from analysis.mismatch.fitted import WEAK
from analysis.mismatch.forgiving import to_forgive
from analysis.mismatch.instance import LINES, frequency_of
from analysis.mismatch.judge import INSTEAD, LITTLE, NEEDLESS, NOTHING, Judge
from analysis.mismatch.memory import Memory
from analysis.mismatch.named import Named
from analysis.mismatch.own import eased
from analysis.mismatch.phase import ABSENT
from analysis.mismatch.polish import with_effects
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.resolved import differ, gained, opened
from analysis.mismatch.state import State
from dsis.effects.read_noise_spread import ReadNoiseSpread

Array = NDArray[np.float64]
_MOST_EFFECTS = 20  # some may have to go again
_CHOSEN = frozenset({"adc_memory", "dual_gain"})  # a period, a gap between levels
_ROUNDS, _FEW_ROUNDS = 6, 3  # of a search that goes on; of a large recording
_SPREAD = "read_noise_spread"
_FORGIVING = 2  # rounds after which what was dropped may come back


@dataclass
class Search(Choice):
    """The search from a base state; `run` leaves the result in the attributes."""

    asked: tuple[State, State] | None = None  # with what differs in all frames, and without
    # Places of sizes that were fitted with what is named, and what that was.
    together: set[tuple[int, tuple[str, ...]]] = field(default_factory=set)

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
                state, before = self._with_sizes(state), state
                if state is before:
                    break
                continue
            if self._feigned(state, added[0].gain):
                state, before = self._polished(state), state
                if state is not before:
                    continue
            for named in (added[0], *self._second()):
                self._take(named)
            self.named = kept_up(self.named, added[1], self.setting.given)
            self.rough |= added[0].gain >= WEAK
            state = State.of(self.setting, added[1], self.step, draft=True, near=state)
        if not state.mismatches:
            self.ties = []  # what was undecided on the way is explained
            self.doubted = {}
        return state if strong else self._with_spread(state)

    def _with_spread(self, state: State) -> State:
        """Return the state with read noise that spreads, where jumps hide it and frames show it.

        Numbers, which jumping pixels make up, gain nothing by it: its size is that of the frames.
        """
        if self.lines is None or _SPREAD not in self._left():
            return state
        there = {own.kind for own in state.camera.effect}
        if "rts" not in there or _SPREAD in there or not self._spreads:
            return state
        size, error = self.lines.ordinary.spread()
        errors = {"log_sigma": error}
        proposal = Proposal(ReadNoiseSpread(log_sigma=size), (), errors=errors)
        camera = with_effects(state.camera, [proposal.effect])
        if camera is None:
            return state
        self._take(Named(_SPREAD, proposal, errors, self.lines.ordinary.gain, ()))
        return State.of(self.setting, camera, self.step, draft=True, near=state)

    def _with_sizes(self, state: State) -> State:
        """Return the state with user's effects of the sizes that stand beside what is named.

        What was named first may have had what another size of them makes, and no number called for
        that any more: where something is left that calls for it, both are fitted together.
        """
        if self.setting.large or not self._depart(state):
            return state
        kinds = [one.kind for one in self.named if one.kind in CANDIDATES]
        beside = tuple(sorted(one.name for one in self.named))
        calls = {
            name for kind in kinds for name in (*CANDIDATES[kind].calls, *CANDIDATES[kind].hints)
        }
        known = {own.place for own in self.own}
        some = [
            own
            for own in self._sizes()
            if own.place not in known and own.value and own.effect.kind not in kinds
            if (own.place, beside) not in self.together
            if calls.intersection(CANDIDATES[own.effect.kind].calls)
        ]
        if not some:
            return state
        self.together |= {(own.place, beside) for own in some}
        kept = self.named, self.own, self.camera, self.polished, self.rough
        self.own = sorted([*self.own, *some], key=lambda own: own.place)
        made = self._polished(state)
        places = {own.place for own in some}
        right = all(not own.contradicted for own in self.own if own.place in places)
        if right or not eased(calls, state, made):
            self.named, self.own, self.camera, self.polished, self.rough = kept
            return state
        return made

    def _take(self, named: Named) -> None:
        self.named.append(named)
        self.sized = set()
        if (line := frequency_of(named.effect)) is not None:
            self.settled += [(kind, line) for kind in sorted(LINES)]

    def drop(self, state: State, named: Named, why: str) -> State:
        """Return the state without an effect, which is refused from now on."""
        bare = State.of(self.setting, self.without(state, named), self.step, near=state)
        return self._asked_of_all(self._dropped(bare, named, why))

    def _dropped(self, bare: State, named: Named, why: str) -> State:
        """Refuse an effect; of a second read-out path also what needs one."""
        self._refuse(named.kind, named.effect, why)
        self.named.remove(named)
        able = bare.camera.read_out if named.kind == "dual_gain" else None
        for other in [n for n in self.named if able and n.effect and n.effect.unfit_for(able)]:
            self._refuse(other.kind, other.effect, f"needs {named.kind}: {why}")
            self.named.remove(other)
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
            return self.explained_by(named, state, bare, self.asked and self.asked[0])
        if why.startswith((NEEDLESS, INSTEAD)) and opened(state, bare):
            return True
        if named.kind == "rts" and why.startswith((NEEDLESS, LITTLE)) and self._jumping:
            return True  # numbers of few pixels scatter
        if named.kind == _SPREAD and why.startswith((NEEDLESS, LITTLE)) and self._spreads:
            return True  # and that of all others is lost in it
        if why != NEEDLESS or (own := named.proposal) is None:
            return False
        gain = gained(state, bare, own.effect, replicates_for(self.setting, [own.effect]))
        most = max(gain, self._shown(own.effect, bare))
        return most - own.price >= self._least(bare, named.kind)

    @property
    def _jumping(self) -> bool:
        """Whether whole frames show pixels that jump."""
        return self.lines is not None and self.lines.jumping(self.least_odds)

    @property
    def _spreads(self) -> bool:
        """Whether whole frames show ordinary pixels that differ in how noisy they are."""
        return self.lines is not None and self.lines.ordinary.differ

    def _judge(self, state: State) -> Judge:
        return Judge(state, lambda named: self.without(state, named), self.setting.nulls)
