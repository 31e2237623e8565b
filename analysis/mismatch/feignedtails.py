"""Tails that something else feigns: codes of unequal width, noise that leans, or has its place."""

from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.persistent import BY_LINE, SURFACE
from analysis.mismatch.basefit import cut_off
from analysis.mismatch.burst import TAILS
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Place
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.recalibrate import code_step
from analysis.mismatch.resolved import CLEAR, FAR_OFF
from analysis.mismatch.sidedneighbours import SHARED
from analysis.mismatch.state import State
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.impulse import Impulse

Array = NDArray[np.float64]
_CUT, _NEARLY_ALL = -0.1, 0.9  # of a kurtosis; of all exposures and channels
_SHAPES = frozenset({"kurtosis", "kurtosis_within_pixels"})
_ALIKE = frozenset(
    {
        "adc_dnl", "adc_memory", "brighter_fatter", "column_noise", "crosstalk", "line_flicker",
        "pink_noise", "readout_memory", "row_banding", "row_noise", "spatial_filtering",
    }
)  # fmt: skip
_MOST = 0.5  # of tails, that something else may feign
_LITTLE = 0.05  # of tails, that spikes may feign whose neighbours have some of them
_SOME = 0.2  # of tails, that spikes may feign beside others that lean as they do
_TALL = 20.0  # standard deviations, that no noise of some lines has
_SCATTER = 1.84  # see `coded`
_OF_PIXELS = frozenset({"variance_spread", "one_off_outliers"})
_TAILS = TAILS | {"read_noise_spread", "rts"}
_OF_SAMPLES = frozenset({"adc_dnl", "heavy_tailed_read_noise", "read_noise_spread"})
_IN_TIME = "frame_correlation"
_ADJACENT = ("correlation_0_1", "correlation_1_0")
_TIMES = 2  # of darks, that tell what needs time
_LIKELY = 2.0  # standard deviations that chance may well have
_FEW_ELECTRONS = 1.0  # skewness of shot noise of one electron: read noise beside it lessens it


