"""Numbers that a camera model predicts for a recording, and how likely the recorded ones then are.

Cameras are compared on the same few simulated recordings: draws are counted, so what two cameras
have in common cancels. The likelihood has heavy tails, and allows every predicted change an error
of its own: no effect of the vocabulary is exactly what a sensor does. Mean squares of few frames
scatter by more than that, and by a law that is known: chi-squared (Wilson & Hilferty, 1931, of
their cube roots). Counts of pixels have theirs; see `counted`.
"""

from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from analysis.mismatch.bank.key import Key
from analysis.mismatch.combs import unknown_combs
from analysis.mismatch.counted import Counted
from analysis.mismatch.null import Null
from analysis.mismatch.simulations import Simulations
from analysis.mismatch.touches import differing, touched
from analysis.mismatch.vector import Vector
from dsis.camera import Camera

Array = NDArray[np.float64]
_OF_FRAMES = "frame_variance"
_NU = 6.0  # degrees of freedom of the likelihood's tails
_LIGHT = 15.0  # of a number whose scatter some 16 simulated recordings tell
_FAR = 4.0  # standard deviations
_HALF = 0.5  # of what is farthest off
_FLOOR = 0.3  # of a cube root that is 1 in white noise: below it, chance
_LEAST_ROOT = 1e-2  # frames that agree to their last digit are no surer than that
_FORM = 0.08  # relative error of a predicted change
_FORMS = {
    "spectral_peak": 0.3,
    "row_spectrum_peak": 0.3,
    "column_spectrum_peak": 0.3,
    "one_off_outliers": 0.4,
    "outlying_pixels": 0.3,
    "noisy_pixels": 0.15,
    "variance_persistence": 0.25,
    "kurtosis": 0.2,
    "kurtosis_within_pixels": 0.3,
    "variance_spread": 0.15,
    "smooth_variance_spread": 0.15,
    "row_variance_spread": 0.15,
    "column_variance_spread": 0.15,
    "skewness": 0.12,
}


def form_errors(keys: tuple[Key, ...]) -> Array:
    """Return the relative error of a predicted change of each number."""
    return np.array([_FORMS.get(key.statistic, _FORM) for key in keys])


def _lighter(z: float) -> float:
    """Return how much less likely a departure is by lighter tails than by the likelihood's."""
    heavy, light = ((nu + 1) / 2 * float(np.log1p(z**2 / nu)) for nu in (_NU, _LIGHT))
    return light - heavy


@dataclass(frozen=True)
class Reference:
    """The current model: what candidates are compared with.

    Attributes
    ----------
    camera
        The current camera.
    null
        Its mean and spread of every number.
    vector
        The recorded numbers.
    """

    camera: Camera
    null: Null
    vector: Vector


