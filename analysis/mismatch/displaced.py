"""What something unexplained makes as well: variances that bend, rows that differ.

Each law is of the statistics alone, whatever makes them: physics without a word, too.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from analysis.mismatch.alikesamples import of_alike_samples
from analysis.mismatch.brighter import no_brighter_alike
from analysis.mismatch.bylevel import otherwise_by_level
from analysis.mismatch.candidates.response import skewness_below
from analysis.mismatch.contradicted import Denial, coarse
from analysis.mismatch.covariances import of_frames, of_neighbours, straightened
from analysis.mismatch.feignedtails import replaced
from analysis.mismatch.fewlines import of_few_lines
from analysis.mismatch.framelag import alike_without_light
from analysis.mismatch.gathered import gathered
from analysis.mismatch.latelight import of_late_light
from analysis.mismatch.layout import Place
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.leftout import left_out
from analysis.mismatch.movinglines import LINES, moving_lines
from analysis.mismatch.otherlags import other_lags
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.recalibrate import code_step
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.sharing import shared_otherwise
from analysis.mismatch.smooth import at_a_switch, by_levels
from analysis.mismatch.state import State
from analysis.mismatch.straight import curves, misfit
from analysis.mismatch.wholeframes import of_moving_parts
from analysis.mismatch.wholelines import of_parts
from dsis.effects.readout_memory import ReadoutMemory

Array = NDArray[np.float64]
_PATH = "dual_gain"
_BENDS = frozenset({"nonlinearity", _PATH, "dual_gain_mismatch"})
_ADJACENT = ("correlation_0_1", "correlation_1_0")
_GREENS = frozenset({"channel_imbalance", "tap_mismatch"})
_MIXES = "crosstalk"  # which makes neighbours alike, and by that the greens differ
_BESIDE = ("R", "Gr", "Gb", "B")
_MOST = 0.5  # of a misfit, or of what white rows explain, that something else may make
_OF_A_LINE = 2  # numbers
_CHANCE = 1e-3  # that variances on a line misfit more
_LIMITS = (-1.5, 4.0)  # standard deviations at which noise may be cut


def displaced(state: State, kind: str, mean: Array, without: Array | None = None) -> Denial | None:
    """Return how an effect is denied by what is left and changes the same; None: it is not.

    Of bends of the photon transfer curve, asked is whether variances lie on a line once they are
    what they would be without: by covariances that neighbours have instead, or by what is cut off
    of noise that leans, or by levels that bend. Where that leaves half of the misfit or less, there
    may be no bend; nor where variances scatter no more than codes that are not equally wide make
    them, or are those of codes that come in steps. Of a bend that levels show is asked whether it
    is smooth, or begins where a read-out path does. Of filters, crosstalk and charge that repels
    charge, how alike neighbours are at each level; of counted photons and amplifiers of greens, by
    how much levels show them; of noise of whole lines, how alike samples along them are; of greens
    that differ, what other colours share with them; of frames that move as a whole, whether their
    parts do so alike. Of widths of codes, whether it is codes that never occur which make them
    differ; of lag, whether darks are alike; of memory, whether samples are alike at other lags as
    well; of pixels, whether those side by side do alike.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect.
    mean, without
        The numbers predicted with it, and without it; None: those of the state.
    """
    without = state.null.mean if without is None else without
    if (denial := replaced(state, kind)) is not None:
        return denial
    if kind in _BENDS:
        seen, denial = by_levels(state, kind, without, mean)
        if denial is None and not seen:
            denial = of_neighbours(state, mean) or of_frames(state) or _of_limits(state)
            denial = denial or _of_codes(state) or _of_steps(state)
        return denial or (_of_levels(state) if kind == _PATH else None)
    if kind in LINES:
        denial = of_few_lines(state, kind, without) or of_parts(state, kind)
        return denial or moving_lines(state, kind, without)
    if kind in _SAID:
        denial = of_few_lines(state, kind, without) or _SAID[kind](state)
        return denial or of_alike_samples(state, kind, mean, without)
    if kind in _GREENS | {_MIXES}:
        denial = None if kind == _MIXES else _of_colours(state, mean - without)
        denial = denial or _of_memory(state, mean - without)
        if denial is not None:
            return denial
    denial = (
        other_lags(state, kind, mean, without)
        or of_moving_parts(state, kind, without)
        or otherwise_by_level(state, kind, without, mean)
    )
    denial = denial or of_few_lines(state, kind, without, mean) or of_late_light(state, kind)
    denial = denial or shared_otherwise(state, kind, without) or at_a_switch(state, kind, mean)
    denial = denial or alike_without_light(state, kind, without)
    return denial or no_brighter_alike(state, kind, without)


def _of_limits(state: State) -> Denial | None:
    """Return how a bend is denied by noise that is cut off on one side; None: it is not.

    What a limit takes of the variance of normal noise is known from the skewness that it leaves.
    """
    cut = {
        place: 1 / _variance_below(brentq(lambda z, g=rest: skewness_below(z) + abs(g), *_LIMITS))
        for (place, _), (rest, sd) in left_open(state, ("skewness",)).items()
        if abs(rest) > FAR_OFF * sd and -skewness_below(_LIMITS[1]) < abs(rest)
        if abs(rest) < -skewness_below(_LIMITS[0])
    }
    why = "noise leans to one side for another reason, and what cuts it off lessens variances"
    return straightened(state, cut.get, why) if cut else None


def _of_levels(state: State) -> Denial | None:
    """Return how a second path is denied by levels that bend, and their noise with them; None: not.

    What is by a share off the light has its noise as far off, and the variance twice: a gain that
    falls with the signal, or with what is around a pixel. A path that leaves levels on a line
    scales noise alone.
    """
    signals = state.calibrated.fit.signal_dn
    gains = {
        place: signals[place] / (signals[place] - rest)
        for (place, _), (rest, _) in left_open(state, ("level",)).items()
        if signals.get(place, 0.0) > max(rest, 0.0)
    }
    before = after = 0.0
    for *curve, places in curves(state, beside=True):
        told = np.array([at in gains or x <= 0 for at, x in zip(places, curve[0], strict=True)])
        own = np.array([gains.get(at, 1.0) for at in places])[told]
        signal, variance, weight = (values[told] for values in curve)
        chance = max(signal.size - _OF_A_LINE, 0)
        before += misfit(signal, variance, weight) - chance
        after += misfit(signal / own, variance / own**2, weight) - chance
    if not gains or before <= 0 or after > _MOST * before:
        return None
    why = "levels bend for another reason, and noise as much"
    return Denial(max(after / before, 0.0), why)


def _of_codes(state: State) -> Denial | None:
    """Return how a bend is denied by codes that are not equally wide; None: it is not.

    Codes whose widths scatter by d (of a code) bend the converter at random: by Stein's lemma the
    variance of noise of s codes changes by 2 d sum(w phi) of itself, w of unit variance and phi
    the noise's density at each code, whose standard deviation is d (sqrt(pi) s)^-1/2 sqrt(2).
    """
    found = {
        place: max(rest * (2 * expected + rest), 0.0) ** 0.5
        for place, (rest, expected) in _left_of_codes(state).items()
    }
    if not found:
        return None
    typical, step = float(np.median(list(found.values()))), code_step(state.camera)

    def scatter(place: Place, variance_dn2: float) -> float:
        return float(2 * found.get(place, typical) ** 2 * step / (np.pi * variance_dn2) ** 0.5)

    apart = free = 0.0
    for signal, variance, weight, places in curves(state):
        extra = np.array([scatter(at, v) for at, v in zip(places, variance, strict=True)])
        apart += misfit(signal, variance, 1 / (1 / weight + extra))
        free += signal.size - _OF_A_LINE
    if free <= 0 or apart > float(chi2.isf(_CHANCE, free)):
        return None
    return Denial(0.0, "codes are not equally wide, and scatter the variances by as much")


def _of_steps(state: State) -> Denial | None:
    """Return how a bend is denied by codes that come in steps; None: it is not.

    Noise that is no wider than they are apart has their variance; any other has a twelfth of their
    square more, whatever the signal, and its variances lie on a line as before.
    """
    narrow = coarse(state)
    if not narrow:
        return None
    apart = free = 0.0
    for signal, variance, weight, places in curves(state):
        wide = np.array([at not in narrow for at in places])
        if wide.sum() > _OF_A_LINE:
            apart += misfit(signal[wide], variance[wide], weight[wide])
            free += float(wide.sum()) - _OF_A_LINE
    if free > 0 and apart > float(chi2.isf(_CHANCE, free)):
        return None
    return Denial(0.0, "codes come in steps, and variances of noise no wider are theirs")


def _left_of_codes(state: State) -> dict[Place, tuple[float, float]]:
    """Return what is left of how unevenly codes are used, and what is expected, by place."""
    expected = {
        (key.exposure, key.channel): max(float(mean), 0.0)
        for key, mean in zip(state.vector.keys, state.null.mean, strict=True)
        if key.statistic == "code_imbalance" and key.scope == "exposure"
    }
    left = left_open(state, ("code_imbalance",))
    return {place: (rest, expected[place]) for (place, _), (rest, _) in left.items()}


def _variance_below(limit: float) -> float:
    """Return the variance of a standard normal variate that is cut at a limit."""
    density, below = float(norm.pdf(limit)), float(norm.cdf(limit))
    mean = -density + limit * (1 - below)
    return below - limit * density + limit**2 * (1 - below) - mean**2


def _of_colours(state: State, change: Array) -> Denial | None:
    """Return how greens that differ are denied by charge that colours share; None: they are not.

    Gr has red beside it in its row and blue in its column, Gb the other way round. Neighbours whose
    noise has a correlation r share about r / 2: along rows Gr / Gb departs by r (R - B) / G, along
    columns by as much the other way. `change` is what the effect makes of the numbers.
    """
    left = left_open(state, _ADJACENT)
    if not left:
        return None

    def shared(exposure: str) -> float:
        rows, columns = (
            np.mean([left.get(((exposure, c), name), (0.0, 0.0))[0] for c in _BESIDE])
            for name in _ADJACENT
        )
        return float(rows - columns)

    why = "neighbours of other colours are alike, and what they share makes the greens differ"
    return _greens(state, change, shared, why)


def _of_memory(state: State, change: Array) -> Denial | None:
    """Return how greens that differ are denied by memory of other colours; None: they are not.

    A read-out may remember light as it does noise: of a share f of a sample that is an odd number
    of pixels before, along rows, Gr has f R and Gb has f B; along columns the other way round.
    """
    share = sum(
        own.fraction if own.along == "rows" else -own.fraction
        for own in state.camera.effect
        if isinstance(own, ReadoutMemory) and own.remembers == "noise" and own.lag_pixels % 2
    )
    if not share:
        return None
    why = "samples remember those of another colour, which makes the greens differ"
    return _greens(state, change, lambda _: share, why)


def _greens(state: State, change: Array, shared: Callable[[str], float], why: str) -> Denial | None:
    """Return how greens that differ are denied by what Gr has of red and Gb of blue; None: not.

    `shared` gives the share by the exposure's name; see `_of_colours`.
    """
    if set(_BESIDE) != set(state.setting.layout.channels):
        return None
    keys = state.vector.keys
    clear = np.where(state.null.known & np.isfinite(change), change, 0.0) / state.null.sd
    otherwise = ("parity", "half_seam", *_ADJACENT)
    besides = np.array([key.statistic in otherwise for key in keys])
    told = float((clear[besides] ** 2).sum())
    seen, fake, signals = 0.0, 0.0, state.calibrated.fit.signal_dn
    for i, key in enumerate(keys):
        if key.statistic != "channel_ratio" or key.scope != "exposure" or not clear[i]:
            continue
        red, *greens, blue = (max(signals[key.exposure, c], 0.0) for c in _BESIDE)
        if sum(greens) > 0:
            made = shared(key.exposure) * (red - blue) * 2 / sum(greens)
            seen += float(clear[i]) ** 2
            fake += float(clear[i]) * made / float(state.null.sd[i])
    if fake <= _MOST * seen or seen <= told:  # halves, neighbours: which tell more of it
        return None
    return Denial(max(1 - fake / seen, 0.0), why)


def _of_alike_rows(state: State) -> Denial | None:
    """Return how white noise of rows is denied by rows that are alike; None: it is not.

    Correlations that fall as any mixture of exponentials are log-convex: at lag 0 they have r1^2 /
    r2 at least, of lags 1 and 2. Where that is half of what is not noise of single pixels, there
    may be no more; unless whole frames show it besides.
    """
    if all(m.statistic != "row_correlation" for m in state.mismatches):
        return None
    lags: dict[str, dict[str, float]] = {}
    for key, value, known in zip(
        state.vector.keys, state.vector.values, state.null.known, strict=True
    ):
        if known and key.statistic == "row_correlation" and key.detail in ("lag 1", "lag 2"):
            lags.setdefault(key.scope + key.channel, {})[key.detail] = float(value)
    shares = [
        one["lag 1"] ** 2 / one["lag 2"]
        for one in lags.values()
        if len(one) == 2 and min(one.values()) > 0
    ]
    if not shares:
        return None
    alike, whole = min(max(shares), 1.0), _beyond_pixels(state)
    if whole <= 0 or alike < _MOST * whole or state.setting.noisy_rows() > TOLD_APART:
        return None
    return Denial(
        max(1 - alike / whole, 0.0), "rows are alike for another reason, and differ by as much"
    )


def _of_coloured_columns(state: State) -> Denial | None:
    """Return how white noise of columns is denied by a spectrum that is not flat; None: it is not.

    Offsets that are drawn anew for each column have no frequency. Where one stands far out of the
    spectrum of column means, with all that is named, columns are alike for another reason, which
    may make all that they differ by.
    """
    left = state.null.departures(state.vector)
    most = max(
        (
            float(z)
            for key, z in zip(state.vector.keys, left, strict=False)
            if key.statistic == "column_spectrum_peak"
        ),
        default=0.0,
    )
    if most <= FAR_OFF:
        return None
    return Denial(0.0, "the spectrum of column means is not flat, as that of white noise is")


def _beyond_pixels(state: State) -> float:
    """Return which share of the variance of rows' means is not that of noise of single pixels.

    Exposures are weighted as the correlations are: by the inverse variance of their pixels.
    """
    total = weights = 0.0
    frames = {e.name: len(e.numbers) for e in state.setting.layout.uniform}
    for key, value, known in zip(
        state.vector.keys, state.vector.values, state.null.known, strict=True
    ):
        place = (key.exposure, key.channel)
        if known and key.statistic == "row_variance" and place in state.setting.seen.levels:
            weight = (frames.get(key.exposure, 1) - 1) / state.setting.seen.levels[
                place
            ].variance_dn2
            total += weight * value**3
            weights += weight
    ratio = total / weights if weights else 1.0
    return max(1 - 1 / ratio, 0.0) if ratio > 0 else 0.0


_SAID = {
    "row_noise": _of_alike_rows,
    "column_noise": _of_coloured_columns,
    "adc_dnl": left_out,
    "read_noise_spread": gathered,
    "rts": gathered,
}
"""What a state says of an effect by itself: whether lines, codes or pixels differ one by one."""
