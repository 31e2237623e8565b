"""What histograms of codes gain by uneven widths that are in step with powers of two."""

from math import inf, isfinite

from analysis.mismatch.bank.codephase import LABEL
from analysis.mismatch.state import Setting
from dsis.effects import Effect
from dsis.effects.adc_dnl import AdcDnl

_PAID = 2.0  # nats: for the size, and for the period that is the best of six


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
