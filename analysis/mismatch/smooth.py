"""Whether levels bend smoothly, by whatever law, rather than where a read-out path begins."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.recalibrate import code_step
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State
from dsis.effects.adc_dnl import AdcDnl

Array = NDArray[np.float64]
_DEGREES = (2, 3)  # of a response: bent one way, or by more in one half than in the other
_LEAST_FLATS = 2  # levels on each side of a switch
_AT_SWITCH = "levels change where a read-out path begins"
_MOST = 0.5  # of what levels are off, that is left where they show an effect


def behind_smooth(state: State, mean: Array) -> float:
    """Return by how much log-likelihood a smooth bend explains the levels better than an effect.

    `mean` are the numbers predicted with the effect, whose size is free; the smooth bend is a
    polynomial in the signal S. Minus infinity: levels do not say.
    """
    seen = _Levels.of(state, mean)
    if seen is None:
        return -np.inf
    return seen.behind([[seen.change]], seen.smooth)


def behind_switch(state: State, mean: Array) -> float:
    """Return by how much a switch of the read-out explains the levels better than a bend.

    Where a path of the camera ends, gains are others above, or have another slope; the bend is as
    predicted with it, or any that is smooth. Levels below and above tell. As `behind_smooth` else.
    """
    ends = [own.upper_dn for own in state.camera.noise.segment if own.upper_dn is not None]
    seen = _Levels.of(state, mean) if ends else None
    if seen is None:
        return -np.inf
    lit = np.unique(seen.signal)
    ends = [e for e in ends if min((lit < e).sum(), (lit >= e).sum()) >= _LEAST_FLATS]
    if not ends:
        return -np.inf
    top = seen.signal.max()
    above = [seen.signal / top * (seen.signal >= end) for end in ends]
    beyond = [np.maximum(seen.signal - end, 0.0) / top for end in ends]
    return seen.behind([[seen.change], *seen.smooth], [[one] for one in (*above, *beyond)])


@dataclass(frozen=True)
class _Levels:
    """Levels of flats that differ from a model's, and what an effect changes of them: (level,).

    Attributes
    ----------
    value, change
        What is left without the effect, and what it makes, DN.
    sd
        Standard deviations, DN.
    signal
        DN above black.
    scales
        Of each channel: its signal.
    """

    value: Array
    change: Array
    sd: Array
    signal: Array
    scales: tuple[Array, ...]

    @classmethod
    def of(cls, state: State, mean: Array) -> "_Levels | None":
        """Return the levels; None: there are none that an effect changes."""
        flats = {e.name for e in state.setting.layout.uniform if e.kind == "flat"}
        signals = state.calibrated.fit.signal_dn
        which = [
            i
            for i, key in enumerate(state.vector.keys)
            if key.statistic == "level" and key.scope == "exposure" and key.exposure in flats
            if state.null.known[i] and np.isfinite(mean[i])
        ]
        places = [state.vector.keys[i].place for i in which]
        value, change = (own[which] - state.null.mean[which] for own in (state.vector.values, mean))
        if not change.any():
            return None
        signal = np.array([max(signals[at], 0.0) for at in places])
        channels = sorted({channel for _, channel in places})
        masks = [np.array([own == channel for _, own in places]) for channel in channels]
        scales = tuple(np.where(own, signal / signal.max(), 0.0) for own in masks)
        return cls(value, change, state.null.sd[which], signal, scales)

    @property
    def smooth(self) -> list[list[Array]]:
        """Polynomials in the signal, one that bends one way, and one that bends by more."""
        s = self.signal / self.signal.max()
        return [[s**power for power in range(2, most + 1)] for most in _DEGREES]

    def behind(self, some: Sequence[Sequence[Array]], others: Sequence[Sequence[Array]]) -> float:
        """Return by how much log-likelihood the best of other laws is better than that of some.

        Beside each, every channel's scale is free. A free number costs half the logarithm of the
        number of levels (Schwarz, Annals of Statistics 6, 1978); where even the better law misfits,
        all errors are larger by as much (Birge, Physical Review 40, 1932). Minus infinity: levels
        are too few.
        """
        count, laws = len(self.value), [[*self.scales, *law] for law in (*some, *others)]
        if any(len(law) >= count for law in laws):
            return -np.inf
        misfits = [self._misfit(law) for law in laws]
        cost = [misfit + len(law) * log(count) for misfit, law in zip(misfits, laws, strict=True)]
        wider = min(misfit / (count - len(law)) for misfit, law in zip(misfits, laws, strict=True))
        return (min(cost[: len(some)]) - min(cost[len(some) :])) / 2 / max(wider, 1.0)

    def _misfit(self, columns: Sequence[Array]) -> float:
        """Return the sum of squares that columns leave of values, in standard deviations."""
        design, value = np.stack(columns, 1) / self.sd[:, np.newaxis], self.value / self.sd
        rest = value - design @ np.linalg.lstsq(design, value, rcond=None)[0]
        return float((rest**2).sum())


def by_levels(state: State, kind: str, without: Array, mean: Array) -> tuple[bool, Denial | None]:
    """Return whether levels show a bend, and how they deny it: it is smooth, or it is not.

    That they show it says that means of exposures are off without it, and half as far with it.
    """
    levels = np.array([key.statistic == "level" for key in state.vector.keys]) & state.null.known
    levels &= np.isfinite(without) & np.isfinite(mean)
    values, sd = state.vector.values[levels], state.null.sd[levels]
    before, after = np.abs(values - without[levels]), np.abs(values - mean[levels])
    seen = bool(((before > FAR_OFF * sd) & (after < _MOST * before)).any())
    if seen and kind == "dual_gain_mismatch" and behind_smooth(state, mean) >= TOLD_APART:
        return seen, Denial(0.0, "levels bend smoothly, not where a read-out path begins")
    if kind == "nonlinearity" and behind_switch(state, mean) >= TOLD_APART:
        return seen, Denial(0.0, f"{_AT_SWITCH}, and do not bend smoothly")
    moved = float(np.abs(mean[levels] - without[levels]).max(initial=0.0))
    if seen and moved <= _of_widths(state):
        return seen, Denial(0.0, "codes are not equally wide, and their sum bends as much")
    return seen, None


def _of_widths(state: State) -> float:
    """Return by how much a converter whose codes are named unequally wide bends levels, DN.

    Of n codes whose widths scatter by d, each by itself, the sum in the middle is off by
    d sqrt(n) / 2, one standard deviation; and a bit of the largest weight that is off by d sqrt(n),
    which makes widths scatter by as much, puts half of that there.
    """
    widths = [own.rms_lsb for own in state.camera.effect if isinstance(own, AdcDnl)]
    if not widths:
        return 0.0
    step = code_step(state.camera)
    codes = max(state.calibrated.fit.signal_dn.values(), default=0.0) / step
    return float(np.linalg.norm(widths) * step * sqrt(max(codes, 0.0)) / 2)


def at_a_switch(state: State, kind: str, mean: Array) -> Denial | None:
    """Return how a residue of the converter is denied by levels that change at a switch; None: not.

    Where nothing but levels leads to it.
    """
    called = {m.statistic for m in state.mismatches}
    if kind != "adc_memory" or not called.isdisjoint(CANDIDATES[kind].calls):
        return None
    return Denial(0.0, _AT_SWITCH) if behind_switch(state, mean) >= TOLD_APART else None


def smooth_as_well(state: State, mean: Array, kind: str, other: str) -> bool:
    """Return whether levels bend smoothly by some law at least as well as they do at a switch.

    The one law of a bend that a nonlinearity is fitted as may gain less: its kind has others.
    """
    if (kind, other) != ("dual_gain_mismatch", "nonlinearity"):
        return False
    return 0 <= behind_smooth(state, mean) < TOLD_APART
