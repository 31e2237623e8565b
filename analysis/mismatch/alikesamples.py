"""Noise of whole lines that samples along them feign: means of alike samples scatter more."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import MOSAIC, Key
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_LINES = {"row_noise": "row", "column_noise": "column"}
_NEXT = {"row": ("correlation_0_1", "correlation_0_2"),
         "column": ("correlation_1_0", "correlation_2_0")}  # fmt: skip
_FARTHER = "line_correlation"
_MOST = 0.5  # of what lines would explain, that samples may feign


def of_alike_samples(state: State, kind: str, mean: Array, without: Array) -> Denial | None:
    """Return how noise of whole lines is denied by samples along them that are alike; None: not.

    The mean of n samples of variance v, with correlations rho_k at a distance of k, has a variance
    of v / n (1 + 2 sum (1 - k / n) rho_k), whatever correlates them. Where such correlations are
    left unexplained, and make half of what the effect would explain, lines may differ by no more.
    Two colours of a line have their own, and what neighbours of the other colour share besides.
    What all samples of a line have in common is in none of these correlations.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect.
    mean, without
        The numbers predicted with it, and without it.
    """
    line, called = _LINES.get(kind), {m.statistic for m in state.mismatches}
    if line is None or called.isdisjoint({*_NEXT[line], _FARTHER}):
        return None
    alike = _Alike.of(state, line)
    seen = fake = 0.0
    for i, key in enumerate(state.vector.keys):
        known = state.null.known[i] and np.isfinite(mean[i]) and np.isfinite(without[i])
        if key.statistic != f"{line}_variance" or not known:
            continue
        # Numbers are cube roots of variances relative to those of pixels.
        own, made = float(mean[i] ** 3 - without[i] ** 3), alike.feigned(key)
        if made is None or own <= 0:
            continue
        weight = own / (float(without[i]) ** 2 * float(state.null.sd[i])) ** 2
        seen += weight * float(state.vector.values[i] ** 3 - without[i] ** 3)
        fake += weight * made
    if seen <= 0 or fake <= _MOST * seen:
        return None
    why = f"samples along {line}s are alike for another reason, and their means scatter by as much"
    return Denial(max(1 - fake / seen, 0.0), why)


@dataclass(frozen=True)
class _Alike:
    """Correlations along lines that are left unexplained.

    Attributes
    ----------
    layout, line
        Where: `row` or `column`.
    near
        By place: at one and at two pixels of the sensor.
    far
        Of a channel's pixels at farther distances, or of the next colour's, all exposures together.
    whole
        Of a channel's pixels at the distances of `near`, all exposures together.
    noise
        Variance of a pixel by place.
    """

    layout: Layout
    line: str
    near: dict[Place, dict[float, float]]
    far: dict[str, dict[float, float]]
    whole: dict[str, dict[float, float]]
    noise: dict[Place, float]

    @classmethod
    def of(cls, state: State, line: str) -> "_Alike":
        """Return what a state leaves of those that differ for certain."""
        called = {m.statistic for m in state.mismatches}
        step = 1 if state.setting.layout.channels == ("MONO",) else 2
        near: dict[Place, dict[float, float]] = {}
        far: dict[str, dict[float, float]] = {}
        whole: dict[str, dict[float, float]] = {}
        left = state.vector.values - state.null.mean
        for key, rest, known in zip(state.vector.keys, left, state.null.known, strict=True):
            if not known or key.statistic not in called:
                continue
            if key.statistic in _NEXT[line] and key.scope == "exposure":
                distance = (1 + _NEXT[line].index(key.statistic)) / step
                near.setdefault((key.exposure, key.channel), {})[distance] = float(rest)
            elif key.statistic == _FARTHER and key.detail.startswith(f"{line}s "):
                distance = float(key.detail.split()[1])
                own = far if distance * step > len(_NEXT[line]) else whole
                own.setdefault(key.channel, {})[distance] = float(rest)
        noise = {at: level.variance_dn2 for at, level in state.setting.seen.levels.items()}
        return cls(state.setting.layout, line, near, far, whole, noise)

    def feigned(self, key: Key) -> float | None:
        """Return by which share of itself the variance of lines' means is larger; None: unknown."""
        if key.scope == "exposure":
            return self._own((key.exposure, key.channel))
        if key.scope != MOSAIC:
            return None
        axis = 0 if self.line == "row" else 1
        found = []
        for side in (0, 1):
            places = [
                (key.exposure, name) for name, at in self.layout.sites.items() if at[axis] == side
            ]
            if any(not self.noise.get(place, 0.0) > 0 for place in places):
                return None
            weights = np.array([1 / self.noise[place] for place in places])
            own = np.array([self._own(place) for place in places])
            shared = np.mean([self._shared(place) for place in places])
            both = float(np.prod(weights)) ** 0.5  # of two colours
            found.append((weights @ own + 2 * both * shared) / weights.sum())
        return float(np.mean(found))

    def _own(self, place: Place) -> float:
        """Return the sum over both directions of the correlations within a channel."""
        return self._sum(place, place[1], 0.0)

    def _shared(self, place: Place) -> float:
        """Return the same with the other colour of the line."""
        return self._sum(place, "", 0.5)

    def _sum(self, place: Place, farther: str, between: float) -> float:
        samples = self.layout.columns if self.line == "row" else self.layout.rows
        samples //= 1 if self.layout.channels == ("MONO",) else 2
        scale = 1.0 if between else self._strength(place)
        far = {k: scale * rho for k, rho in self.far.get(farther, {}).items()}
        every = {**far, **self.near.get(place, {})}
        return 2 * sum(
            (1 - k / samples) * rho for k, rho in every.items() if k % 1 == between and k < samples
        )

    def _strength(self, place: Place) -> float:
        """Return how much more alike an exposure's near samples are than those of all exposures.

        What is alike in darks is a smaller share of the noise of flats: farther samples, which only
        all exposures together tell, are taken to be more alike in darks by as much.
        """
        near, whole = self.near.get(place, {}), self.whole.get(place[1], {})
        both = near.keys() & whole.keys()
        mean = sum(whole[k] for k in both)
        return max(sum(near[k] for k in both) / mean, 0.0) if both and mean > 0 else 1.0
