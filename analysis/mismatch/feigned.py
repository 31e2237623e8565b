"""Patterns and pixels that something else feigns: alike frames, halves, dark current."""

from math import log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.edges import edge_shapes
from analysis.mismatch.bank.robust import EFFICIENCY
from analysis.mismatch.bank.sawtooth import PLACES, sawteeth
from analysis.mismatch.bank.seams import SMOOTH_DEGREE, beyond_smooth, seam_shapes
from analysis.mismatch.coloured import MAPS, coloured
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.darkstart import begins_darker
from analysis.mismatch.displaced import displaced
from analysis.mismatch.edged import STATISTIC, edged, single
from analysis.mismatch.fading import fading
from analysis.mismatch.feignedtails import (
    clamped,
    coded,
    lopsided,
    mixed,
    placed,
    spiked,
    timed,
    underlaid,
)
from analysis.mismatch.fewfixed import of_few_that_stand_out
from analysis.mismatch.fields import interpolated
from analysis.mismatch.flatcolumns import flat_columns
from analysis.mismatch.grainedlines import grained, patterned
from analysis.mismatch.grown import grown, warmed
from analysis.mismatch.halves import halved
from analysis.mismatch.inpatches import in_patches
from analysis.mismatch.jumped import jumped, turned
from analysis.mismatch.leftopen import warm_left
from analysis.mismatch.movinglines import of_means
from analysis.mismatch.nofield import no_field
from analysis.mismatch.noslope import untold_slope
from analysis.mismatch.notfull import far_below
from analysis.mismatch.persisting import persisting
from analysis.mismatch.rivalled import rivalled
from analysis.mismatch.standout import heights, side_by_side
from analysis.mismatch.state import State
from analysis.mismatch.unequal import unequal
from analysis.mismatch.unequalframes import unequally_noisy
from analysis.mismatch.uneven import uneven
from analysis.mismatch.warmspots import warm_spots
from analysis.mismatch.waved import waved
from analysis.mismatch.wholeframes import of_pink_noise
from dsis.effects import Effect
from dsis.effects.black_level_drift import BlackLevelDrift
from dsis.effects.readout_memory import ReadoutMemory
from dsis.effects.rts import Rts
from dsis.measures.spikes import variance_of_quartiles

Array = NDArray[np.float64]
_AXES = {"row_fpn": "rows", "column_fpn": "columns", "row_prnu": "rows", "column_prnu": "columns"}
_GROWING = frozenset({"row_prnu", "column_prnu"})
_CLEAR = 5.0  # standard errors of what stands out
_STANDS_OUT, _FEW = 3.5, 0.1  # standard deviations; of pixels that jump
_ALIKE_ROWS = frozenset({"row_correlation", "slow_row_variance"})
_SHAPED = frozenset({"half_seam", "parity", STATISTIC})
_MOST = 0.5  # of a pattern's variance, or of tails, that something else may feign
_LONGEST = 1 / 8  # of a frame's rows, over which bands are taken to last


def of_another(state: State, effect: Effect, without: Array) -> Denial | None:
    """Return how an effect is denied by something unexplained that looks like it; None: it is not.

    `without` are the numbers predicted without the effect.
    """
    kind = effect.kind
    return (
        feigned(state, kind, without)
        or outlying(state, kind, without)
        or of_few_that_stand_out(state, effect)
        or side_by_side(state, kind)
        or in_patches(state, kind)
        or coloured(state, kind)
        or stepped(state, kind)
        or grown(state, kind, without)
        or warmed(state, effect)
        or waved(state, kind)
        or halved(state, effect)
        or edged(state, kind)
        or single(state, effect)
        or rivalled(state, effect)
        or heated(state, effect)
        or warm_spots(state, effect)
        or jumped(state, effect)
        or wandering(state, effect)
        or fading(state, effect)
        or of_pink_noise(state, effect)
        or flat_columns(state, effect)
        or unequal(state, effect, without)
        or uneven(state, effect)
        or coded(state, kind, without)
        or underlaid(state, kind, without)
        or lopsided(state, kind)
        or begins_darker(state, effect)
        or spiked(state, kind)
        or far_below(state, effect)
        or untold_slope(state, effect)
        or placed(state, kind, without)
        or clamped(state, kind, without)
        or mixed(state, kind)
        or grained(state, kind, without)
        or patterned(state, kind, without)
        or interpolated(state, kind)
        or timed(state, kind, without)
        or persisting(state, kind, without)
        or unequally_noisy(state, kind, without)
        or carried(state, effect)
        or no_field(state, effect)
        or displaced(state, kind, state.null.mean, without)
    )


