"""1/f noise of the read-out or bands of rows: which of them whole frames show.

Both make the means of near rows alike. Bands are constant along a row and forget over a length:
their spectrum is a Lorentzian. 1/f noise runs on from pixel to pixel: it has no length, wanders
over a frame and more, and rises within a row where it rises from row to row. How much power waves
down and along frames have, and what they have in common, is compared with what each cause makes of
it, and of noise beside it, by Whittle's likelihood (1953) of expected powers that are exact for
frames so large (Sykulski et al., Biometrika 106, 2019).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.linalg import toeplitz
from scipy.special import digamma, polygamma

from analysis.mismatch.rowpower import SLOW, Powers, Size, down

Array = NDArray[np.float64]
_STEPS, _HALVES = 30, 10
_ENOUGH = 1e-4  # nats


@dataclass(frozen=True)
class Cause:
    """Power that a cause of unit variance has, as `Powers` has it.

    Attributes
    ----------
    slow, waves, whole
        (band, wave, wave), (wave,) and a number.
    of_light
        Whether its variance is of the signal, %^2, and not of DN^2.
    """

    slow: Array
    waves: Array
    whole: float
    of_light: bool = False

    @classmethod
    def of_rows(cls, size: Size, power: Array, whole: float, *, of_light: bool = False) -> "Cause":
        """Return a cause that is constant along rows, by its power in bands."""
        slow = np.zeros((size.counts.size, SLOW, SLOW))
        slow[:, 0, 0] = power
        return cls(slow, np.zeros(size.waves - SLOW + 1), whole, of_light)


def waves_of(covariance: Array) -> Array:
    """Return the expected power of each wave of a series but the constant: (n - 1,).

    Of an orthonormal cosine transform (DCT-II). `covariance` is that of a stationary series at lags
    0, 1, ... n - 1. Products of cosine k at lag d sum to ((n - d) cos(a d) - sin(a d) / sin(a)) / n
    with a = pi k / n.
    """
    n = covariance.size
    lag = np.arange(n)
    twice = np.where(lag == 0, 1.0, 2.0) * covariance / n
    falling, level = fft.rfft(twice * (n - lag), 2 * n), fft.rfft(twice, 2 * n)
    angle = np.pi * np.arange(1, n) / n
    return np.asarray(falling.real[1:n] + level.imag[1:n] / np.sin(angle))


def constant_of(covariance: Array) -> float:
    """Return the expected power of the constant of the same transform; see `waves_of`."""
    lag = np.arange(covariance.size)
    twice = np.where(lag == 0, 1.0, 2.0) * covariance
    return float(twice @ (1 - lag / covariance.size))


def bands(size: Size, length_rows: float) -> Cause:
    """Return offsets of rows whose correlation falls as exp(-d / length) at d rows."""
    covariance = size.columns * np.exp(-np.arange(size.rows) / length_rows)
    return Cause.of_rows(size, size.banded(waves_of(covariance)), constant_of(covariance))


@lru_cache(maxsize=2)
def pink(size: Size) -> Cause:
    """Return 1/f noise in the order of read-out: waves of two frames' length to two samples."""
    rows, columns = size.rows, size.columns
    series, lag = _series(size)
    near = np.stack([series[y * columns + lag] for y in range(rows)])  # (row, lag)
    along = fft.dct(np.eye(columns), axis=0, norm="ortho")[:SLOW]
    basis = down(rows)
    slow = np.zeros((rows - 1, SLOW, SLOW))
    first = np.zeros(rows)
    for i in range(SLOW):
        for j in range(SLOW):
            # Of wave i some rows below wave j, and the other way round.
            below = near @ np.correlate(along[i], along[j], "full")
            above = near @ np.correlate(along[j], along[i], "full")
            products = basis[i] @ toeplitz(below, above)
            slow[:, i, j] = (products * basis[j]).sum(1)
            first = below if i == j == 0 else first
    waves = waves_of(series[:columns])[SLOW - 1 : size.waves]
    return Cause(size.banded(slow), waves, constant_of(first))


