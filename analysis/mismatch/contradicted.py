"""Effects that the very statistics which call for them deny."""

from collections.abc import Container
from dataclasses import dataclass, replace
from math import exp

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import CANDIDATES, calls_of
from analysis.mismatch.credited import joined
from analysis.mismatch.layout import Place
from analysis.mismatch.masked import with_path
from analysis.mismatch.polish import Polished
from analysis.mismatch.predict import Predictor
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from analysis.mismatch.words import statistic_words
from dsis.camera import Camera

Array = NDArray[np.float64]
_LEAST_SHARE = 0.5  # of what an effect predicts, that a recording must show
_SURE = 2.0  # standard errors below it: 3.5 below what the right effect shows
_ALONE = " alone"
_SHAPE = frozenset(
    {"kurtosis", "kurtosis_within_pixels", "one_off_outliers", "skewness", "variance_spread"}
)
_WIDER = 0.5  # of a doubling, by which steps between codes are wider than the model's
_MOST = 0.5  # of what calls for an effect, that codes may shape
_CLEAR = 3.0  # standard deviations: a predicted change that can be seen at all
_LARGEST = 700.0  # of an exponent


@dataclass(frozen=True)
class Denial:
    """Which share of what an effect predicts a recording shows, and the same in words."""

    share: float
    why: str


def rival(behind: float, why: str) -> Denial | None:
    """Return how an effect is denied that is `behind` another cause, in log-likelihood.

    None: it is likelier at odds of 20. The share is the probability that it is the cause.
    """
    return None if behind <= -TOLD_APART else Denial(1 / (1 + exp(min(behind, _LARGEST))), why)


def contradicted(
    state: State,
    predictor: Predictor,
    kind: str,
    without: Camera,
    another: Camera | None = None,
) -> Denial | None:
    """Return how an effect of the state's camera is denied by the recording; None: it is not.

    Of each statistic that calls for the effect, over all channels and over all exposures with light
    or all without, what the model without it leaves open is projected on what the effect changes:
    sum(c d) / sum(c^2) is 1 for the right effect, c and d in standard deviations that allow for its
    form. One statistic that shows less than half of it denies the effect: a tilt, say, is nearly a
    difference of the halves, but has no step where they meet; an amplifier glows in the dark too.
    `another`: the state's camera without another effect, were that not there.
    """
    mean, own = predictor.mean(without), state.null.mean
    shift = 0.0 * own if another is None else np.nan_to_num(predictor.mean(another) - own)
    return _denied(state, predictor, kind, mean + shift, own + shift, state.null.sd)


def refuted(
    state: State,
    predictor: Predictor,
    kind: str,
    fitted: Polished,
    left: Container[str] = frozenset(),
) -> Denial | None:
    """Return the same of an effect that a state's camera has not, as it was fitted.

    What the effect itself draws makes numbers scatter too: of a few spikes in a recording most
    exposures have none, and that denies none elsewhere. Codes deny it too, see `_of_codes`.
    `left` are kinds that may be there as well: a second read-out path may mask it in the variances,
    see `with_path`.
    """
    camera, mean = joined(state.camera, fitted.effects, state.setting.given), fitted.mean
    _, sd, known = predictor.weights(mean)
    change = np.where(known, predictor.forms * (mean - state.null.mean), 0.0)
    drawn = 0.0 * sd if camera is None else np.where(known, predictor.spread(camera), 0.0)
    drawn = _alike_spread(state, np.where(known, mean - state.null.mean, 0.0), drawn)
    scatter = np.sqrt(np.maximum(sd**2 - change**2, state.null.sd**2) + drawn**2)
    denial = _denied(state, predictor, kind, state.null.mean, mean, scatter)
    if (
        denial is not None
        and "dual_gain" in left
        and (both := with_path(state, mean, kind)) is not None
    ):
        alone = state.null.mean + both - mean
        denial = _denied(state, predictor, kind, alone, both, scatter)
    return denial or _of_codes(state, kind, mean)


def _alike_spread(state: State, change: Array, drawn: Array) -> Array:
    """Return how far what an effect draws scatters: as far, relative to it, at all exposures alike.

    Few simulations may all have a spike in an exposure where the recording has none.
    """
    groups: dict[tuple[str, str, str], list[int]] = {}
    for i, key in enumerate(state.vector.keys):
        if change[i]:
            groups.setdefault((key.statistic, key.scope, key.detail), []).append(i)
    found = drawn.copy()
    for which in groups.values():
        share = np.minimum(drawn[which] / np.abs(change[which]), 1.0)
        alike = float(np.sqrt(np.mean(share**2)))
        found[which] = np.maximum(drawn[which], alike * np.abs(change[which]))
    return found