def feigned(state: State, kind: str, without: Array) -> Denial | None:
    """Return how a pattern of single pixels is denied by what successive frames share; None: not.

    n frames of variance v, of correlation rho between neighbours (a mean over all, gaps included),
    have a mean frame of variance v / n (1 + 2 rho (n - 1) / n). Where that correlation is left
    unexplained, and feigns half of what the pattern would explain, there may be no pattern. Nor
    where all of it that stood out lies in maps over all exposures, and does no longer beyond that.

    Parameters
    ----------
    state
        With the effect.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in MAPS or all(m.statistic != "frame_correlation" for m in state.mismatches):
        return None
    numbers = {e.name: e.numbers for e in state.setting.layout.exposures}
    larger = {
        (key.exposure, key.channel): _in_means(
            state.vector.values[i] - state.null.mean[i], len(numbers[key.exposure])
        )
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "frame_correlation" and state.null.known[i] and key.exposure in numbers
    }
    explains = state.null.mean - without > state.null.sd
    share = of_means(state, (MAPS[kind], "fixed_pixel_variance"), larger, without, explains)
    why = "successive frames are alike for another reason, and feign a fixed pattern"
    return None if share is None else Denial(share, why)


def _in_means(rho: float, frames: int) -> float:
    """Return by which share of itself the variance of a mean of alike frames is larger."""
    return 2 * rho * (frames - 1) / frames


def stepped(state: State, kind: str) -> Denial | None:
    """Return how white line deviations are denied by a step, a comb or a decay; None: not.

    Two amplifiers, left and right or line by line, make lines differ too, and so does a read-out
    that settles. Where a step, a comb or a decay from an edge is left unexplained, and they make
    half of what the lines differ by beyond smooth surfaces, lines may be alike but for that.
    """
    axis = _AXES.get(kind)
    if axis is None or not any(m.statistic in _SHAPED for m in state.mismatches):
        return None
    whole, rest = 0.0, 0.0
    images = state.setting.seen.images
    for (channel, name), (image, noise) in images.items():
        own_map = "gain" if kind in _GROWING else "offset"
        if name != (f"{own_map} alone" if (channel, f"{own_map} alone") in images else own_map):
            continue
        means = (image - image.mean()).mean(1 if axis == "rows" else 0) / noise
        own = beyond_smooth(means)
        shapes = np.vstack([*seam_shapes(means.size), edge_shapes(means.size)])
        without = own - shapes.T @ np.linalg.lstsq(shapes.T, own, rcond=None)[0]
        across = image.size / means.size
        free = means.size - 1 - SMOOTH_DEGREE
        whole += float(own @ own) * across - free
        rest += float(without @ without) * across - (free - len(shapes))
    if whole <= 0 or rest >= _MOST * whole:
        return None
    return Denial(
        rest / whole,
        "halves, even and odd lines, or lines at an edge differ as a whole and feign it",
    )


def heated(state: State, effect: Effect) -> Denial | None:
    """Return how pixels that jump are denied by others that stand out with exposure time.

    The dark current of hot pixels is noisy, and so are they, in long exposures. Where pixels that
    grow with time are left unexplained, they may be all that is noisy; unless these jump
    themselves, as hot ones do not, or they are far fewer than those that jump.
    """
    if not isinstance(effect, Rts) or not warm_left(state) or turned(state):
        return None
    maps = [own for (_, name), own in state.setting.seen.images.items() if name == "time"]
    seen = [heights(*own) for own in maps]
    # One that jumped stands out to either side.
    left = sum(int((own > _STANDS_OUT).sum()) - int((own < -_STANDS_OUT).sum()) for own in seen)
    if left < _FEW * effect.pixel_fraction * sum(own.size for own in seen):
        return None
    why = "pixels that stand out with exposure time are left, whose dark current is noisy too"
    return Denial(0.0, why)


def wandering(state: State, effect: Effect) -> Denial | None:
    """Return how a wander of whole frames is denied by rows that are alike; None: it is not.

    A row's offset that lasts over some rows moves the mean of few rows too: by the power of row
    means at no frequency, over their number. Their slow waves have a share of that power. Where
    these are left unexplained, and would do so, no frame may wander by itself.
    """
    called = {m.statistic for m in state.mismatches}
    if not isinstance(effect, BlackLevelDrift) or called.isdisjoint(_ALIKE_ROWS):
        return None
    seen, layout = state.setting.seen, state.setting.layout
    waves = [
        state.vector.values[i] ** 3 - state.null.mean[i] ** 3
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "slow_row_variance" and state.null.known[i]
    ]
    white = min(level.variance_dn2 for level in seen.levels.values())
    white /= layout.rows * layout.columns
    feigned_dn2 = max(waves, default=0.0) * white / _slow_share(layout.rows)
    if effect.sigma_dn == 0 or feigned_dn2 < _MOST * effect.sigma_dn**2:
        return None
    share = 1 - feigned_dn2 / effect.sigma_dn**2
    return Denial(share, "rows that are alike for another reason move the frames' means")


def _slow_share(rows: int) -> float:
    """Return the share of the power at no frequency that slow waves of a Markov series have.

    With waves of k cycles counted by 1 / k, as the bank counts them; of the longest bands, those
    of shorter ones have more.
    """
    cycles = np.arange(1, max(rows // 2, 1) + 1)
    alike = float(np.exp(-1 / (_LONGEST * rows)))
    turn = 2 * np.pi * cycles / rows
    power = (1 - alike) ** 2 / (1 - 2 * alike * np.cos(turn) + alike**2)
    return float((power / cycles).sum() / (1 / cycles).sum())


def carried(state: State, effect: Effect) -> Denial | None:
    """Return how memory of the sample before is denied by what follows its code; None: it is not.

    The residue of a converter makes neighbours alike, too, as its steps lie in the noise. Where
    what samples have from the code before is left unexplained, and the best of all residues
    explains as much as memory in proportion, whatever their sizes, at odds that allow for all
    that were looked at, there may be no such memory.
    """
    called = {m.statistic for m in state.mismatches}
    if not (
        isinstance(effect, ReadoutMemory) and effect.lag_pixels == 1 and "carry_over" in called
    ):
        return None
    samples = state.setting.seen.carried.get(effect.along, ())
    square = sum(own.square_dn2 / own.variance_dn2 for own in samples)
    if square <= 0:
        return None
    through = sum(own.follows * own.square_dn2 / own.variance_dn2 for own in samples)
    tried = sawteeth(samples, whole=True)
    best = max(one.chi2 for one in tried)
    behind = (best - through**2 / square) / 2 - log(PLACES * len(tried))
    return rival(behind, "samples follow the codes before them, which explains it as well")


def outlying(state: State, kind: str, without: Array) -> Denial | None:
    """Return how a pattern of all pixels is denied by few that stand far out; None: not.

    Where pixels that stand out are left unexplained, and make half of the map's variance beyond its
    noise, the others may be alike: quartiles know of the many. Where these differ for certain in
    the map from which offsets or gains beside it are taken off, they do. Hot pixels are few, and
    stand out: asked is whether most of those are left that do so with exposure time. The law of
    their heights may be another, and leave some.
    """
    if kind not in MAPS or all(m.statistic != "outlying_pixels" for m in state.mismatches):
        return None
    if kind == "hot_pixels" and not (warm_left(state) and _mostly_left(state, without)):
        return None
    shares: list[float] = []
    own = True
    for name in MAPS[kind]:  # others' patterns are taken off the first, which is noisier
        plain, most, error = _of_many(state, name)
        if own and plain > 0 and most >= _MOST * plain and most > _CLEAR * error:
            return None
        shares += [most / plain] if plain > _CLEAR * error else []
        own &= error == 0  # there is no such map
    share = min(shares, default=1.0)
    if share >= _MOST:
        return None
    return Denial(
        max(share, 0.0), "few pixels that stand far out make most of what it would explain"
    )


def _mostly_left(state: State, without: Array) -> bool:
    """Return whether half of the pixels that stand out with exposure time are left, at any limit.

    They are counted: a fourth moment is the brightest one's, of whatever law.
    """
    own = np.array(
        [
            key.statistic == "outlying_pixels" and key.scope == "time" and key.detail != ""
            for key in state.vector.keys
        ]
    )
    own &= state.null.known & np.isfinite(without)
    sd = state.null.sd[own]
    left = (state.vector.values - state.null.mean)[own]
    there = (state.vector.values - without)[own]
    return bool(((there > _CLEAR * sd) & (left > _CLEAR * sd) & (left > _MOST * there)).any())


def _of_many(state: State, name: str) -> tuple[float, float, float]:
    """Return a map's variance beyond noise, that of its many pixels, and the latter's error.

    Relative to the noise, summed over channels. A variance by quartiles has 37 % of the efficiency.
    """
    plain, most, square = 0.0, 0.0, 0.0
    for (_, own), (image, noise) in state.setting.seen.images.items():
        if own != name:
            continue
        low, high = np.percentile(image, [25, 75])
        plain += float(image.var()) / noise**2 - 1
        most += variance_of_quartiles(float(low), float(high)) / noise**2 - 1
        square += 2 / (EFFICIENCY * image.size)
    return plain, most, square**0.5
