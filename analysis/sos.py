"""The SOS parameter: how far votes spread at a given mean, as a flag of data quality."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.scale import Scale
from analysis.screening import moments
from analysis.votes import index_votes

SUSPICIOUS = 0.25
"""Two public tests without fault have a = 0.19; one with 4 of 30 observers scrambled, 0.26."""


@dataclass(frozen=True)
class SosFit:
    """Result of `sos_parameter`.

    Attributes
    ----------
    a
        0: all agree; 1: everybody votes for one of the ends.
    a_random
        What votes at random give at the middle of the scale, for comparison.
    """

    a: float
    a_random: float

    @property
    def suspicious(self) -> bool:
        """Whether votes spread more than in tests without fault."""
        return self.a > SUSPICIOUS


def sos_parameter(votes: pd.DataFrame, scale: Scale) -> SosFit:
    """Fit a of variance = a (H - x)(x - L), x the MOS, over the stimuli by least squares.

    Hossfeld, Schatz & Egger, "SOS: the MOS is not enough", QoMEX 2011; variance with 1 / n.
    """
    scored = index_votes(votes)
    _, mean, sd = moments(scored.stimulus, scored.vote, 0)
    widest = (scale.high - mean) * (mean - scale.low)
    divisor = float(widest @ widest)
    a = float(widest @ sd**2) / divisor if divisor > 0 else np.nan
    width = scale.high - scale.low
    return SosFit(a, (width + 2) / (3 * width))