def _of_codes(state: State, kind: str, mean: Array) -> Denial | None:
    """Return how an effect is denied by coarse codes; None: it is not.

    The shape of noise that is no wider than the distance of the codes is theirs, and its mean lies
    by up to half of it off: where codes are farther apart than the model's, and that is
    unexplained, nothing else is told by it. `mean` are the numbers with the effect; most of what it
    changes may be such. Widths that scatter make codes rare; they do not leave them out in steps.
    """
    if all(m.statistic != "code_spacing" for m in state.mismatches):
        return None
    if kind == "adc_dnl":
        return Denial(0.0, "codes come in steps, which widths that scatter do not make")
    narrow = coarse(state)
    known = state.null.known & np.isfinite(mean)
    moved = np.where(known, np.nan_to_num(mean) - state.null.mean, 0.0)
    change = (moved / state.null.sd) ** 2
    calls = calls_of(kind)
    own = np.array([key.statistic in calls for key in state.vector.keys])
    theirs = np.array(
        [
            key.place in narrow
            and (
                key.statistic in _SHAPE
                or (key.statistic == "level" and abs(dn) <= narrow[key.place] / 2)
            )
            for key, dn in zip(state.vector.keys, moved.tolist(), strict=True)
        ]
    )
    whole, feigned = float(change[own].sum()), float(change[own & theirs].sum())
    if feigned <= _MOST * whole:
        return None
    return Denial(1 - feigned / whole, "codes come in steps no finer than the noise they shape")


def coarse(state: State) -> dict[Place, float]:
    """Return the distance of codes, DN, where it is wider than the model's and than the noise."""
    found: dict[Place, float] = {}
    seen = state.setting.seen
    for key, log_dn, model in zip(
        state.vector.keys, state.vector.values, state.null.mean, strict=True
    ):
        if key.statistic != "code_spacing" or key.place not in seen.levels:
            continue
        # Of what is unknown nothing is larger.
        gap = max(
            float(np.nan_to_num(2.0**log_dn)), np.nan_to_num(seen.gaps_dn.get(key.place, 0.0))
        )
        if gap > 2 ** (model + _WIDER) and seen.levels[key.place].variance_dn2 <= gap**2:
            found[key.place] = gap
    return found


def _denied(
    state: State, predictor: Predictor, kind: str, without: Array, mean: Array, sd: Array
) -> Denial | None:
    if kind not in CANDIDATES:
        return None
    known = state.null.known & np.isfinite(mean) & np.isfinite(without)
    known &= np.isfinite(state.vector.values)
    change = np.where(known, np.nan_to_num(mean) - np.nan_to_num(without), 0.0) / sd
    form = np.sqrt(1 + (predictor.forms * change) ** 2)
    clear = np.abs(change) > _CLEAR
    left = np.where(known, state.vector.values - np.nan_to_num(mean), 0.0) / sd
    darks = {e.name for e in state.setting.layout.exposures if e.kind == "dark"}
    groups: dict[tuple[str, str, str, bool], list[int]] = {}
    maps = {key: bool(clear[i]) for i, key in enumerate(state.vector.keys) if known[i]}
    for i, key in enumerate(state.vector.keys):
        # As if there were no other, a map has what is another's: of an effect that the map itself
        # does not show it says nothing.
        if not maps.get(replace(key, scope=key.scope.removesuffix(_ALONE)), True):
            continue
        if clear[i] and key.statistic in CANDIDATES[kind].calls:
            dark = key.exposure in darks
            groups.setdefault((key.statistic, key.scope, key.detail, dark), []).append(i)
    found = []
    for (statistic, *_), which in groups.items():
        own, rest = change[which] / form[which], left[which] / form[which]
        square = float(own @ own)
        share = 1 + float(own @ rest) / square
        if share + _SURE / np.sqrt(square) < _LEAST_SHARE:
            words = statistic_words(statistic)
            why = f"the recording shows {max(share, 0):.0%} of the change it predicts in: {words}"
            found.append(Denial(share, why))
    return min(found, key=lambda denial: denial.share, default=None)
