"""What a recording shows beyond the current model, in natural units: where proposals start from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.instance import Frequency
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.null import Null
from analysis.mismatch.observe import Observation
from analysis.mismatch.vector import Vector
from dsis.camera import Camera
from dsis.effects.quantisation import Quantisation
from dsis.effects.rts import Rts
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
NO_LINE = ""
"""Kind of a line that whole frames do not show."""


def alike(_place: Place) -> float:
    """Return 1 for every place: the shape of what does not depend on signal or channel."""
    return 1.0


@dataclass(frozen=True)
class Clues:
    """The recording beside the current model.

    Attributes
    ----------
    layout, seen, vector
        What was observed.
    fit
        The base numbers.
    null
        The current model's mean and spread of every number.
    camera
        The current model.
    settled
        Lines that an effect of a kind needs no trial for, (kind, frequency): they were named as one
        or the other, or refused to this one; of `NO_LINE` no effect needs one.
    jumps
        Pixels that jump, of their mean numbers; None: whole frames do not show them.
    """

    layout: Layout
    seen: Observation
    vector: Vector
    fit: BaseFit
    null: Null
    camera: Camera
    settled: tuple[tuple[str, Frequency], ...] = ()
    jumps: Rts | None = None

    @property
    def places(self) -> tuple[Place, ...]:
        """Exposures and channels."""
        return tuple(self.seen.levels)

    def signal(self, place: Place) -> float:
        """Return the signal, DN above black."""
        return max(self.fit.signal_dn[place], 0.0)

    def shot_share(self, place: Place) -> float:
        """Return the share of shot noise in the pixel variance.

        All but the read noise, and where codes are coarse, which add more, no more than the model
        has of it.
        """
        total = max(self.seen.levels[place].variance_dn2, 1e-9)
        dark, here = self.fit.line_dn2(np.array([0.0, self.signal(place)])).tolist()
        light = total - max(dark, 0.0)
        if any(isinstance(own, Quantisation) for own in self.camera.effect):
            light = min(light, here - dark)
        return float(np.clip(light / total, 0.0, 1.0))

    def read_share(self, place: Place) -> float:
        """Return the share of everything else."""
        return 1 - self.shot_share(place)

    def frames(self, exposure: str) -> int:
        """Return the number of frames."""
        return next(len(e.numbers) for e in self.layout.exposures if e.name == exposure)

    def time_s(self, exposure: str) -> float:
        """Return the exposure time."""
        return next(e.exposure_time_s for e in self.layout.exposures if e.name == exposure)

    def shape(self, channel: str) -> tuple[int, int]:
        """Return rows and columns of a channel's plane."""
        step = 1 if channel == "MONO" else 2
        return self.layout.rows // step, self.layout.columns // step

    def excess(self, statistic: str) -> dict[Place, tuple[float, float]]:
        """Return what is beyond the model at each place, DN^2 for variances, and its error."""
        found = {}
        for i, key in enumerate(self.vector.keys):
            if key.statistic != statistic or key.scope != "exposure" or not self.null.known[i]:
                continue
            place = (key.exposure, key.channel)
            x, mean, sd = self.vector.values[i], self.null.mean[i], self.null.sd[i]
            unit = self._unit(statistic, place)
            if unit is None:
                found[place] = (float(x - mean), float(sd))
            else:
                size = max(abs(x), abs(mean), 0.5)
                found[place] = (float(x**3 - mean**3) * unit, float(3 * size**2 * sd) * unit)
        return found

    def _unit(self, statistic: str, place: Place) -> float | None:
        if place not in self.seen.levels:
            return None
        v = self.seen.levels[place].variance_dn2
        n, m = self.shape(place[1])
        still = v / self.frames(place[0])
        smooth = Smooth.of(n, m)
        kinds = int(smooth.mixed.sum()) + 2 * smooth.degree
        return {
            "row_variance": v / m,
            "column_variance": v / n,
            "frame_variance": v / (n * m),
            "fixed_pixel_variance": still,
            "fixed_row_variance": still / m,
            "fixed_column_variance": still / n,
            "fixed_smooth_variance": still * kinds / (n * m),
        }.get(statistic)

    def amplitude(self, statistic: str, shape: Callable[[Place], float]) -> tuple[float, float]:
        """Return the least-squares factor of a shape over places, and its error."""
        top = bottom = 0.0
        for place, (value, sd) in self.excess(statistic).items():
            s = shape(place)
            top += value * s / sd**2
            bottom += s**2 / sd**2
        return (top / bottom, 1 / sqrt(bottom)) if bottom > 0 else (0.0, np.inf)

    def number(self, statistic: str, scope: str, detail: str = "", channel: str = "") -> float:
        """Return the mean departure (value less the model's mean) over channels, in its unit."""
        return self._mean_of(self.vector.values - self.null.mean, statistic, scope, detail, channel)

    def value(self, statistic: str, scope: str, detail: str) -> float:
        """Return the mean of a number over channels, in its unit; 0 where it is unknown."""
        return self._mean_of(self.vector.values, statistic, scope, detail, "")

    def _mean_of(
        self, values: Array, statistic: str, scope: str, detail: str, channel: str
    ) -> float:
        picked = [
            float(values[i])
            for i, key in enumerate(self.vector.keys)
            if key.statistic == statistic
            and key.scope == scope
            and key.detail == detail
            and channel in ("", key.channel)
            and self.null.known[i]
        ]
        return float(np.mean(picked)) if picked else 0.0

    def image(self, name: str) -> Mapping[str, tuple[Array, float]]:
        """Return a map by channel, with its noise."""
        return {c: found for (c, kind), found in self.seen.images.items() if kind == name}

    def scale(self, name: str, channel: str) -> float:
        """Return what a map is scaled to: DN above black, or s."""
        return float(self.layout.regressors(channel).scales.get(name, 1.0))

    def keys(self) -> tuple[Key, ...]:
        """Return all keys."""
        return self.null.keys
