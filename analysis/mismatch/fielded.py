"""Uneven light, halves and decays that gains which neighbours share feign: fields lean too."""

from dataclasses import replace

import numpy as np
import scipy.stats
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.candidates.fields import Field, fields
from analysis.mismatch.candidates.patterns import gain_of
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.longwaves import LongWaves
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling
from dsis.effects.smooth_prnu import SmoothPrnu

Array = NDArray[np.float64]
_KINDS = frozenset({"shading", "tap_mismatch", "line_settling"})
_STATISTIC = "fixed_patch_variance"
_AS_LIKELY = 4.0  # of chi-squared: lengths that the gain's spectrum may well have
_CHANCE = 4.0  # standard deviations of a field: no direction of it is told beforehand
_VARIANCES = 8  # that are tried


def fielded(state: State, effect: Effect) -> Denial | None:
    """Return how a pattern of the whole sensor is denied by a field of gains; None: it is not.

    Where neighbours share gains, named or not, the map beyond smooth surfaces tells how much, and
    about how far; a field that is named, as it was fitted. If fields of a length that may well be
    have the pattern by chance, there may be no uneven light. Of a weak field that map tells no
    length: long ones would make the rest of the map as uneven, see `LongWaves`.
    """
    if effect.kind not in _KINDS or (isinstance(effect, LineSettling) and effect.offset_dn):
        return None  # an offset is no gain
    named = [own for own in state.camera.effect if isinstance(own, SmoothPrnu)]
    if not named and all(m.statistic != _STATISTIC for m in state.mismatches):
        return None
    others = tuple(own for own in state.camera.effect if not isinstance(own, SmoothPrnu))
    camera = state.camera.model_copy(update={"effect": others})
    clues = replace(state.clues(), camera=camera)
    found = fields(clues)
    pattern = gain_of([effect], state.setting.layout, camera.read_out)
    pattern -= pattern.mean()
    square = float((pattern**2).sum())
    if not (found or named) or square == 0:
        return None
    least = min((own.left for own in found), default=0.0)
    likely = [own for own in found if own.left <= least + _AS_LIKELY and own.variance > 0]
    by_chance = [(own.variance * _along(pattern, own.length), own) for own in likely]
    enough = [one for one in by_chance if square**2 < _CHANCE**2 * one[0]]
    waves = LongWaves(clues, pattern) if enough else None
    chances = [most for most, own in enough if waves and _may_be(waves, own, square**2 / most)]
    chances += [own.sigma_percent**2 * _along(pattern, own.length_pixels) for own in named]
    most = max(chances, default=0.0)
    if square**2 >= _CHANCE**2 * most:
        return None
    share = 1 - _CHANCE * most**0.5 / square
    return Denial(share, "gains that neighbours share are as uneven by chance")


def _may_be(waves: LongWaves, field: Field, size: float) -> bool:
    """Return whether a field of a length may have a pattern by chance and as little of long waves.

    Both are independent: the product p of their chances has a chance of p (1 - ln p) itself
    (Fisher, 1932). Of a smaller variance the one is more likely, the other less; `size` is the
    square of the pattern in standard deviations of the variance fitted.
    """
    for share in np.geomspace(size / _CHANCE**2, 1.0, _VARIANCES):
        chance = waves.chance(share * field.variance, field.length)
        chance *= float(scipy.stats.chi2.sf(size / share, 1))
        if chance > 0 and chance * (1 - np.log(chance)) > scipy.stats.chi2.sf(_CHANCE**2, 1):
            return True
    return False


def _along(pattern: Array, length: float) -> float:
    """Return the variance of a field's product with a pattern, for a field of variance 1."""
    around = tuple(2 * size for size in pattern.shape)
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in around)
    power = fft.fft2(np.exp(-np.hypot(y[:, None], x) / length)).real
    return float((np.abs(fft.fft2(pattern, around)) ** 2 * power).mean())