def coded(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails, or few spikes, are denied by codes of unequal width; None: they are not.

    Codes whose widths scatter by d (of a code) change the excess kurtosis of noise of s codes by
    chance: by sum(w 4 He2(u) phi(u)) / s over codes at u, whose standard deviation is 1.84 d /
    sqrt(s). It is the same in all darks, which use the same codes, and another at each level. Where
    such widths are left unexplained or named, and two standard deviations feign half of what tails
    would explain, there may be no tails: of a converter whose widths are named the model draws
    others. What is claimed where widths are unknown, in less noise than two codes, counts as
    claimed.
    """
    codes = ("code_imbalance", "code_spacing")
    widths = [e.rms_lsb for e in state.camera.effect if isinstance(e, AdcDnl)]
    drawn = float(np.linalg.norm(widths)) if widths else 0.0
    open_ = any(m.statistic in codes for m in state.mismatches)
    if kind not in TAILS or not (open_ or drawn):
        return None
    claimed: dict[Place, float] = {}
    left: dict[Place, float] = {}
    for i, key in enumerate(state.vector.keys):
        place = (key.exposure, key.channel)
        known = state.null.known[i] and np.isfinite(without[i])
        if not known or place not in state.setting.seen.levels or key.scope != "exposure":
            continue
        if key.statistic == "kurtosis":
            claimed[place] = state.null.mean[i] - without[i]
        elif key.statistic == "code_imbalance":
            seen, expected = state.vector.values[i], state.null.mean[i]
            beyond = max(seen**2 - expected**2, 0.0) if open_ and seen > 0 else 0.0
            left[place] = float(np.hypot(np.sqrt(beyond), drawn))
    whole = sum(change**2 for change in claimed.values())
    darks = {e.name for e in state.setting.layout.exposures if e.kind == "dark"}
    in_darks, elsewhere = 0.0, 0.0
    if drawn:
        left = dict.fromkeys(claimed, drawn) | left
    for place in sorted(claimed.keys() & left.keys()):
        sd = max(state.setting.seen.levels[place].variance_dn2, 1e-9) ** 0.5
        scatter = _SCATTER * left[place] * (code_step(state.camera) / sd) ** 0.5
        if place[0] in darks:
            in_darks += abs(claimed[place]) * scatter
        else:
            elsewhere += (claimed[place] * scatter) ** 2
    fake = _LIKELY * (in_darks**2 + elsewhere) ** 0.5
    if whole <= 0 or fake <= _MOST * whole:
        return None
    return Denial(1 - fake / whole, "codes are not equally wide, and feign tails")


def underlaid(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails are denied by spikes too low to be put aside; None: they are not.

    Beside many strong spikes there are weaker ones by the same law: what these add to the kurtosis
    is known. Where it is half of what tails would explain, or a fifth and darks lean up, there may
    be none; nor where it is a twentieth and what makes neighbours alike is named, for the samples
    around all spikes then have some of them.
    """
    low = state.setting.low_spikes_dn4
    if kind not in _TAILS or not low:
        return None
    whole = fake = 0.0
    for i, key in enumerate(state.vector.keys):
        level = state.setting.seen.levels.get(key.place)
        known = state.null.known[i] and np.isfinite(without[i])
        if key.statistic != "kurtosis" or key.scope != "exposure" or level is None or not known:
            continue
        claimed = float(state.null.mean[i] - without[i]) / float(state.null.sd[i]) ** 2
        whole += claimed * float(state.null.mean[i] - without[i])
        fake += claimed * low.get(key.exposure, 0.0) / max(level.variance_dn2, 1e-9) ** 2
    least = _SOME if _darks_lean_up(state) else _MOST
    if not SHARED.isdisjoint(effect.kind for effect in state.camera.effect):
        least = _LITTLE
    if whole <= 0 or fake <= least * whole:
        return None
    return Denial(max(1 - fake / whole, 0.0), "spikes too low to be counted make tails as well")


def _darks_lean_up(state: State) -> bool:
    """Return whether darks are off, all together, by noise that leans up."""
    darks = {e.name for e in state.setting.layout.uniform if e.kind == "dark"}
    left = state.null.departures(state.vector)
    leans = [
        float(z)
        for key, z, known in zip(state.vector.keys, left, state.null.known, strict=False)
        if known and key.statistic == "skewness" and key.exposure in darks
    ]
    return sum(leans) > FAR_OFF * sqrt(max(len(leans), 1))


def spiked(state: State, kind: str) -> Denial | None:
    """Return how unequal codes are denied by spikes; None: they are not.

    Samples far out fill codes that noise does not reach, one here and one there. Where such are
    left unexplained, and more than a few, they make codes uneven by themselves.
    """
    if kind != "adc_dnl":
        return None
    off = {m.statistic: m.z for m in state.mismatches}
    least = min(off.get(name, 0.0) for name in ("one_off_outliers", "kurtosis"))
    why = "samples far out are left unexplained, and make codes uneven"
    return Denial(0.0, why) if least > FAR_OFF else None


def lopsided(state: State, kind: str) -> Denial | None:
    """Return how tails or spikes are denied by noise that leans to one side; None: they are not.

    Heavy-tailed noise is as likely above as below. Chance leans it far, which the null with its
    tails knows; what leans beyond that, and more than shot noise can, are spikes of one sign.
    Spikes are charge, which only adds: beside no tails, and no uneven codes, darks whose noise
    leans down, as white noise scatters, have none.
    """
    if kind == "impulse":
        return _downwards(state)
    if kind != "heavy_tailed_read_noise":
        return None
    left = state.null.departures(state.vector)
    leans = any(
        key.statistic == "skewness"
        and key.scope == "exposure"
        and abs(z) > FAR_OFF
        and abs(value) > _FEW_ELECTRONS
        for key, z, value in zip(state.vector.keys, left, state.vector.values, strict=False)
    )
    return (
        Denial(0.0, "its tails are alike on both sides, those of the noise are not")
        if leans
        else None
    )


def _downwards(state: State) -> Denial | None:
    """Return how spikes are denied by darks that lean down; None: they are not."""
    darks = {e.name for e in state.setting.layout.uniform if e.kind == "dark"}
    if not _OF_SAMPLES.isdisjoint(effect.kind for effect in state.camera.effect):
        return None
    leans = any(
        key.statistic == "skewness" and key.exposure in darks and value < -FAR_OFF * error
        for key, value, error in zip(
            state.vector.keys, state.vector.values, state.vector.errors, strict=True
        )
    )
    return Denial(0.0, "spikes add charge, and the noise of darks leans down") if leans else None


def placed(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails or spikes are denied by noise that differs from place to place; None: not.

    Pixels of different noise have heavy tails in all of them together, and none by themselves.
    Where noise that varies smoothly, or from line to line, is left unexplained, they must show
    within single pixels, surely and by half, if these tell. Few spikes do not: beside lines that
    differ they may be those of the noisiest, unless they tower above all noise.
    """
    lines = any(m.statistic in BY_LINE for m in state.mismatches)
    uneven = lines or any(m.statistic == SURFACE for m in state.mismatches)
    if kind not in TAILS or not uneven:
        return None
    own = np.array([key.statistic == "kurtosis_within_pixels" for key in state.vector.keys])
    own &= state.null.known & np.isfinite(without)
    size, shown = seen_along(state, without, own)
    if size < CLEAR:
        few = Denial(0.0, "lines differ in noise, and what is far out may be noise of these")
        return few if lines and kind == "impulse" and not _tall(state) else None
    if shown >= max(CLEAR, _MOST * size):
        return None
    why = f"noise differs from place to place, and single pixels show them by {shown:.1f} errors"
    return Denial(0.0, why)


def _tall(state: State) -> bool:
    """Return whether the model's spikes are higher than any noise of the quietest exposure."""
    heights = [own.mean_dn for own in state.camera.effect if isinstance(own, Impulse)]
    quietest = min(state.setting.layout.variance_dn2.values(), default=inf)
    return max(heights, default=0.0) > _TALL * sqrt(quietest)


def timed(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails or spikes are denied by charge that needs time; None: they are not.

    Few electrons are no normal variate: a glow of less than one in a pixel looks like rare spikes.
    These know no exposure time. Where something grows with it and is left unexplained, tails must
    show in the darks of the shortest time, surely and by half of what they would change there. Rare
    ones would change next to nothing: of these none may be far off in longer darks alone, as white
    noise scatters.
    """
    darks = {e.name: e.exposure_time_s for e in state.setting.layout.uniform if e.kind == "dark"}
    grows = any(m.where.exposure_time_s is not None for m in state.mismatches)
    if kind not in TAILS or not grows or len(set(darks.values())) < _TIMES:
        return None
    shortest = min(darks.values())
    keys, known = state.vector.keys, state.null.known & np.isfinite(without)
    own = np.array(
        [
            key.exposure in darks
            and key.scope == "exposure"
            and key.statistic in _SHAPES | _OF_PIXELS
            for key in keys
        ]
    )
    own &= known
    short = own & np.array([darks.get(key.exposure, np.inf) <= shortest for key in keys])
    if not short.any():
        return None
    size, shown = seen_along(state, without, short)
    if size < CLEAR:
        off = np.where(own, (state.vector.values - without) / state.vector.errors, 0.0)
        none = off[short].max() < CLEAR and off.max() > FAR_OFF
    else:
        none = shown < max(CLEAR, _MOST * size)
    why = "something grows with exposure time, and darks of the shortest time have no tails"
    return Denial(0.0, why) if none else None


def mixed(state: State, kind: str) -> Denial | None:
    """Return how the law of single pixels' noise is denied by noise that neighbours share; None.

    Tails, and pixels that are noisier, are of samples drawn each by itself, and codes of unequal
    width are met by each sample by itself. Where neighbours along rows and along columns are far
    from that in the dark, or successive frames, and it is left unexplained - a camera that
    compresses, say, or averages - the noise has no such law.
    """
    darks = {e.name for e in state.setting.layout.exposures if e.kind == "dark"}
    if kind not in _OF_SAMPLES or not darks:
        return None
    left = left_open(state, (*_ADJACENT, _IN_TIME))

    def shared(name: str) -> bool:
        own = [one for (place, of), one in left.items() if of == name and place[0] in darks]
        rest, sd = np.mean(own, 0) if own else (0.0, 1.0)
        return bool(abs(rest) > FAR_OFF * sd)

    if shared(_IN_TIME):
        return Denial(0.0, "in the dark successive frames share noise, and no sample has its own")
    if not all(shared(name) for name in _ADJACENT):
        return None
    return Denial(0.0, "in the dark neighbours share noise, and no sample has its own")


def clamped(state: State, kind: str, without: Array) -> Denial | None:
    """Return how tails or spikes are denied by noise that is cut off at a code; None: they are not.

    What is left of noise that a clamp at black cuts off has another shape, whatever it was before.
    Where the model's is not cut off, tails must show in the other exposures, surely and by half of
    what they explain there.
    """
    levels, offsets = state.setting.seen.levels, state.calibrated.offsets
    cut = {p for p, own in levels.items() if cut_off(own, offsets, p)}
    if kind not in _TAILS or not cut:
        return None
    own = np.array(
        [
            key.scope == "exposure"
            and key.statistic in _SHAPES | _OF_PIXELS
            and (key.exposure, key.channel) not in cut
            for key in state.vector.keys
        ]
    )
    own &= state.null.known & np.isfinite(without)
    size, shown = seen_along(state, without, own)
    if shown >= max(CLEAR, _MOST * size):
        return None
    where = "would hardly show" if size < CLEAR else "shows none"
    return Denial(0.0, f"noise is cut off at a code, and {where} where it is not")


def seen_along(state: State, without: Array, own: NDArray[np.bool_]) -> tuple[float, float]:
    """Return what an effect changes some numbers by, and how far they go along, in errors.

    `own` are those asked: (number,), that are known with it and `without`.
    """
    change = (state.null.mean - without)[own] / state.null.sd[own]
    seen = (state.vector.values - without)[own] / state.null.sd[own]
    size = float(np.linalg.norm(change))
    return size, float(change @ seen) / size if size > 0 else 0.0


def replaced(state: State, kind: str) -> Denial | None:
    """Return how what makes samples alike is denied by samples that were replaced; None: not.

    A camera that corrects defects takes what its neighbours have for a sample that is far from
    them: tails are cut off on both sides, within pixels and over them, at all levels and without
    light, and neighbours are alike. Filters, shared charge and codes of unequal width cut none so.
    While that is unexplained they are not told from it.
    """
    if kind not in _ALIKE or not {m.statistic for m in state.mismatches} >= _SHAPES:
        return None
    own = np.array([k.statistic in _SHAPES and k.scope == "exposure" for k in state.vector.keys])
    own &= state.null.known
    left = (state.vector.values - state.null.mean)[own]
    cut = (left < _CUT) & (left < -_LIKELY * state.null.sd[own])
    if not own.any() or cut.mean() < _NEARLY_ALL:
        return None
    return Denial(0.0, "tails are cut off on both sides: samples far from others were replaced")
