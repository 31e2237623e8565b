"""What a search takes in next: the effect that explains most, if any may be claimed."""

from dataclasses import dataclass, field, replace
from functools import cache, partial
from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bothneeded import both_needed
from analysis.mismatch.candidates import CANDIDATES, measured
from analysis.mismatch.clues import NO_LINE
from analysis.mismatch.codegain import gain_by_codes, of_electrons
from analysis.mismatch.contradicted import refuted
from analysis.mismatch.credited import joined
from analysis.mismatch.displaced import displaced
from analysis.mismatch.fitted import Fitted
from analysis.mismatch.forms import in_form
from analysis.mismatch.instance import LINES, Frequency, frequency_of, instance
from analysis.mismatch.instep import in_step
from analysis.mismatch.memory import Memory
from analysis.mismatch.named import Named
from analysis.mismatch.phase import ABSENT, Measured, WholeFrames
from analysis.mismatch.polish import with_effects
from analysis.mismatch.proposed import replicates_for
from analysis.mismatch.rank import (
    LEAST_GAIN,
    SURE_CHANCE,
    SURE_GAIN,
    TOLD_APART,
    Ranked,
    behind,
    ranked,
)
from analysis.mismatch.rowtold import AS_WELL, as_shown, unlike_frames
from analysis.mismatch.segments import Path, spiky
from analysis.mismatch.state import State
from analysis.mismatch.ties import (
    akin,
    bends_as_well,
    by_numbers,
    of_tied_lag,
    plainest,
    ties,
    twin,
)
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.rts import Rts

Array = NDArray[np.float64]
_FRAMES_ALIKE = "frame_correlation"
_MOST_LINES = 5  # further ones stay unexplained, located


