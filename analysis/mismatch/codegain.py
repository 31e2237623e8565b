"""What histograms of codes gain by uneven widths that are in step with powers of two."""

from math import inf, isfinite
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.codephase import DETAIL, LABEL
from analysis.mismatch.bank.sawtooth import PERIODS, explained
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.polish import with_effects
from analysis.mismatch.state import Setting, State
from dsis.camera import Camera
from dsis.effects import Effect
from dsis.effects.adc_dnl import AdcDnl
from dsis.effects.adc_memory import AdcMemory
from dsis.effects.poisson_shot_noise import PoissonShotNoise

Array = NDArray[np.float64]
_COUNTED: Literal["poisson_shot_noise"] = "poisson_shot_noise"
_OF_DIFFERENCES = 2 / 3  # of many frames: successive ones share a frame
_CHANCE = 2.0  # standard deviations
_MOST = 0.5  # of a score that others may make
_PAID = 2.0  # nats: for the size, and for the period that is the best of six


def gain_by_codes(setting: Setting, effect: Effect, without: State | None = None) -> float:
    """Return what codes gain by uneven widths or a residue, nats; minus infinity: neither.

    Nothing by widths whose order a state without them has already.
    """
    if without is not None and in_step_already(without, effect):
        return -inf
    return max(gain_of_codes(setting, effect), gain_of_residue(setting, effect))


def gain_of_codes(setting: Setting, effect: Effect) -> float:
    """Return the log-likelihood that folded histograms gain by uneven widths of codes, nats.

    Of a normal score z it is z^2 / 2. Widths drawn at random, as the effect has them, are hardly
    ever so much in order: numbers of its simulations say less of bits that have a wrong weight.
    Minus infinity of any other effect, and where no period is covered by noise.
    """
    if not isinstance(effect, AdcDnl):
        return -inf
    scores = [float(own[LABEL][0]) for own in setting.seen.pooled.values() if LABEL in own]
    most = max((score for score in scores if isfinite(score)), default=0.0)
    return most**2 / 2 - _PAID if most > 0 else -inf


def in_step_already(state: State, effect: Effect) -> bool:
    """Return whether a state's model has codes as much in step as the recording, within chance.

    Electrons of whole codes, or of as many as a power of two, are. Of others it hangs on where
    levels lie to less than an electron: half of what is seen is theirs as well. False of any
    effect but widths.
    """
    if not isinstance(effect, AdcDnl):
        return False
    own = np.array([key.detail == DETAIL for key in state.vector.keys]) & state.null.known
    left = (state.vector.values - state.null.mean)[own] / state.null.sd[own]
    within = bool(own.any() and (left < _CHANCE).all())
    return within or (_counts(state.camera) and _of_half(state, state.null.mean))


def of_electrons(state: State) -> bool:
    """Return whether electrons that are counted make codes in step, or would: half of it or more.

    Of a camera that does not count them this is asked where skewness differs, which calls for it.
    """
    if _counts(state.camera):
        return _of_half(state, state.null.mean)
    if {m.statistic for m in state.mismatches}.isdisjoint(CANDIDATES[_COUNTED].calls):
        return False
    camera = with_effects(state.camera, [PoissonShotNoise(kind=_COUNTED)])
    return camera is not None and _of_half(state, state.predictor().mean(camera))


def _counts(camera: Camera) -> bool:
    counted = any(own.kind == _COUNTED for own in camera.effect)
    return counted or camera.noise.shot == "poisson"


def _of_half(state: State, mean: Array) -> bool:
    """Return whether numbers that are predicted are in step by half of what is seen, or more.

    Of channels that are seen in step, beyond chance.
    """
    seen = state.vector.values
    own = np.array([key.detail == DETAIL for key in state.vector.keys]) & state.null.known
    own &= seen > _CHANCE * state.null.sd
    return bool(own.any() and (mean[own] >= _MOST * seen[own]).all())


def gain_of_residue(setting: Setting, effect: Effect) -> float:
    """Return the log-likelihood that samples gain by what they have of the residue before, nats.

    Beyond what goes in proportion to the sample before, so that it says nothing for other memories.
    A sawtooth has more than the first wave of its period, and than numbers whose likelihood has
    heavy tails allow one of them. Minus infinity of any other effect.
    """
    if not isinstance(effect, AdcMemory) or effect.period_codes not in PERIODS:
        return -inf
    samples = setting.seen.carried.get(effect.along, ())
    chi2 = explained(samples, effect.period_codes, effect.at_code, effect.step_dn)
    return _OF_DIFFERENCES * chi2 / 2 if samples else -inf