class Predictor:
    """Predictions of cameras beside a reference."""

    def __init__(self, simulations: Simulations, reference: Reference, *, replicates: int) -> None:
        self.simulations, self.reference, self.replicates = simulations, reference, replicates
        self.forms = form_errors(reference.vector.keys)
        self.base = simulations.of(reference.camera, replicates)
        layout = simulations.layout
        self.counts = Counted(reference.vector.keys, layout.rows * layout.columns)
        self.few = np.array([key.statistic == _OF_FRAMES for key in reference.vector.keys], bool)

    def beside(self, numbers: Array) -> "Predictor":
        """Return the predictor of another recording, of these numbers; unknown are as they were."""
        vector = self.reference.vector
        values = np.where(np.isfinite(numbers), numbers, vector.values)
        found = copy(self)
        found.reference = replace(self.reference, vector=replace(vector, values=values))
        return found

    def ready(self, cameras: Iterable[Camera | None]) -> None:
        """Simulate side by side, where processes are, what will be asked for one by one."""
        self.simulations.ready([own for own in cameras if own is not None], self.replicates)

    def changes(self, camera: Camera) -> Array:
        """Return what a camera changes in each replicate: (replicate, number); nan where unknown.

        Numbers that the effects in which the cameras differ cannot change stay as they are.
        """
        may = touched(self.reference.vector.keys, differing(camera, self.reference.camera))
        made = self.simulations.of(camera, self.replicates)
        return np.asarray(np.where(may, made - self.base, 0.0))

    def mean(self, camera: Camera) -> Array:
        """Return the mean of every number under a camera; nan where it is unknown.

        A change counts as far as the replicates agree on it: their noise would otherwise be fitted.
        """
        change = self.changes(camera)
        mean = change.mean(0)
        noise = change.var(0, ddof=1) / len(change) if len(change) > 1 else 0.0 * mean
        with np.errstate(invalid="ignore", divide="ignore"):
            kept = np.where(mean == 0, 0.0, mean**2 / (mean**2 + noise))
        kept[self.counts.which] = 1.0  # their likelihood knows how many were simulated
        unknown = unknown_combs(camera, self.simulations.layout, self.reference.vector.keys)
        return np.where(unknown, np.nan, self.reference.null.mean + mean * kept)

    def spread(self, camera: Camera) -> Array:
        """Return how far what a camera changes scatters from recording to recording.

        Of every number, in its unit; 0 where one replicate is all there is.
        """
        change = self.changes(camera)
        return np.asarray(change.std(0, ddof=1) if len(change) > 1 else np.zeros(change.shape[1]))

    def weights(self, mean: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return residuals, their standard deviations under a prediction, and which are known."""
        null = self.reference.null
        known = null.known & np.isfinite(mean)
        before = null.mean
        change = np.where(known, mean - before, 0.0)
        # The cube root of a mean square scatters in proportion to itself.
        grown = np.array([key.is_cube_root for key in self.reference.vector.keys])
        ratio = np.where(
            grown & known,
            np.maximum(np.abs(mean), _FLOOR) / np.maximum(np.abs(before), _FLOOR),
            1.0,
        )
        sd = np.hypot(null.sd * ratio, self.forms * change)
        return np.where(known, self.reference.vector.values - mean, 0.0), sd, known

    def loglik(self, mean: Array, of: NDArray[np.bool_] | None = None) -> float:
        """Return the log-likelihood of the recorded numbers, or some, relative to any constant."""
        rest, sd, known = self.weights(mean)
        judged = known if of is None else known & of
        counts = self._of_counts(mean, self.reference.null.mean, judged)
        return self._likely(rest, sd, judged) + counts

    def gain(
        self, mean: Array, of_pixels: float | None = None, of: NDArray[np.bool_] | None = None
    ) -> float:
        """Return what the recorded numbers, or some, gain over the current model, nats.

        `of_pixels`: what single pixels gain, which says all that counts of them say, and more.
        """
        before = self.reference.null.mean
        known = self.weights(mean)[2]  # of both: what one does not know says nothing of the other
        known = known if of is None else known & of
        gain = self.loglik(mean, known) - self.loglik(before, known)
        if of_pixels is None:
            return gain
        counts = [self._of_counts(one, before, known) for one in (mean, before)]
        return gain - counts[0] + counts[1] + of_pixels

    def alone(self, mean: Array) -> float:
        """Return what is gained besides where one number alone is far off, nats; else nothing.

        Tails are heavy since models have errors of their own, which other numbers show. Where none
        does, the one departs as far as the simulated recordings tell how it scatters. Of a thousand
        numbers chance may have another that is off, but hardly by half as much as one that is far.
        """
        null = self.reference.null
        rest, sd, known = self.weights(mean)
        known &= ~self.few & ~self.counts.said
        before = np.where(known, self.reference.vector.values - null.mean, 0.0) / null.sd
        off = np.abs(before)
        far = np.flatnonzero(off > max(_FAR, _HALF * float(off.max(initial=0.0))))
        if far.size != 1:
            return 0.0
        now = rest[far[0]] / sd[far[0]]
        return max(_lighter(float(before[far[0]])) - _lighter(float(now)), 0.0)

    def worth(self, without: Array) -> float:
        """Return the log-likelihood that the reference gains over a prediction without an effect.

        It is the effect's change whose form is not exact, so that the allowance is the reference's.
        """
        null = self.reference.null
        rest, sd, known = self.weights(without)
        form = np.where(known, self.forms * (without - null.mean), 0.0)
        left = np.where(known, self.reference.vector.values - null.mean, 0.0)
        scatter = np.sqrt(np.maximum(sd**2 - form**2, 0.0))
        own, other = (self._of_counts(one, without, known) for one in (null.mean, without))
        gain = self._likely(left, np.hypot(null.sd, form), known)
        return gain + own - self._likely(rest, scatter, known) - other

    def _of_counts(self, mean: Array, before: Array, known: NDArray[np.bool_]) -> float:
        """Return the log-likelihood of counts, of maps of which all are known."""
        form, seen = _FORMS["outlying_pixels"], self.reference.vector.values
        return self.counts.loglik(seen, mean, before, form, self.replicates, known)

    def _likely(self, rest: Array, sd: Array, known: NDArray[np.bool_]) -> float:
        few, many = known & self.few, known & ~self.few & ~self.counts.said
        own = rest[many] / sd[many]
        spread = np.log(sd[many] / self.reference.null.sd[many])
        total = float(-((_NU + 1) / 2 * np.log1p(own**2 / _NU) + spread).sum())
        if not few.any():
            return total
        value = self.reference.vector.values[few]
        mean = np.maximum(value - rest[few], _FLOOR)
        # Half of the degrees of freedom, from how roots scatter: within 1 % from one on.
        half = ((mean / sd[few]) ** 2 + 2) / 9
        half -= 0.06 / half
        # The mean of roots is less than the root of the mean: that of a gamma variate is known.
        scale = (mean * np.exp(gammaln(half) - gammaln(half + 1 / 3))) ** 3
        ratio = np.maximum(value, _LEAST_ROOT) ** 3 / scale  # a gamma variate
        return total + float((half * np.log(ratio) - ratio - gammaln(half)).sum())
