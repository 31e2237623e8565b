"""Maps, residuals and variances of a recording, and what can be read off them."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from second.geometry import Array, Case, Effect, planes, segment_of

Numbers = tuple[Any, Any]  # values and their standard errors without the effect
Oracle = Callable[["Prepared", Effect], Numbers]
MAD = 1.4826


class Prepared:
    """A recording, per exposure: mean map, residuals, variance map, signal, frame means, in DN.

    With `clean`, one-off spikes are replaced by the mean of the pixel's other frames.
    """

    def __init__(self, case: Case, frames: list[Array], *, clean: bool = False) -> None:
        self.case, self.exposures, self.planes = case, case["exposures"], planes(case)
        self.frames = frames
        self.means: list[Array] = []
        self.residuals: list[Array] = []
        self.variances: list[Array] = []
        self.signals: list[Array] = []
        self.frame_means: list[Array] = []
        for codes in frames:
            self._add(codes.astype(np.float32), clean=clean)
        self.pixels = self.means[0].size

    def _add(self, y: Array, *, clean: bool) -> None:
        mean = y.mean(0)
        z = y - mean
        if clean:
            for _ in range(2):
                self._despike(y, z)
                mean = y.mean(0)
                z = y - mean
        f = z.mean((1, 2))
        z -= f[:, None, None]
        n = len(y)
        variance, signal = np.empty(mean.shape), np.empty(mean.shape)
        for plane in self.planes.values():
            variance[plane] = np.mean(z[(slice(None), *plane)] ** 2) * n / (n - 1)
            signal[plane] = mean[plane].mean() - self.case["black"]
        self.means.append(mean)
        self.residuals.append(z)
        self.variances.append(np.maximum(variance, 1e-3))
        self.signals.append(signal)
        self.frame_means.append(f)

    def _despike(self, y: Array, z: Array) -> None:
        for plane in self.planes.values():
            a = (slice(None), *plane)
            spread = MAD * np.median(np.abs(z[a])) * np.sqrt(len(y) / (len(y) - 1)) + 0.1
            bad = z[a] > 5.5 * spread
            kept = np.maximum((~bad).sum(0), 1)
            y[a] = np.where(bad, (np.where(bad, 0, y[a]).sum(0) / kept)[None], y[a])

    def kinds(self, *kinds: str) -> list[int]:
        """Return the exposures of these kinds."""
        return [i for i, e in enumerate(self.exposures) if e["kind"] in kinds]

    def count(self, i: int) -> int:
        """Return the frames of an exposure."""
        return len(self.frames[i])

    def standardised(self, i: int) -> Array:
        """Return residuals in units of their deviation."""
        return self.residuals[i] / np.sqrt(self.variances[i]).astype(np.float32)


def demeaned(p: Prepared, m: Array) -> Array:
    """Return a map less each plane's mean."""
    m = m.copy()
    for plane in p.planes.values():
        m[plane] -= m[plane].mean()
    return m


def offset_map(p: Prepared, which: Iterable[int]) -> Numbers:
    """Return the weighted mean map of exposures and its variance."""
    num: Any = 0
    den: Any = 0
    for i in which:
        w = p.count(i) / p.variances[i]
        num = num + w * p.means[i]
        den = den + w
    return demeaned(p, num / den), 1 / den


def relative_map(p: Prepared) -> Numbers:
    """Return the weighted map of relative response and its variance."""
    num: Any = 0
    den: Any = 0
    for i in p.kinds("flat"):
        w = p.signals[i] ** 2 * p.count(i) / p.variances[i]
        num = num + w * (p.means[i] - p.case["black"]) / np.maximum(p.signals[i], 1e-3)
        den = den + w
    return demeaned(p, num / den), 1 / den


def variance_of(m: Array) -> Numbers:
    """Return a map's variance."""
    v = float(np.var(m))
    return [v], [v * np.sqrt(2 / m.size)]


def project(m: Array, variance: Array, t: Array, p: Prepared | None = None) -> Numbers:
    """Return the amplitude of a template in a map by least squares.

    Its noise is the map's own scatter, but not below the given variance.
    """
    if p is not None:
        t = demeaned(p, t)
    n = float((t * t).sum()) + 1e-30
    s = max(float(np.var(m)), float(np.mean(variance)))
    return [float((m * t).sum()) / n], [np.sqrt(s / n)]


def joined(parts: Iterable[Numbers]) -> Numbers:
    """Return all values and errors in one."""
    v, s = zip(*parts, strict=True)
    return (
        np.concatenate([np.atleast_1d(a) for a in v]),
        np.concatenate([np.atleast_1d(a) for a in s]),
    )


def variance_curve(p: Prepared, kinds: tuple[str, ...] = ("dark", "flat")) -> tuple[Array, ...]:
    """Return signal in DN, variance in DN^2 and its error, per exposure and plane."""
    x, v, s = [], [], []
    for i in p.kinds(*kinds):
        for plane in p.planes.values():
            n = p.means[i][plane].size
            x.append(float(p.signals[i][plane].mean()))
            v.append(float(p.variances[i][plane].mean()))
            s.append(v[-1] * np.sqrt(2 / (n * (p.count(i) - 1))))
    return np.array(x), np.array(v), np.array(s)


def photon_transfer(p: Prepared) -> tuple[dict[str, float], Array]:
    """Return expected errors of the base numbers, and the slope and intercept that are found.

    They are those of a weighted line through the variances of the first segment, in DN and DN^2,
    and of the black level in DN.
    """
    case = p.case
    x, v, s = variance_curve(p)
    if len(case["segments"]) > 1:
        k = x < case["segments"][0]["upper_dn"]
        x, v, s = x[k], v[k], s[k]
    a = np.stack([x, np.ones_like(x)], 1) / s[:, None]
    covariance = np.linalg.inv(a.T @ a)
    darks = sum(p.pixels * p.count(i) / np.mean(p.variances[i]) for i in p.kinds("dark"))
    errors = {
        "slope": float(np.sqrt(covariance[0, 0])),
        "intercept": float(np.sqrt(covariance[1, 1])),
        "black_level": float(1 / np.sqrt(darks)),
    }
    return errors, np.linalg.lstsq(a, v / s, rcond=None)[0]


def expected_variance(case: Case, signal: Any) -> Any:
    """Return the base law's variance of codes, in DN^2, at a signal in DN."""
    slope, intercept = segment_of(case["segments"], signal)
    return slope * signal + intercept + 1 / 12