@dataclass
class Choice(Fitted):
    """What may be taken in beside what is, and what may not any more.

    Attributes
    ----------
    refused, doubted
        By name, why: for good, and in this state.
    tied
        Of two that tied before, each other.
    apart
        What one of two makes that frames show.
    settled
        Lines that need no trial.
    absent
        Peaks that were no line.
    lines, measuring
        Of all frames of a small recording; of those that are not locked.
    memory
        What was tried before.
    second
        What must be taken in with the best: see `both_needed`.
    least
        Gain for an effect to be taken in.
    """

    refused: dict[str, str] = field(default_factory=dict)
    tied: dict[str, Ranked | Path] = field(default_factory=dict)
    doubted: dict[str, str] = field(default_factory=dict)
    apart: list[Array] = field(default_factory=list)
    settled: list[tuple[str, Frequency]] = field(default_factory=list)
    absent: set[Frequency] = field(default_factory=set)
    lines: WholeFrames | None = None
    measuring: WholeFrames | None = None
    memory: Memory = field(default_factory=Memory)
    second: Ranked | None = None
    least: float = SURE_GAIN

    def _refuse(self, kind: str, effect: Effect | None, why: str) -> None:
        self.refused[instance(kind, effect)] = why
        if (line := frequency_of(effect)) is not None:
            self.settled.append((kind, line))

    def _best(self, state: State) -> tuple[Named, Camera] | None:
        """Return the effect that explains most, and the camera with it, and with a `second`."""
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
            self.second = None
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
        known = self._measured(state, proposal.effect)
        if known is not None:  # better than from the heights of peaks, or sums over pixels
            proposal = measured(proposal, *known)
            errors = dict(proposal.errors)
            camera = with_effects(state.camera, [proposal.effect])
        if camera is not None and self.second is not None:
            both = with_effects(camera, self.second.polished.effects)
            self.second = None if both is None else self.second
            camera = both or camera
        named = Named(best.kind, proposal, errors, best.gain, rivals)
        return None if camera is None else (named, camera)

    def _measured(self, state: State, effect: Effect) -> Measured | None:
        """Return what frames tell of a line, bands or pixels that jump; None: numbers know more."""
        known = None if self.measuring is None else self.measuring.measured(effect)
        return known or self._jumps(state, effect)

    def _sized_jumps(self, state: State, effect: Rts) -> Rts:
        """Return pixels that jump by what frames show, where they tell."""
        known = self._measured(state, effect)
        return effect if known is None else effect.model_copy(update=dict(known[0]))

    def _second(self) -> list[Named]:
        """Return what must be taken in with the best, if anything."""
        if (own := self.second) is None:
            return []
        proposal = replace(own.proposal, effect=own.polished.effects[0])
        return [Named(own.kind, proposal, own.polished.errors[0], own.gain, ())]

    @property
    def least_odds(self) -> float:
        """By how much frames must be likelier with pixels that jump for these to be there, nats.

        Whatever went before.
        """
        return min(self._least(self.base, "rts"), SURE_GAIN)

    def _jumps(self, state: State, effect: Effect) -> Measured | None:
        """Return what frames say of pixels that jump, where all show them; else None.

        Numbers, which are sums over pixels, say less of few, and little of how often they jump.
        Where some of what frames share is unexplained, or the camera has such pixels already,
        frames show them anyway.
        """
        if not isinstance(effect, Rts) or self.measuring is None:
            return None
        if state.setting.jumping is None and not self._jump_rather(state):
            return None
        seen = self.measuring.telegraph
        return None if seen is None else (seen.values, seen.errors)

    def _jump_rather(self, state: State) -> bool:
        """Return whether all frames tell pixels that jump from all other noise, where many may."""
        others = any(isinstance(own, Rts) for own in state.camera.effect)
        others |= any(m.statistic == _FRAMES_ALIKE for m in state.mismatches)
        return not others and self.lines is not None and self.lines.jump_rather(SURE_GAIN)

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
        self.ties, self.doubted, self.apart, self.second = [], {}, [], None
        counted = cache(partial(of_electrons, state))

        def shown(effect: Effect) -> float:
            return -np.inf if isinstance(effect, AdcDnl) and counted() else self._shown(effect)

        while True:
            apart = [*self.apart, *(one.mean for pair in self.ties for one in pair)]
            settled = tuple(self.settled)
            left = self._left() - self.doubted.keys() - akin(self.ties)
            fitted = ranked(
                state, left, self.memory, self.step, settled, apart, self._possible, shown
            )
            if len(self.settled) > len(settled):
                continue  # a line was refused: behind it another may be
            before = len(self.doubted)
            fitted = as_shown(state, self.lines, plainest(state, fitted))
            fitted = in_form(state, self.camera, fitted, partial(self._sized_jumps, state))
            fitted = self._undoubted(state, fitted, left)
            if len(self.doubted) > before:
                continue  # all that was fitted of a kind is denied: others were too far behind it
            if not fitted or fitted[0].gain < LEAST_GAIN:
                return fitted
            both = both_needed(state, fitted)
            if both is not None and self._undenied(state, both[1]):
                self.second = both[1]
                return [both[0], *(one for one in fitted[1:] if one.kind != both[1].kind)]
            tied = (one for one in fitted[1:] if ties(state, fitted[0], one))
            rival: Ranked | Path | None = next(tied, self._named_otherwise(fitted[0]))
            rival = rival or bends_as_well(state, fitted[0], path)
            if shown(fitted[0].proposal.effect) < SURE_GAIN:  # else frames tell it from all
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

    def _undoubted(self, state: State, fitted: list[Ranked], left: frozenset[str]) -> list[Ranked]:
        """Leave out the best as long as a statistic which calls for it denies it, for this round.

        That of which nothing is left is doubted, until what is named besides shows another of it.
        `left` are kinds that may be taken in.
        """
        while fitted and fitted[0].gain >= LEAST_GAIN and fitted[0].kind not in LINES:
            best, *others = fitted
            predictor = state.predictor(replicates_for(self.setting, [best.proposal.effect]))
            denial = refuted(state, predictor, best.kind, best.polished, self._left())
            denial = denial or unlike_frames(state, self.lines, best, others, left)
            if (denial := denial or displaced(state, best.kind, best.polished.mean)) is None:
                break
            fitted = others
            if all(one.name != best.name for one in others):
                self.doubted[best.name] = denial.why
                self.apart += [best.mean] if denial.why.startswith(AS_WELL) else []
                break
        return fitted

    def _undenied(self, state: State, second: Ranked) -> bool:
        """Return whether nothing denies an effect that is taken in with the best."""
        effect = second.polished.effects[0]
        if not CANDIDATES[second.kind].sane(state.setting.layout, effect):
            return False
        if any(own.like(effect) for own in self._sizes()):
            return False  # the user's own is sized again
        return unlike_frames(state, self.lines, second, ()) is None

    def _possible(self, effect: Effect) -> bool:
        """Return whether an effect may be tried: not again, and as whole frames show its line."""
        if instance(effect.kind, effect) in self._done() | self.doubted.keys():
            return False
        if any(own.place in self.sized and own.like(effect) for own in self._sizes()):
            return False
        if of_tied_lag(self.ties, effect):
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
