"""A scene that moves between frames by far less than a pixel, as a whole or in slow waves.

A picture that shifts by d changes by d times its gradient. Each row of a frame is projected on the
gradient, over the variance of its pixels; what rows, columns, and light that changes from row to
row put into a frame is orthogonal to that. White noise gives each row a shift by chance: its slow
waves have the power of all others. A camera that shakes has more in the mean over rows, one that
vibrates while rows are read one after the other in waves of some cycles.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as ratios

from analysis.mismatch.bank.lines import any_of
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from analysis.mismatch.scenes import Scene

Array = NDArray[np.float64]
STATISTIC = "scene_motion"
AXES = ("rows", "columns")  # that the scene moves along
_SLOWEST = 12  # cycles a frame: slow waves
# One wave; two, where its cycles are no whole number; many, where it is none. First, behind last.
_TOGETHER = (
    *((k, k + 1) for k in range(_SLOWEST + 1)),
    *((k, k + 2) for k in range(_SLOWEST)),
    *((0, k + 1) for k in (2, 4, 8, _SLOWEST)),
)
# Chances whose least is one in a hundred as often as that of these, which overlap.
_INDEPENDENT = 20
_LEAST_ROWS = 48  # of fewer no wave is the measure of others
_RAREST = -690.0  # logarithm of a chance that is told from none


@dataclass(frozen=True, eq=False)
class _Design:
    """What the frames of a scene are projected on, and what white noise makes of it.

    Attributes
    ----------
    templates
        By channel: (axis, row, column).
    noise
        Variance of the projection of each row: (axis, row).
    slow
        Of slow waves of them: variances of cosine and sine, and covariance: (axis, cycles, 3).
    per_pixel, spread
        Of the sums over all rows: what a shift by a pixel along the second axis makes of each, and
        covariances: (axis, axis).
    """

    templates: Mapping[str, Array]
    noise: Array
    slow: Array
    per_pixel: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Shifts:
    """How far the frames of a scene lie from their mean.

    Attributes
    ----------
    along
        By axis, see `AXES`: (frame,), pixels to the right, or down.
    errors
        Standard error of each, by axis: pixels; infinite where the picture has no gradient.
    waves
        By axis: mean squares of its waves over the rows, of 0, 1, ... cycles a frame, in that of
        waves which are too fast for a movement: 1 by chance. None of few rows.
    degrees
        Degrees of freedom of each.
    """

    along: Mapping[str, Array]
    errors: Mapping[str, float]
    waves: Mapping[str, Array] = field(default_factory=dict)
    degrees: Array = field(default_factory=lambda: np.zeros(0))


class MotionSums:
    """Projections of the frames of one scene, which are looked at on their way."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.design = scene, _design(scene)
        self.series: list[Array] = []

    def watching(self, frames: Iterable[NDArray[np.generic]]) -> Iterator[NDArray[np.generic]]:
        """Yield frames (row, column) whose contrast is the picture's, and project them."""
        for frame in frames:
            own = np.zeros_like(self.design.noise)
            for name, plane in self.scene.planes.items():
                image = frame[plane] - frame[plane].mean(0)
                own[:, plane[0]] += np.einsum("ayx,yx->ay", self.design.templates[name], image)
            self.series.append(own)
            yield frame

    def numbers(self) -> dict[str, Number]:
        """Return the normal score of the strongest slow waves, of movements along each axis."""
        if not self._enough:
            return {f"{STATISTIC} along {axis}": UNKNOWN for axis in AXES}
        return {
            f"{STATISTIC} along {axis}": _strongest(*self._slow(k)) for k, axis in enumerate(AXES)
        }

    @property
    def _enough(self) -> bool:
        return len(self.scene.signal_dn) >= _LEAST_ROWS and len(self.series) > 1

    def _slow(self, k: int) -> tuple[Array, Array, Array]:
        """Return projections about their mean (frame, row), and what noise makes of an axis."""
        apart = np.stack([own[k] for own in self.series])
        return apart - apart.mean(0), self.design.noise[k], self.design.slow[k]

    def shifts(self) -> Shifts:
        """Return how far each frame lies from the mean of all, as a whole."""
        sums = np.stack(self.series).sum(2)
        inverse = np.linalg.pinv(self.design.per_pixel)
        along = (sums - sums.mean(0)) @ inverse.T
        known = np.linalg.matrix_rank(self.design.per_pixel) == len(AXES)
        errors = np.sqrt(np.diag(inverse @ self.design.spread @ inverse.T) * (1 - 1 / len(sums)))
        waves, degrees = {}, np.zeros(0)
        for k, axis in enumerate(AXES):
            if self._enough and self.design.noise[k].any():
                power, dof, ground = _powers(*self._slow(k))
                slow = len(self.design.slow[k])
                degrees = dof[:slow]
                waves[axis] = power[:slow] / degrees / max(ground, 1e-300)
        return Shifts(
            {axis: along[:, k] for k, axis in enumerate(AXES)},
            {axis: float(errors[k]) if known else np.inf for k, axis in enumerate(AXES)},
            waves,
            degrees,
        )


