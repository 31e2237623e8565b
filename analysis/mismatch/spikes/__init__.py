"""Rare strong spikes, found and put aside before anything else is judged.

A handful of samples thousands of standard deviations off decides every moment, and no simulation
draws the same handful: such spikes are counted, one by one, and the rest is judged without them.
"""

from analysis.mismatch.spikes.cleaned import Cleaned, without_spikes
from analysis.mismatch.spikes.law import left_dn4
from analysis.mismatch.spikes.population import Spikes, spikes_of
from analysis.mismatch.spikes.told import STATISTIC, told_besides, with_spikes

__all__ = [
    "STATISTIC",
    "Cleaned",
    "Spikes",
    "left_dn4",
    "spikes_of",
    "told_besides",
    "with_spikes",
    "without_spikes",
]
