"""Few hot pixels: what training frames tell of the charge of each, by the law of the camera.

Where a virtual sensor has too few that stand out to learn from, the law is asked itself: of a pixel
that is hot with probability p and then has an exponential charge, the mean given its mean maps.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_ndtr

from dsis.effects import Effect
from dsis.effects.hot_pixels import HotPixels

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hot:
    """Hot pixels of one site of the colour filter array.

    Attributes
    ----------
    share, mean_dn_per_s
        As the effect has them.
    times_s
        Of the exposures: (exposure,).
    weights
        Inverse variance of a pixel of a mean map, DN^-2; 0 where none was trained: (exposure,).
    """

    share: float
    mean_dn_per_s: float
    times_s: Array
    weights: Array

    def estimate(self, rest: Array) -> Array:
        """Return the charge's mean given maps (exposure, row, column), DN, less that of a map."""
        weighted = self.weights * self.times_s
        precision = float(weighted @ self.times_s)
        if precision <= 0:
            return np.zeros_like(rest)
        common = self.share * self.mean_dn_per_s  # maps are centred
        rate = np.tensordot(weighted, rest, 1) / precision + common
        sd = precision**-0.5
        return np.asarray(
            self.times_s[:, np.newaxis, np.newaxis]
            * (expected_rate(rate, sd, self.share, self.mean_dn_per_s) - common)
        )


def expected_rate(seen: Array, sd: float, share: float, mean: float) -> Array:
    """Return the mean of a rate that is 0, or in a share of pixels exponential, as it was seen.

    Parameters
    ----------
    seen
        The rate with normal noise.
    sd
        Of the noise.
    share, mean
        Of pixels that have a rate; of it.
    """
    # Where there is one, it is normal about the second, but positive (Grushka 1972).
    centre = seen - sd**2 / mean
    below = log_ndtr(centre / sd)
    hazard = np.exp(-((centre / sd) ** 2) / 2 - np.log(2 * np.pi) / 2 - below)
    hot = -np.log(mean) + sd**2 / (2 * mean**2) - seen / mean + below
    cold = -((seen / sd) ** 2) / 2 - np.log(2 * np.pi) / 2 - np.log(sd)
    chance = expit(np.log(share) - np.log1p(-share) + hot - cold)
    return np.asarray(chance * np.maximum(centre + sd * hazard, 0.0))


def hot_of(effects: Sequence[Effect], times_s: Array, weights: Array) -> Hot | None:
    """Return the hot pixels among effects, the brightest if there are several; None: none has."""
    own = [e for e in effects if isinstance(e, HotPixels) and e.pixel_fraction and e.mean_dn_per_s]
    brightest = max(own, key=lambda e: e.mean_dn_per_s, default=None)
    if brightest is None:
        return None
    return Hot(brightest.pixel_fraction, brightest.mean_dn_per_s, times_s, weights)