def _strongest(apart: Array, noise: Array, slow: Array) -> Number:
    """Return the normal score of the largest ratio of slow waves' power to that of others.

    `apart` are projections (frame, row), `noise` and `slow` as a `_Design` has them.
    """
    if not noise.any():
        return UNKNOWN
    power, degrees, ground = _powers(apart, noise, slow)
    if not ground > 0:
        return UNKNOWN
    others = int(degrees[len(slow) :].sum())
    some = np.array(_TOGETHER)
    power, degrees = (np.append(0.0, own).cumsum() for own in (power, degrees))
    power, degrees = (own[some[:, 1]] - own[some[:, 0]] for own in (power, degrees))
    chances = np.asarray(ratios.logsf(power / degrees / ground, degrees, others))
    least = max(float(chances.min()), _RAREST)
    return score_of_log(any_of(least, _INDEPENDENT)), 1.0


def _powers(apart: Array, noise: Array, slow: Array) -> tuple[Array, Array, float]:
    """Return power and degrees of freedom of waves, by cycles, and power a degree of fast ones."""
    frames, rows = apart.shape
    cos, sin = _waves(rows)
    a, b = apart @ cos.T, apart @ sin.T  # (frame, cycles)
    known = np.stack([(cos**2) @ noise, (sin**2) @ noise, (cos * sin) @ noise], 1)
    known[: len(slow)] = slow
    aa, bb, ab = known.T
    # Noise that is uneven over rows makes both alike: chi-squared by their covariance.
    power = (a**2 * bb - 2 * a * b * ab + b**2 * aa).sum(0) / np.maximum(aa * bb - ab**2, 1e-30)
    power[0] = (a[:, 0] ** 2).sum() / aa[0]
    degrees = np.where(np.arange(len(cos)) > 0, 2, 1) * (frames - 1)
    fast = slice(len(slow), None)
    return power, degrees, float(power[fast].sum()) / int(degrees[fast].sum())


@lru_cache(maxsize=4)
def _design(scene: Scene) -> _Design:
    """Return what frames of a scene are projected on; the same in every simulation of it."""
    rows = len(scene.signal_dn)
    cos, sin = _waves(rows)
    count = min(_SLOWEST + 1, len(cos))
    templates = {name: _templates(scene, name) for name in scene.planes}
    noise, slow = np.zeros((len(AXES), rows)), np.zeros((len(AXES), count, 3))
    per_pixel, spread = np.zeros((2, len(AXES), len(AXES)))
    for name, plane in scene.planes.items():
        local = scene.channels[name]
        variance = np.maximum(local.variance_dn2, 1e-9)[local.labels]
        for k, template in enumerate(templates[name]):
            noise[k, plane[0]] += (template**2 * variance).sum(1)
            for cycles in range(count):
                one, other = (template * wave[cycles, plane[0], np.newaxis] for wave in (cos, sin))
                one, other = one - one.mean(0), other - other.mean(0)  # as columns' means are
                pairs = ((one, one), (other, other), (one, other))
                slow[k, cycles] += [float((p * q * variance).sum()) for p, q in pairs]
        gradients = _gradients(scene, name)
        whole = templates[name] - templates[name].mean(1, keepdims=True)
        per_pixel -= np.einsum("ayx,byx->ab", whole, gradients)  # what moves on, moves off
        spread += np.einsum("ayx,byx,yx->ab", whole, whole, variance)
    return _Design(templates, noise, slow, per_pixel, spread)


def _waves(rows: int) -> tuple[Array, Array]:
    """Return cosines and sines over the rows: (cycles, row)."""
    turn = 2 * np.pi * np.outer(np.arange((rows - 1) // 2), np.arange(rows)) / rows
    return np.cos(turn), np.sin(turn)


def _templates(scene: Scene, channel: str) -> Array:
    """Return the gradient over the variance, without what else changes a frame.

    The mean of each row, and in it what is in proportion to the picture: (axis, row, column).
    """
    picture, local = scene.signal_dn[scene.planes[channel]], scene.channels[channel]
    variance = np.maximum(local.variance_dn2, 1e-9)[local.labels]
    found = _gradients(scene, channel) / variance
    inner = picture.astype(np.float64) - picture.mean(1, keepdims=True, dtype=np.float64)
    inner /= np.maximum(np.sqrt((inner**2).sum(1, keepdims=True)), 1e-30)
    found -= found.mean(2, keepdims=True)
    found -= (found * inner).sum(2, keepdims=True) * inner
    return np.asarray(found)


def _gradients(scene: Scene, channel: str) -> Array:
    """Return by how much the picture grows to the right and down, DN a pixel: (axis, row, column).

    None of a channel of a single row or column.
    """
    plane = scene.planes[channel]
    picture = scene.signal_dn[plane].astype(np.float64)
    if min(picture.shape) < 2:
        return np.zeros((len(AXES), *picture.shape))
    pitch = max(plane[0].step or 1, 1)
    down, right = np.gradient(picture, pitch)
    return np.stack([right, down])
