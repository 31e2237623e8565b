"""How much an effect explains of what it changes."""

from collections.abc import Container, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, calls_of
from analysis.mismatch.finding import Mismatch
from analysis.mismatch.locate import FAMILY, tested
from analysis.mismatch.predict import Predictor
from analysis.mismatch.rank import SURE_CHANCE
from analysis.mismatch.state import State
from dsis.effects import Effect

Array = NDArray[np.float64]
CLEAR = 3.0  # departures below are chance
FAR_OFF = 8.0  # standard deviations that no chance has
_MOST_OF, LEAST_CHANGE = 0.7, 1.0  # few simulations show of none as much as the second
_OPEN = 8.0  # standard errors
MINOR = 0.3  # share of a departure
_CARRY = "carry_over"
_LEFT = 0.5  # of a departure may be left where it is explained


def resolved(predictor: Predictor, state: State, without: Array) -> float:
    """Return the share of departures that an effect explains, of those numbers that it changes.

    `without` are the numbers predicted without it. What is explained within 3 standard errors, or
    within the likelihood's allowance for the effect's form, is explained.
    """
    null = state.null
    change = changed(state, without)
    sums = change.size - predictor.forms.size
    forms = np.concatenate([predictor.forms, np.full(sums, float(np.median(predictor.forms)))])
    after = null.departures(state.vector)
    limit, clear = clearly(change)
    # Where an effect adds little, and rightly, to a large departure, the rest is another's.
    departure = after + change
    clear &= ~((change * departure > 0) & (np.abs(change) < MINOR * np.abs(departure)))
    if not clear.any():
        return 0.0
    before = np.abs(departure)[clear]
    allowed = CLEAR + 2 * forms[clear] * np.abs(change[clear])
    left = np.maximum(np.abs(after[clear]) - allowed, 0.0).sum()
    total = np.maximum(np.maximum(before, np.abs(change[clear])) - limit, 0.0).sum()
    return float(1 - left / total) if total > 0 else 0.0


def changed(state: State, without: Array) -> Array:
    """Return what an effect changes in numbers and contrasts, in standard deviations.

    `without` are the numbers predicted without it; where one is unknown nothing changes.
    """
    null = state.null
    known = null.known & np.isfinite(without)
    single = np.where(known, (null.mean - np.where(known, without, 0.0)) / null.sd, 0.0)
    return np.concatenate([single, null.contrasts.matrix @ single / null.contrast_sd])


def clearly(change: Array) -> tuple[float, NDArray[np.bool_]]:
    """Return from which size on a change is clear, and which are.

    What changes nothing clearly is judged by what it changes most.
    """
    size = np.abs(change)
    limit = min(CLEAR, _MOST_OF * float(size.max(initial=0.0)))
    return limit, size > max(limit, LEAST_CHANGE)


def locates(state: State, without: Array) -> bool:
    """Return whether something differs for certain without an effect, half of which it explains.

    `without` are the numbers predicted without it.
    """
    z, off = off_without(state, without)
    return bool((np.abs(state.departures[off]) < _LEFT * np.abs(z[off])).any())


def off_without(state: State, without: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return departures from numbers predicted without an effect, and which are certain.

    They scatter as with it.
    """
    null = state.null
    known = null.known & np.isfinite(without)
    bare = replace(null, mean=np.where(known, without, null.mean))
    z, chances = tested(state.setting.layout, bare, state.vector)
    return z, chances < FAMILY


def explains(state: State, bare: State, base: State, calls: Container[str]) -> bool:
    """Return whether a state with an effect explains half of something that one without it leaves.

    Or what called for the effect at first, in frames of which the search sees some.
    """
    left = {m.statistic: abs(m.z) for m in state.mismatches}
    beside = any(left.get(m.statistic, 0.0) < _LEFT * abs(m.z) for m in bare.mismatches)
    return beside or any(m.statistic in calls and m.statistic not in left for m in base.mismatches)


def calls_alone(kind: str, others: Iterable[str]) -> frozenset[str]:
    """Return the statistics that call for a kind of effect, if only as a hint, and for no other."""
    if kind not in CANDIDATES:  # a second read-out path, which variances show with others
        return frozenset()
    own = CANDIDATES[kind]
    beside = {call for other in others for call in calls_of(other)}
    return frozenset({*own.calls, *own.hints} - beside)


def gained(state: State, bare: State, effect: Effect, replicates: int) -> float:
    """Return what a state gains over one without an effect, as that one predicts it, nats.

    Nothing unless what calls for the effect differs without it, and does not with it. Where some of
    it still does - levels that light which flickers scatters, and a bent response bends - by the
    rest alone.
    """
    calls = set(CANDIDATES[effect.kind].calls)
    left, called = (calls & {m.statistic for m in own.mismatches} for own in (state, bare))
    if not called - left:
        return 0.0
    which = np.array([not left or key.statistic in called - left for key in bare.vector.keys])
    predictor = bare.predictor(replicates)
    mean = predictor.mean(state.camera)
    return predictor.loglik(mean, which) - predictor.loglik(bare.null.mean, which)


def opened(state: State, bare: State) -> bool:
    """Return whether a state without an effect leaves open what the state with it explains."""
    known = {m.statistic for m in state.mismatches}
    return any(m.statistic not in known and abs(m.z) > _OPEN for m in bare.mismatches)


def differ(before: Sequence[Mismatch], now: Sequence[Mismatch]) -> bool:
    """Return whether something differs now that did not before, or not surely."""
    sure = {m.statistic: m.p_adjusted < SURE_CHANCE for m in before}
    return any(
        m.statistic not in sure or (m.p_adjusted < SURE_CHANCE and not sure[m.statistic])
        for m in now
    )


def carries(state: State, without: Array) -> bool:
    """Return whether samples follow the codes before them for certain, but for what explains it.

    `without` are the numbers predicted without that: a converter's residue. Nothing else makes a
    sample follow codes in periods; how alike neighbours are in all, which it changes as well,
    others make, too.
    """
    if any(m.statistic == _CARRY for m in state.mismatches):
        return False
    _, off = off_without(state, without)
    own = [key.statistic == _CARRY for key in state.vector.keys]
    return bool(off[: len(own)][own].any())