def pink_lines(size: Size) -> Array:
    """Return the covariance of the means of lines so many apart, of such noise: (row,)."""
    series, lag = _series(size)
    along = np.full(size.columns, 1 / size.columns)
    weight = np.correlate(along, along, "full")
    return np.array([weight @ series[y * size.columns + lag] for y in range(size.rows)])


def _series(size: Size) -> tuple[Array, NDArray[np.intp]]:
    """Return the covariance of 1/f noise of unit variance by lag, and all lags along a line."""
    length = 2 * fft.next_fast_len(size.rows * size.columns, real=True)
    power = np.zeros(length // 2 + 1)
    power[1:-1] = 1 / np.arange(1, length // 2)
    series = fft.irfft(power / power.sum(), length) * length / 2
    return series, np.arange(1 - size.columns, size.columns)


def beside(size: Size) -> dict[str, Cause]:
    """Return what may move rows or frames besides, by kind."""
    none = np.zeros(size.counts.size)
    pixels, columns = float(size.rows * size.columns), float(size.columns)
    return {
        "row_noise": Cause.of_rows(size, none + columns, columns),
        "black_level_drift": Cause.of_rows(size, none, pixels),
        "flicker": Cause.of_rows(size, none, pixels, of_light=True),
    }


@dataclass(frozen=True)
class _Part:
    """Products that are Wishart variables, of an expectation that is linear in parameters.

    Attributes
    ----------
    design
        Of the parameters that each product has: (product, own parameter, wave, wave).
    which
        Places of those among all, the same for all products of an exposure: (exposure, own
        parameter).
    seen
        (product, wave, wave), exposure by exposure.
    shape
        Half of the degrees of freedom: (product,).
    """

    design: Array
    which: NDArray[np.intp]
    seen: Array
    shape: Array

    def expected(self, values: Array) -> Array:
        """Return the expectation of each product: (product, wave, wave)."""
        own = np.repeat(values[self.which], len(self.design) // len(self.which), axis=0)
        return np.asarray(np.einsum("npij,np->nij", self.design, own))

    def likelihood(self, values: Array) -> float:
        """Return the log-likelihood but for a constant; minus infinity: values are impossible."""
        expected = self.expected(values)
        if not (np.linalg.eigvalsh(expected)[:, 0] > 0).all():
            return -np.inf
        rest = np.linalg.slogdet(expected)[1]
        rest += np.trace(np.linalg.solve(expected, self.seen), axis1=1, axis2=2)
        return -float(self.shape @ rest)

    def misfit(self, values: Array) -> tuple[float, float]:
        """Return by how much the deviance exceeds what it is by chance, nats, and its variance.

        Of products that have as many degrees of freedom as waves: of others it is infinite.
        """
        expected = self.expected(values)
        size = expected.shape[1]
        some = 2 * self.shape > size - 1
        own, shape = np.linalg.solve(expected, self.seen)[some], self.shape[some]
        deviance = np.trace(own, axis1=1, axis2=2) - np.linalg.slogdet(own)[1] - size
        halves = shape[:, np.newaxis] - np.arange(size) / 2  # of each chi-squared in a determinant
        usual = size * np.log(shape) - digamma(halves).sum(1)
        variance = polygamma(1, halves).sum(1) - size / shape
        return float(shape @ (deviance - usual)), float(shape**2 @ variance)

    def slope(self, values: Array) -> tuple[Array, Array]:
        """Return the gradient of the log-likelihood, and Fisher's information."""
        inverse = np.linalg.inv(self.expected(values))
        own = inverse[:, np.newaxis] @ self.design
        left = np.eye(inverse.shape[1]) - inverse @ self.seen
        # tr(P A - P S P A) = tr((1 - P S) P A), with P the inverse and A the design.
        exposures, count = self.which.shape
        each = -np.einsum("nij,npji->np", left, own) * self.shape[:, np.newaxis]
        flat = own.reshape(*own.shape[:2], -1) * self.shape[:, np.newaxis, np.newaxis]
        other = own.swapaxes(2, 3).reshape(*own.shape[:2], -1)
        both = flat @ other.swapaxes(1, 2)
        gradient: Array = np.zeros(values.size)
        information: Array = np.zeros((values.size, values.size))
        np.add.at(gradient, self.which, each.reshape(exposures, -1, count).sum(1))
        rows, columns = self.which[:, :, np.newaxis], self.which[:, np.newaxis, :]
        np.add.at(information, (rows, columns), both.reshape(exposures, -1, count, count).sum(1))
        return gradient, information


@dataclass(frozen=True)
class Fit:
    """What causes make of powers at best.

    Attributes
    ----------
    loglik
        nats, but for a constant.
    variances
        Of causes: (cause,).
    off
        By how many standard deviations powers are farther from it than chance takes them.
    """

    loglik: float
    variances: Array
    off: float


def fitted(powers: Sequence[Powers], size: Size, causes: Sequence[Cause]) -> Fit | None:
    """Return the most likely variances of causes; None where one is negative.

    Fisher scoring. Each exposure has its own level of white noise, and a bend of it along rows, for
    neighbouring pixels may be alike.
    """
    count = len(causes)
    total = count + 2 * len(powers)
    bend = (np.arange(SLOW, size.waves + 1) / size.waves) ** 2
    bands_, waves = size.counts.size, bend.size
    # Of each exposure: what the causes make, its white noise, and for waves along rows its bend.
    slow = np.zeros((len(powers), bands_, count + 1, SLOW, SLOW))
    rest = np.zeros((len(powers), waves + 1, count + 2, 1, 1))
    for i, own in enumerate(powers):
        for j, cause in enumerate(causes):
            scale = (own.signal_dn / 100) ** 2 if cause.of_light else 1.0
            slow[i, :, j] = scale * cause.slow
            rest[i, :, j, 0, 0] = scale * np.append(cause.waves, cause.whole)
        slow[i, :, count] = own.white[:, np.newaxis] * np.eye(SLOW)
        rest[i, :, count, 0, 0] = np.append(np.ones(waves), own.white[0, 0])
        rest[i, :-1, count + 1, 0, 0] = bend
    common = np.tile(np.arange(count), (len(powers), 1))
    places = np.hstack([common, np.arange(count, total).reshape(-1, 2)])
    frames = np.array([own.frames for own in powers])
    along = np.append(np.full(waves, size.rows - 1.0), 1.0)
    parts = [
        _Part(
            slow.reshape(-1, *slow.shape[2:]),
            places[:, :-1],
            np.concatenate([own.slow for own in powers]),
            np.outer(frames, size.counts).reshape(-1) / 2,
        ),
        _Part(
            rest.reshape(-1, *rest.shape[2:]),
            places,
            np.concatenate([[*own.waves, own.whole] for own in powers])[:, np.newaxis, np.newaxis],
            np.outer(frames, along).reshape(-1) / 2,
        ),
    ]
    start = np.zeros(total)
    start[count::2] = [float(own.waves.mean()) for own in powers]
    value, found = _scored(parts, start)
    if (found[:count] < 0).any():
        return None
    excess, variance = np.sum([part.misfit(found) for part in parts], 0)
    return Fit(value, found[:count], float(excess / np.sqrt(variance)))


def _scored(parts: Sequence[_Part], found: Array) -> tuple[float, Array]:
    """Return the largest log-likelihood, and the parameters there."""
    value = sum(part.likelihood(found) for part in parts)
    for _ in range(_STEPS):
        slopes = [part.slope(found) for part in parts]
        gradient, information = (np.sum(own, 0) for own in zip(*slopes, strict=True))
        step = np.linalg.lstsq(information, gradient, rcond=None)[0]
        for k in range(_HALVES):
            trial = found + step / 2**k
            new = sum(part.likelihood(trial) for part in parts)
            if new >= value:
                break
        else:
            break
        found, gained, value = trial, new - value, new
        if gained < _ENOUGH:
            break
    return value, found
