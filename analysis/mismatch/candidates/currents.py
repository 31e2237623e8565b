"""Dark currents, of all pixels and of hot ones, measured of the map that grows with exposure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

from analysis.currentlaw import Body, of_all
from analysis.currentspread import CLEAR_GAIN, Spread, current_spread
from analysis.mismatch.candidates.candidate import Candidate, Proposal, measured, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.counted import Counted
from analysis.mismatch.hotlaw import HotLaw, hot_laws
from dsis.effects.dark_current import MOST_APART, DarkCurrent
from dsis.effects.hot_pixels import HotPixels

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_NUMBERS = ("pixel_fraction", "mean_dn_per_s")
_RATE, _SPREAD = "dn_per_s", "log_sigma"
_CLEAR = 5.0  # standard deviations of a pixel's summed variance
_FEW = 0.1  # of all pixels
_SEEN = 2  # frames, of which there are variances
_LEAST_LEFT = 0.1  # of the mean: hot ones have not all of it


def _dark_current(clues: Clues) -> Sequence[Proposal]:
    """Return the growth of the darks' level, alike in all pixels; and as far from it as they are.

    Where single pixels show that, which has a number more.
    """
    rate = dark_rate(clues)
    if rate is None:
        return []
    found = proposals("dark_current", [_RATE], dn_per_s=rate)
    spread = current_spread_of(clues, rate)
    if spread is None or spread.log_sigma > MOST_APART:
        return found
    again = _hot_again(clues, rate, spread)
    mean, sigma = rate, spread.log_sigma
    if again is not None:
        share, own = (float(getattr(again.effect, name)) for name in _NUMBERS)
        left = max(1 - share * own / rate, _LEAST_LEFT)
        mean, sigma = rate * left, min(of_all(sigma, 1 / left), MOST_APART)
    errors = {_SPREAD: spread.error * sigma / spread.log_sigma}
    of_pixels = spread.gain if again is not None or _normal(clues) else None
    apart = [
        replace(measured(one, {_SPREAD: sigma}, errors), of_pixels=of_pixels, again=again)
        for one in proposals("dark_current", [_RATE], dn_per_s=mean)
    ]
    return [*found, *apart]


def _hot_again(clues: Clues, rate: float, spread: Spread) -> Proposal | None:
    """Return the camera's hot pixels as they are beside dark currents that differ; None: unknown.

    Where these were not known yet, hot ones were measured with them: more, and less hot.
    """
    if not any(isinstance(own, HotPixels) for own in clues.camera.effect):
        return None
    mean, sigma = rate * spread.left, of_all(spread.log_sigma, 1 / spread.left)
    shot = _shot(clues, mean)
    found = _hot_beside(clues, lambda scale: Body(mean * scale, sigma, shot))
    return found[0] if found else None


def dark_rate(clues: Clues) -> float | None:
    """Return how fast the level of darks grows with exposure time, DN/s; None: it does not."""
    darks = [e for e in clues.layout.exposures if e.kind == "dark"]
    times = np.array([e.exposure_time_s for e in darks])
    if len(set(times.tolist())) < 2:
        return None
    level = np.array(
        [np.mean([clues.seen.levels[e.name, c].level_dn for c in clues.layout.channels])
         for e in darks]
    )  # fmt: skip
    rate = float(np.polyfit(times, level, 1)[0])
    return rate if rate > 0 else None


def current_spread_of(clues: Clues, rate: float) -> Spread | None:
    """Return how far pixels' dark currents lie from a mean rate, DN/s; None: they are alike.

    The rate is that of all, hot ones too.
    """
    images = clues.image("time")
    if not images:
        return None
    scale = clues.scale("time", next(iter(images)))
    maps = [
        (image, noise, _noisy(clues, name, image / scale))
        for name, (image, noise) in images.items()
    ]
    spread = current_spread(maps, rate * scale, shot=_shot(clues, rate))
    return spread if spread is not None and spread.gain > CLEAR_GAIN else None


def _normal(clues: Clues) -> bool:
    """Return whether the camera expects no pixel that is far out of a map.

    Laws are told from normal noise: where the camera's maps are another's, counts must do.
    """
    pixels = clues.layout.rows * clues.layout.columns
    return Counted(clues.vector.keys, pixels).normal(clues.null.mean)


def _body(clues: Clues, scale: float) -> Body:
    """Return the law of the camera's dark currents, in a map's unit."""
    own = _apart(clues)
    if own is None:
        return Body()
    return Body(own.dn_per_s * scale, own.log_sigma, _shot(clues, own.dn_per_s))


def _apart(clues: Clues) -> DarkCurrent | None:
    """Return the camera's dark current whose pixels differ; None: it has none, or several."""
    own = [
        e for e in clues.camera.effect if isinstance(e, DarkCurrent) and e.log_sigma * e.dn_per_s
    ]
    return own[0] if len(own) == 1 else None


def _shot(clues: Clues, rate: float) -> float:
    """Return what share of the noise variance of a map of time is shot noise of a rate, DN/s.

    Of exposures, each counts as it does for a slope against their times.
    """
    dark, lit = clues.fit.line_dn2(np.array([0.0, 1.0]))
    share = total = 0.0
    for own in clues.layout.uniform:
        time = own.exposure_time_s
        for channel in clues.layout.channels:
            variance = clues.seen.levels[own.name, channel].variance_dn2
            weight = time**2 * len(own.numbers) / variance**2 if variance > 0 else 0.0
            share += weight * max(float(lit - dark), 0.0) * rate * time
            total += weight * variance
    return min(share / total, 1.0) if total > 0 else 0.0


def _hot(clues: Clues) -> Sequence[Proposal]:
    """Return the likeliest laws of the map's pixels, where they gain more than their parameters.

    None of which more pixels are hot than few: where all are, dark currents differ everywhere.
    """
    found = _hot_beside(clues, partial(_body, clues))
    if _apart(clues) is not None or _normal(clues):
        return found
    return [replace(own, of_pixels=None) for own in found]


def _hot_beside(clues: Clues, body: Callable[[float], Body]) -> list[Proposal]:
    """Return the likeliest laws of hot pixels beside others' dark currents, in a map's unit."""
    grown = _grown(clues)
    if grown is None:
        return []
    images, scale = grown
    noisy = {name: _noisy(clues, name, image / scale) for name, (image, _) in images.items()}
    laws = [own for own in hot_laws(images, noisy, body(scale)) if own.share <= _FEW]
    found = [(own.gain, _of_law(own, scale)) for own in laws if own.gain >= len(_NUMBERS)]
    return [replace(own, of_pixels=gain) for gain, own in found if own is not None]


def _of_law(law: HotLaw, scale: float) -> Proposal | None:
    """Return hot pixels of a law that was measured; None: they are out of bounds."""
    values = dict(zip(_NUMBERS, (law.share, law.mean / scale), strict=True))
    errors = dict(zip(_NUMBERS, (law.share_error, law.mean_error / scale), strict=True))
    found = proposals("hot_pixels", _NUMBERS, (), **values)
    return measured(found[0], values, errors) if found else None


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
        if frames < _SEEN or (exposure.name, channel) in clues.layout.still:
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
    Candidate(
        "dark_current",
        ("level", "pixel_variance"),
        _dark_current,
        credited=frozenset({"hot_pixels"}),
    ),
    Candidate("hot_pixels", ("outlying_pixels", "one_off_outliers", "fixed_pixel_variance"), _hot),
)
