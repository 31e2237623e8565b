"""Effects that could explain what is off, each with fitted parameters, the best first."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.credited import joined
from analysis.mismatch.instance import (
    LINES,
    Frequency,
    instance,
    same_place,
)
from analysis.mismatch.memory import Memory, words
from analysis.mismatch.polish import Polished, needed, stepped
from analysis.mismatch.proposed import (
    STRONG,
    WORTH_IT,
    all_fitted,
    beside_credited,
    means_of,
    replicates_for,
)
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.adc_memory import AdcMemory

Array = NDArray[np.float64]
Fit = tuple[str, Proposal, Polished]
"""A kind, what it was proposed as, and that with fitted parameters."""

LEAST_GAIN = 2.0  # of log-likelihood, below which an effect is not worth its parameter
# For an effect to be taken in: odds of 20, were any of the vocabulary as likely beforehand. Where
# that something calls for it is as sure, the likelihood need only tell it from others.
SURE_CHANCE = 1 / (20 * len(CANDIDATES))
SURE_GAIN = -log(SURE_CHANCE)
_TOLD_RIVALS = 3
_MOST = 4  # kinds that are fitted, after all were tried as proposed
_FAR = 15.0  # of log-likelihood behind the best as proposed: fitting does not make up for it
_SHARE = 0.03  # or that share of what the best gains
TOLD_APART = 3.0  # of log-likelihood: odds below 20 do not tell two effects apart
_COSINE = 0.5  # of what two predictions change, from which they change the same
_BY_JUMPS = frozenset({"rts"})
# Codes in step with powers of two; residues, whose levels a step that is not fitted misses.
_BY_FRAMES = _BY_JUMPS | LINES | {"adc_dnl", "adc_memory"}
_FAR_OFF, _LITTLE = 8.0, 0.3  # departures, and the share of one that is little


@dataclass(frozen=True)
class Ranked:
    """An effect with fitted parameters, and its gain of log-likelihood less its free parameters.

    `told_from` is a kind that whole frames tell it from, whatever numbers say.
    """

    gain: float
    kind: str
    proposal: Proposal
    polished: Polished
    told_from: str = ""

    @property
    def name(self) -> str:
        """Its kind, and of a line its frequency, of a decay its edge."""
        return instance(self.kind, self.proposal.effect)

    @property
    def mean(self) -> Array:
        """The numbers it predicts."""
        return self.polished.mean


def ranked(
    state: State,
    kinds: Iterable[str],
    memory: Memory,
    step: Callable[[], None],
    settled: tuple[tuple[str, Frequency], ...] = (),
    apart: Sequence[Array] = (),
    possible: Callable[[Effect], bool] = lambda _: True,
    shown: Callable[[Effect], float] = lambda _: -np.inf,
) -> list[Ranked]:
    """Return the effects among `kinds` that mismatches call for, fitted one at a time.

    `settled` are lines that need no trial; see `Clues`. What changes the same numbers as one of the
    predictions `apart` is not considered, nor what is not `possible`. `shown` says what whole
    frames gain by a line: one number of the bank, the largest of many, says less of a weak one.
    """
    predictor = state.predictor()
    before = predictor.loglik(state.null.mean)
    tried = _tried(state, kinds, memory, step, settled, apart, possible)
    told = partial(_at_once, shown)
    tried = [  # frames tell jumps of few pixels from what has the same sums, and waves from noise
        (max(value, before + _gained(state, own, told)), kind, own) for value, kind, own in tried
    ]
    for value, kind, own in tried:
        memory.gains_at_least(kind, own.effect, value - before)
    tried.sort(key=lambda one: -one[0])
    best = max((value for value, _, _ in tried), default=0.0)
    far = max(_FAR, _SHARE * (best - before))
    likely = _likely(tried, best - far)
    by_count: dict[int, list[Proposal]] = {}
    for start in likely:
        by_count.setdefault(replicates_for(state.setting, [start.effect]), []).append(start)
    for count, starts in by_count.items():
        asked = state.predictor(count)
        fits = [beside_credited(state, start) for start in starts]
        asked.ready(camera for fit in fits for camera in needed(*fit))
        if state.setting.jobs > 1 and len(starts) > 1:
            asked.ready(stepped(asked, *fit) for fit in fits)
    found: list[Fit] = []
    strange: set[str] = set()
    made = all_fitted(state, likely, far)
    at_hand = {id(start): polished for start, polished in zip(likely, made, strict=True)}
    for value, kind, proposal in tried:
        kinds_so_far = {one[0] for one in found}
        if value < best - far or (len(kinds_so_far) >= _MOST and kind not in kinds_so_far):
            continue
        known = id(proposal) in at_hand
        polished = at_hand[id(proposal)] if known else all_fitted(state, [proposal], far)[0]
        step()
        if polished is None or not CANDIDATES[kind].sane(state.setting.layout, polished.effects[0]):
            strange.add(kind)
            continue
        if not any(alike(state, polished.mean, one) for one in apart):
            found.append((kind, proposal, polished))
    if strange and not found:  # nothing that they were likelier than was fitted
        left = frozenset(kinds) - strange
        return ranked(state, left, memory, step, settled, apart, possible, shown)
    fitted = _in_order(state, found, shown)
    return _in_order(state, _once_more(state, found), shown) if _unsure(state, fitted) else fitted


def _unsure(state: State, fitted: Sequence[Ranked]) -> bool:
    """Return whether few simulations may have put the best before none, or before its like."""
    if state.setting.large or not fitted:
        return False
    best, *others = fitted
    return best.gain < SURE_GAIN or any(
        one.kind != best.kind and best.gain - one.gain < _FAR and alike(state, best.mean, one.mean)
        for one in others
    )


def _in_order(state: State, found: Sequence[Fit], shown: Callable[[Effect], float]) -> list[Ranked]:
    """Return fitted effects with their gains, the best first."""
    predictor = state.predictor()
    judged = ~_others(state, [own.mean for _, _, own in found])
    fitted = []
    for kind, start, own in found:
        gain = predictor.gain(own.mean, start.of_pixels, judged) + predictor.alone(own.mean)
        gain -= start.price
        fitted.append(Ranked(max(gain, _gained(state, start, shown)), kind, start, own))
    return sorted(fitted, key=lambda one: -one.gain)


def _at_once(shown: Callable[[Effect], float], effect: Effect) -> float:
    """Return what whole frames gain by an effect that they tell before it is fitted."""
    return shown(effect) if effect.kind in _BY_FRAMES else -np.inf


def _gained(state: State, start: Proposal, shown: Callable[[Effect], float]) -> float:
    """Return what whole frames gain by an effect, less its price; minus infinity: nothing.

    They tell a wave from noise, and not from one that the camera has there already.
    """
    effect = start.effect
    if any(same_place(effect, one, state.setting.layout) for one in state.camera.effect):
        return -np.inf
    if isinstance(effect, AdcMemory) and any(
        isinstance(one, AdcMemory) and one.along == effect.along for one in state.camera.effect
    ):
        return -np.inf  # samples have that residue already
    paid = 0.0 if effect.kind in _BY_JUMPS else start.price  # odds of all sizes have paid for them
    return shown(effect) - paid


def behind(kind: str, gain: float, others: Sequence[Ranked]) -> tuple[tuple[str, float], ...]:
    """Return the first kinds that are not `kind`, each once, and by how much they gain less."""
    found: dict[str, float] = {}
    for one in others:
        if one.kind != kind:
            found.setdefault(one.kind, gain - one.gain)
    return tuple(found.items())[:_TOLD_RIVALS]


def _once_more(state: State, found: Sequence[Fit]) -> list[Fit]:
    """Return fitted effects with what more simulations predict.

    Few that draw lines or pixels at random have some of it in numbers that the effect leaves alone
    on the whole: that costs a weak one more than it gains.
    """
    predictor = state.predictor(state.setting.drafts)
    given = state.setting.given
    cameras = [joined(state.camera, own.effects, given) for _, _, own in found]
    predictor.ready(cameras)
    return [
        (kind, start, own if camera is None else replace(own, mean=predictor.mean(camera)))
        for (kind, start, own), camera in zip(found, cameras, strict=True)
    ]


def _likely(tried: Sequence[tuple[float, str, Proposal]], least: float) -> list[Proposal]:
    """Return the proposals that will be fitted unless a fit fails."""
    near = [(kind, proposal) for value, kind, proposal in tried if value >= least]
    kinds = list(dict.fromkeys(kind for kind, _ in near))[:_MOST]
    return [proposal for kind, proposal in near if kind in kinds]


def _others(state: State, means: Sequence[Array]) -> NDArray[np.bool_]:
    """Return which numbers are far off, and hardly explained by any of the predictions.

    That is another's: a little of much would otherwise outweigh what an effect is known by.
    """
    null = state.null
    seen = null.departures(state.vector)[: null.mean.size]
    far: NDArray[np.bool_] = np.abs(seen) > _FAR_OFF
    for mean in means:
        change = np.where(null.known, np.nan_to_num(mean - null.mean), 0.0) / null.sd
        far &= np.abs(change) < _LITTLE * np.abs(seen)
    return far


def _tried(
    state: State,
    kinds: Iterable[str],
    memory: Memory,
    step: Callable[[], None],
    settled: tuple[tuple[str, Frequency], ...],
    apart: Sequence[Array],
    possible: Callable[[Effect], bool],
) -> list[tuple[float, str, Proposal]]:
    """Return the best proposals of each kind as they are proposed, the most likely first.

    Beside one that gains much, what gained little before is not tried anew: what others explain
    gains no more than before, as a rule, and is tried once nothing gains much.
    """
    off = {m.statistic for m in state.mismatches}
    clues = state.clues(settled)
    predictor = state.predictor(state.setting.screening)
    before = predictor.loglik(state.null.mean)
    known = {kind: CANDIDATES[kind] for kind in kinds if kind in CANDIDATES}
    left = {kind for kind, own in known.items() if off & {*own.calls, *own.hints}}
    best = max((memory.gained(kind, 0.0) for kind in left), default=0.0)
    found: list[tuple[float, str, Proposal, Array]] = []
    most = -np.inf  # that any gains in this state
    while True:
        worth = WORTH_IT * best if best > STRONG else -np.inf
        chosen = sorted(kind for kind in left if memory.gained(kind, np.inf) >= worth)
        if not chosen:
            break
        left -= set(chosen)
        proposed = [
            (kind, proposal)
            for kind in chosen
            for proposal in CANDIDATES[kind].propose(clues)
            if possible(proposal.effect)
        ]
        means = means_of(state, [proposal for _, proposal in proposed], memory, step, most)
        gains: dict[tuple[str, tuple[str, ...]], float] = {}
        for (kind, proposal), mean in zip(proposed, means, strict=True):
            if mean is None:
                continue
            value = before + predictor.gain(mean, proposal.of_pixels)
            which = kind, words(proposal.effect)
            gains[which] = max(gains.get(which, -np.inf), value - before)
            if not any(alike(state, mean, other) for other in apart):
                found.append((value, kind, proposal, mean))
        for (kind, which_of), gain in gains.items():
            memory.gains.setdefault(kind, {})[which_of] = gain
        most = max((value - before for value, *_ in found), default=-np.inf)
        best = max(most, 0.0)
    # Of one kind, each that changes other numbers: memory of one lag says nothing of another's.
    kept: list[tuple[float, str, Proposal, Array]] = []
    for one in sorted(found, key=lambda one: -one[0]):
        if not any(one[1] == other[1] and alike(state, one[3], other[3]) for other in kept):
            kept.append(one)
    return [(value, kind, proposal) for value, kind, proposal, _ in kept]


def alike(state: State, one: Array, other: Array, least: float = _COSINE) -> bool:
    """Return whether two predictions change the state's numbers in the same way.

    Of vectors of these changes, over their errors, the cosine is more than the `least`.
    """
    null = state.null
    a, b = (
        np.where(null.known, np.nan_to_num((mean - null.mean) / null.sd), 0.0)
        for mean in (one, other)
    )
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return size > 0 and float(a @ b) / size > least
