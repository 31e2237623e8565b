"""Flats above their darks with the errors of sampling, and EMVA 1288's gain and responsivity."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from analysis.photon_transfer.black import dark_shares
from analysis.photon_transfer.levels import WANDER_P
from analysis.photon_transfer.sampled import Estimate, first_coefficient
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.recording.hygiene import CLIPPED_SHARE

Floats = NDArray[np.float64]

SENSITIVITY_END = 0.7  # of saturation: gain and responsivity


@dataclass(frozen=True)
class Response:
    """Flats above their darks, ascending in level; light in its own unit or seconds.

    Attributes
    ----------
    light, light_unit
        None where neither light nor exposure time tells.
    level_dn, variance_dn2
        Of every flat, less those of its darks.
    saturation
        Index of the largest variance.
    turned_over
        Whether an unclipped level lies beyond it.
    noise_dn2, wander_dn2
        Covariance of the levels: of noise alone, and with the frames' common changes. Flats share
        darks.
    noise_dn4
        Covariance of the variances.
    dark_shares
        What each dark's variance counts in that which was taken off each flat; (flat, dark).
    gain_spread
        Relative variance of the sensor's mean gain: it is the mean of pixels that differ.
    """

    light: Floats | None
    light_unit: str
    level_dn: Floats
    variance_dn2: Floats
    saturation: int
    turned_over: bool
    noise_dn2: Floats
    wander_dn2: Floats
    noise_dn4: Floats
    dark_shares: Floats
    gain_spread: float

    @property
    def sensitive(self) -> slice:
        """Levels from the darkest to 70 % of saturation."""
        below = np.flatnonzero(self.level_dn <= SENSITIVITY_END * self.level_dn[self.saturation])
        return slice(0, int(below.max()) + 1) if below.size else slice(0, 1)

    def gain(self) -> Estimate:
        """Return the gain, DN/e-: variance over level; its shares are of the levels' variances."""
        part = self.sensitive
        x, y = self.level_dn[part], self.variance_dn2[part]
        if not (x**2).sum() > 0:
            return Estimate(np.nan, np.nan, np.zeros_like(x))
        slope = float(x @ y) / float(x @ x)
        # A level that errs moves its variance away from the line by the slope.
        noise = self.noise_dn4[part, part] + slope**2 * self.noise_dn2[part, part]
        return first_coefficient(x[:, None], y, noise)

    def responsivity(self, light: Floats) -> Estimate:
        """Return the responsivity: level over light, a number for each flat.

        Its error is that of such sensors: the mean gain of this one's pixels is a sample of them.
        It is common to all levels, so that no scatter shows it.
        """
        part = self.sensitive
        found = first_coefficient(
            light[part, None], self.level_dn[part], self.wander_dn2[part, part]
        )
        common = found.value * np.sqrt(self.gain_spread)
        return Estimate(found.value, float(np.hypot(found.standard_error, common)), found.shares)


def response_of(flats: Sequence[LevelStatistics], darks: Sequence[LevelStatistics]) -> Response:
    """Return the flats, ascending in level, less their darks: those of the same exposure time.

    Where there are none, the line through all darks is taken off.
    """
    dark_level_se, dark_noise_se = column(darks, "level_se_dn"), column(darks, "variance_se_dn2")
    by_level, by_noise = (_shares(flats, darks, e) for e in (dark_level_se, dark_noise_se))
    level = column(flats, "level_dn") - by_level @ column(darks, "level_dn")
    variance = column(flats, "variance_dn2") - by_noise @ column(darks, "variance_dn2")
    light, unit = None, "light"
    if all(f.light is not None for f in flats):
        light = column(flats, "light")
    elif len({f.exposure_time_s for f in flats}) > 2:
        light, unit = column(flats, "exposure_time_s"), "s"
    top = int(np.argmax(variance))
    return Response(
        light,
        unit,
        level,
        variance,
        top,
        # Beyond the largest variance there must be a level that the converter does not clip.
        any(flat.clipped_high <= CLIPPED_SHARE for flat in flats[top + 1 :]),
        _covariance(column(flats, "level_se_dn"), by_level, dark_level_se),
        _covariance(_wandering(flats), by_level, _wandering(darks)),
        _covariance(column(flats, "variance_se_dn2"), by_noise, dark_noise_se),
        by_noise,
        _gain_spread(flats, darks, level),
    )


def column(levels: Sequence[LevelStatistics], name: str) -> Floats:
    """Return one number of every level."""
    return np.array([getattr(s, name) for s in levels], float)


def _shares(
    flats: Sequence[LevelStatistics], darks: Sequence[LevelStatistics], errors: Floats
) -> Floats:
    times = column(darks, "exposure_time_s")
    line = dark_shares(times, errors, column(flats, "exposure_time_s"))
    same = times == column(flats, "exposure_time_s")[:, None]
    known = same.any(1, keepdims=True)
    return np.where(known, same / np.maximum(same.sum(1, keepdims=True), 1), line)


def _covariance(flat_se: Floats, shares: Floats, dark_se: Floats) -> Floats:
    return np.diag(flat_se**2) + (shares * dark_se**2) @ shares.T


def _wandering(levels: Sequence[LevelStatistics]) -> Floats:
    """Return the levels' errors, DN, with a wander of their frame means where it is certain."""
    return np.array(
        [
            max(s.level_se_dn, s.frame_sd_dn / np.sqrt(s.frames))
            if stats.f.sf(s.wander, s.frames - 1, 1e6) < WANDER_P
            else s.level_se_dn
            for s in levels
        ]
    )


def _gain_spread(
    flats: Sequence[LevelStatistics], darks: Sequence[LevelStatistics], level: Floats
) -> float:
    """Return the variance of the mean of gains that differ by pixel; from unclipped flats."""
    fixed = column(flats, "fixed_dn2") - column(darks, "fixed_dn2").mean()
    whole = column(flats, "clipped_high") <= CLIPPED_SHARE
    square = float((level[whole] ** 2).sum())
    if not square > 0:
        return 0.0
    return max(float(fixed[whole].sum()), 0.0) / square / flats[0].pixels
