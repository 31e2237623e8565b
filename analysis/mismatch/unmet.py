"""Effects that do not meet what calls for them: it stays, or was never there."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.locate import FAMILY
from analysis.mismatch.resolved import (
    CLEAR,
    LEAST_CHANGE,
    MINOR,
    carries,
    changed,
    clearly,
    off_without,
)
from analysis.mismatch.state import State
from analysis.mismatch.words import statistic_words
from dsis.effects import Effect, registry
from dsis.effects.adc_memory import AdcMemory
from dsis.effects.readout_memory import ReadoutMemory

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_POOLED = "all"
_MAPS = {
    "dsnu": "offset",
    "row_fpn": "offset",
    "column_fpn": "offset",
    "prnu": "gain",
    "row_prnu": "gain",
    "column_prnu": "gain",
}
_LEFT = 0.5  # of what calls for an effect, that may stay where it is explained


def unmet(state: State, effect: Effect, without: Array, *, shown: bool = False) -> Denial | None:
    """Return how an effect is denied by what calls for it; None: it is not.

    A residue of the code before is not, where all that follows codes is explained by it. `without`
    are the numbers predicted without the effect; `shown`: maps show what numbers need not.
    """
    kind = effect.kind
    if kind not in CANDIDATES or (isinstance(effect, AdcMemory) and carries(state, without)):
        return None
    known = set(CANDIDATES[kind].calls)
    if "level" not in registry()[kind].measures:
        known.discard("level")  # which only scatters with it: what stays is another's
    calls = np.array([key.statistic in known for key in state.null.keys])
    calls &= _of_its_map(state, kind) & _of_its_law(state, kind) & _of_its_lag(state, effect)
    change = changed(state, without)
    departures, off = off_without(state, without)
    if not (off & calls).any() and CANDIDATES[kind].hints:
        return None if shown else _unseen(state, calls, change)
    return _stays(state, calls, change, departures, off)


def _of_its_map(state: State, kind: str) -> Mask:
    """Return which numbers say whether a fixed pattern is there: those of its map, if it has one.

    What darks and flats have alike is an offset, what grows with the signal a gain: where exposures
    tell both, what stays of one says nothing of the other.
    """
    keys = state.null.keys
    own = _MAPS.get(kind, "")
    known = {key.scope for key, told in zip(keys, state.null.known, strict=False) if told}
    if not own or not {"offset", "gain"} <= known:
        return np.ones(len(keys), np.bool_)
    return np.array([key.scope == own for key in keys])


def _of_its_law(state: State, kind: str) -> Mask:
    """Return which numbers an effect meets whatever the law of its heights.

    The fourth moment of a map with hot pixels is that of the brightest one: they are counted. So
    are spikes of its shot noise.
    """
    keys = state.null.keys
    if kind != "hot_pixels":
        return np.ones(len(keys), np.bool_)
    brightest = {("outlying_pixels", ""), ("one_off_outliers", "")}
    return np.array([(key.statistic, key.detail) not in brightest for key in keys])


def _of_its_lag(state: State, effect: Effect) -> Mask:
    """Return which numbers say whether there is memory: along either axis, those of its own lag.

    What else makes neighbours alike says nothing of samples two apart that are alike as well. Of
    memory of the sample before all say something: what neighbours share reaches farther.
    """
    keys = state.null.keys
    if not isinstance(effect, ReadoutMemory) or effect.lag_pixels == 1:
        return np.ones(len(keys), np.bool_)
    lag = effect.lag_pixels
    step = 1 if state.setting.layout.channels == ("MONO",) else 2
    own = {f"correlation_0_{lag}", f"correlation_{lag}_0"}
    lines = {f"{axis} {lag / step:g}" for axis in ("rows", "columns")}
    return np.array([key.statistic in own or key.detail in lines for key in keys])


def _stays(state: State, calls: Mask, change: Array, departures: Array, off: Mask) -> Denial | None:
    """Return how an effect is denied where most of what calls for it stays; None: it is not.

    Of the exposures that it clearly changes, each statistic that calls for it counts with what
    departs most for certain, without it and with it; in full what only departs with it. Where more
    than half of them all is left, something else is there that calls for the same, and may be all
    there is: memory along rows explains no correlation along columns, a smooth bend no noise that
    leans, and tails that single pixels have not are none.
    """
    still = calls & (state.chances < FAMILY)
    # Where an effect adds little to a large departure, the rest is another's.
    main = np.abs(change) >= MINOR * np.abs(departures)
    minor = ~main & (np.abs(change) >= LEAST_CHANGE)
    own = calls & _beside(state, np.where(calls & main, change, 0.0)) & ~minor
    if not (still & own).any():
        return None
    before: dict[str, float] = {}
    after: dict[str, float] = {}
    for i in np.flatnonzero(own & (still | off)):
        name = state.null.keys[i].statistic
        before[name] = max(before.get(name, 0.0), abs(float(departures[i])))
        after[name] = max(after.get(name, 0.0), abs(float(state.departures[i])))
    met = {state.null.keys[i].statistic for i in np.flatnonzero(own & off)}
    left = sum(min(size, before[name]) if name in met else size for name, size in after.items())
    share = max(1 - left / max(sum(before.values()), 1e-9), 0.0)
    if share >= 1 - _LEFT:
        return None
    most = max(after, key=lambda name: after[name])
    why = f"it explains {share:.0%} of what calls for it, and leaves {statistic_words(most)}"
    return Denial(share, why)


def mirrored(state: State, effect: Effect, without: Array) -> Denial | None:
    """Return how memory along one axis is denied by what is left along the other; None: it is not.

    What makes neighbours alike in both directions, a filter or charge that is shared, would explain
    both in one word; a converter's residue is of the sample before. `without` are the numbers
    predicted without the memory.
    """
    if not isinstance(effect, (ReadoutMemory, AdcMemory)):
        return None
    lag = effect.lag_pixels if isinstance(effect, ReadoutMemory) else 1
    names = [f"correlation_0_{lag}", f"correlation_{lag}_0"]
    own, across = names if effect.along == "rows" else names[::-1]
    departures, _ = off_without(state, without)
    explained = _largest(state, own, departures)
    left = _largest(state, across, np.where(state.chances < FAMILY, state.departures, 0.0))
    if left * explained <= 0 or abs(left) < _LEFT * abs(explained):
        return None
    share = 1 - min(abs(left / explained), 1.0)
    return Denial(share, f"as much stays the other way: {statistic_words(across)}")


def _largest(state: State, statistic: str, departures: Array) -> float:
    """Return the largest departure of a statistic, with its sign; 0 where it has none."""
    own = [z for key, z in zip(state.null.keys, departures, strict=True)
           if key.statistic == statistic]  # fmt: skip
    return float(max(own, key=abs, default=0.0))


def _unseen(state: State, calls: Mask, change: Array) -> Denial | None:
    """Return how an effect that only a hint led to is denied: what calls for it must show it."""
    count = len(state.vector.keys)  # sums of numbers would count them twice
    own = np.where(calls, change, 0.0)[:count]
    left = state.null.departures(state.vector)[:count]
    size = float(np.linalg.norm(own))
    seen = float(own @ (left + own)) / size if size else 0.0
    if seen >= CLEAR:
        return None
    return Denial(0.0, f"its own statistics show it by only {seen:.1f} standard deviations")


def _beside(state: State, change: Array) -> Mask:
    """Return which numbers change clearly, or are of exposures in which others do.

    A contrast is of the exposures that have half of its weight, what is pooled of all.
    """
    keys, matrix = state.vector.keys, state.null.contrasts.matrix
    _, touched = clearly(change)
    _, single = clearly(np.where([bool(key.exposure) for key in keys], change[: len(keys)], 0.0))
    exposures = {key.exposure for key, own in zip(keys, single, strict=True) if own}
    pooled = {_POOLED} if exposures else set()
    inside = np.array([key.scope in pooled or key.exposure in exposures for key in keys], bool)
    summed = (matrix**2 * inside).sum(1) >= 0.5 * (matrix**2).sum(1)
    return np.asarray(touched | np.concatenate([inside, summed]))
