"""Fixed patterns over all exposures: an offset, a gain and a map that grows with exposure time.

The mean frames of all exposures are regressed, pixel by pixel, on 1, signal and exposure time. The
noise of each map is known from the pixel variances, so a map in units of its noise has a mean
square of 1 where the sensor has no pattern; what single exposures hide stands out of the sum.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel, pairwise_sum

Array = NDArray[np.float64]
MAPS = ("offset", "gain", "time")
ALONE = ("offset", "gain")
_LEAST_SPREAD = 0.02  # share of a regressor that the others leave, to be told from them


@dataclass(frozen=True)
class Regressors:
    """What each exposure's mean frame is regressed on, of one channel.

    Attributes
    ----------
    names
        Some of `MAPS`.
    rows
        Regressors by exposure, each scaled to a largest value of 1.
    scales
        What 1 stands for, by name: DN above black, s.
    weights
        By exposure: inverse variance of a pixel of the mean frame, DN^-2.
    """

    names: tuple[str, ...]
    rows: Mapping[str, Array]
    scales: Mapping[str, float]
    weights: Mapping[str, float]

    @classmethod
    def of(
        cls,
        exposures: Sequence[str],
        signal_dn: Mapping[str, float],
        time_s: Mapping[str, float],
        weights: Mapping[str, float],
    ) -> "Regressors":
        """Return those regressors that the exposures can tell apart."""
        w = np.sqrt([weights[name] for name in exposures])
        columns = {
            "offset": np.ones(len(exposures)),
            "gain": np.array([max(signal_dn[name], 0.0) for name in exposures]),
            "time": np.array([time_s[name] for name in exposures]),
        }
        kept: dict[str, Array] = {}
        scales = {}
        for name in MAPS:
            top = float(columns[name].max(initial=0.0))
            if top <= 0:
                continue
            column = columns[name] / top * w
            if kept:
                others = np.stack(list(kept.values()), 1)
                rest = column - others @ np.linalg.lstsq(others, column, rcond=None)[0]
            else:
                rest = column
            if (rest**2).sum() > _LEAST_SPREAD * (column**2).sum():
                kept[name], scales[name] = column, top
        rows = {
            name: np.array([kept[k][i] / w[i] for k in kept]) for i, name in enumerate(exposures)
        }
        return cls(tuple(kept), rows, scales, weights)

    def sharpness(self, name: str, noise: float) -> float:
        """Return what is common to channels in units of a map's noise, DN.

        A relative gain where the map is one of gains, else an offset in DN, alike or per second.
        """
        return (self.scales["gain"] if "gain" in name else 1.0) / noise


class PatternSums:
    """Sums over exposures from which the maps of one channel follow."""

    def __init__(self, regressors: Regressors, shape: tuple[int, int]) -> None:
        count = len(regressors.names)
        self.regressors = regressors
        self.moments = np.zeros((count, *shape))
        self.gram = np.zeros((count, count))
        self.noise = np.zeros((count, count))

    def add(self, exposure: str, mean_frame: Array, variance_dn2: float, frames: int) -> None:
        """Take the mean frame of an exposure and the variance of a pixel over time."""
        row, weight = self.regressors.rows[exposure], self.regressors.weights[exposure]
        of_noise = (weight**2, variance_dn2, frames)
        _add(mean_frame, weight, row, self.moments)
        _add_products(row, weight, of_noise, self.gram, self.noise)

    def maps(self) -> dict[str, tuple[Array, float]]:
        """Return each map (row, column) in DN at the regressor's largest value, and its noise.

        Those of `offset` and `gain` also alone, as if there were no other: less noise, but what is
        in one shows in the other.
        """
        inverse = np.linalg.inv(self.gram)
        solved = np.tensordot(inverse, self.moments, 1)
        noise = inverse @ self.noise @ inverse
        found = {
            name: (solved[i], sqrt(max(float(noise[i, i]), 1e-300)))
            for i, name in enumerate(self.regressors.names)
        }
        for i, name in enumerate(self.regressors.names):
            if name in ALONE and len(found) > 1:
                own = float(self.gram[i, i])
                found[f"{name} alone"] = (
                    self.moments[i] / own,
                    sqrt(max(float(self.noise[i, i]), 1e-300)) / own,
                )
        return found


@kernel
def _add(mean_frame: Array, weight: float, row: Array, moments: Array) -> None:
    """Add shares of a mean frame less its mean to the moments (regressor, row, column)."""
    mean = pairwise_sum(mean_frame.reshape(-1)) / mean_frame.size
    for y in range(mean_frame.shape[0]):
        line = mean_frame[y]
        for i in range(row.size):
            share, into = weight * row[i], moments[i, y]
            if share != 0:  # darks have no gain
                for x in range(line.size):
                    into[x] += share * (line[x] - mean)


@kernel
def _add_products(
    row: Array, weight: float, of_noise: tuple[float, float, int], gram: Array, noise: Array
) -> None:
    """Add weighted products of regressors, and what noise makes of them: (regressor, regressor).

    `of_noise`: the weight squared, the variance of a pixel over time, and how many frames.
    """
    squared, variance, frames = of_noise
    for i in range(row.size):
        for k in range(row.size):
            gram[i, k] += weight * (row[i] * row[k])
            noise[i, k] += squared * (row[i] * row[k]) * variance / frames
