"""Hot pixels, measured of the map that grows with exposure time."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

from analysis.mismatch.candidates.candidate import Candidate, Proposal, measured, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.counted import Counted
from analysis.mismatch.hotlaw import hot_laws

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_NUMBERS = ("pixel_fraction", "mean_dn_per_s")
_CLEAR = 5.0  # standard deviations of a pixel's summed variance
_FEW = 0.1  # of all pixels
_SEEN = 2  # frames: of more there are variances


def _hot(clues: Clues) -> Sequence[Proposal]:
    """Return the likeliest laws of the map's pixels, where they gain more than their parameters.

    None of which more pixels are hot than few: where all are, dark currents differ everywhere.
    """
    grown = _grown(clues)
    if grown is None:
        return []
    images, scale = grown
    noisy = {name: _noisy(clues, name, image / scale) for name, (image, _) in images.items()}
    # The law is told from normal noise: where the camera's maps are another's, counts must do.
    pixels = clues.layout.rows * clues.layout.columns
    normal = Counted(clues.vector.keys, pixels).normal(clues.null.mean)
    found: list[Proposal] = []
    for law in (own for own in hot_laws(images, noisy) if own.share <= _FEW):
        if law.gain < len(_NUMBERS):
            continue
        values = dict(zip(_NUMBERS, (law.share, law.mean / scale), strict=True))
        errors = dict(zip(_NUMBERS, (law.share_error, law.mean_error / scale), strict=True))
        found += [
            replace(measured(own, values, errors), of_pixels=law.gain if normal else None)
            for own in proposals("hot_pixels", _NUMBERS, (), **values)
        ]
    return found


def _grown(clues: Clues) -> tuple[Mapping[str, tuple[Array, float]], float] | None:
    """Return a map with its noise by channel, and in how many seconds it grows so; None: unknown.

    Where all exposures take the same time, and some are dark, the offset is what has grown in it.
    """
    if images := clues.image("time"):
        return images, clues.scale("time", next(iter(images)))
    times = {exposure.exposure_time_s for exposure in clues.layout.uniform}
    images = clues.image("offset")
    dark = any(exposure.kind == "dark" for exposure in clues.layout.uniform)
    if not images or not dark or len(times) > 1 or not max(times) > 0:
        return None
    return images, max(times)


def _noisy(clues: Clues, channel: str, rate: Array) -> Mask:
    """Return which pixels are noisier than the shot noise of their own charge: they jump.

    Or were hit by a spike. What they add to a mean frame is no dark current. The rate is in DN/s.
    """
    total, _ = clues.image("variance")[channel]
    per_s = np.maximum(rate - np.median(rate), 0.0)
    dark, lit = clues.fit.line_dn2(np.array([0.0, 1.0]))
    expected, scatter, white = np.zeros(rate.shape), np.zeros(rate.shape), 0.0
    for exposure in clues.layout.uniform:
        frames = len(exposure.numbers)
        if frames <= _SEEN or (exposure.name, channel) in clues.layout.still:
            continue
        variance = clues.layout.variance_dn2[exposure.name, channel]
        share = max(float(lit - dark), 0.0) * per_s * exposure.exposure_time_s / variance
        expected += (frames - 1) / variance * share
        # A chi-squared variate scatters by as much as its mean.
        scatter += (frames - 1) / variance**2 * (1 + share) ** 2
        white += (frames - 1) / variance**2
    excess = total - expected
    sd = float(median_abs_deviation(excess, axis=None, scale="normal"))  # spikes make none of it
    return np.asarray(excess > _CLEAR * sd * np.sqrt(scatter / white if white > 0 else 1.0))


CANDIDATES = (
    Candidate("hot_pixels", ("outlying_pixels", "one_off_outliers", "fixed_pixel_variance"), _hot),
)
