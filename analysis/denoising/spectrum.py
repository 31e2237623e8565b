"""What a denoiser knows about noise: its autocovariance, which is its power spectrum."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class NoiseSpectrum:
    """Covariance of stationary noise: between pixels at any lag, and between channels.

    Attributes
    ----------
    covariance
        float64 (2 k + 1, 2 l + 1, channel, channel), unit of the image squared. Element
        [k + i, l + j, a, b] is the covariance of channel a at (y + i, x + j) with channel b at
        (y, x); it vanishes at larger lags. One channel: the same, independent noise in each.

    Raises
    ------
    ValueError
        Where the shape is another, a number is not finite, a variance is negative, or the
        covariance is not that of anything: [i, j, a, b] must equal [-i, -j, b, a].
    """

    covariance: NDArray[np.float64]

    def __post_init__(self) -> None:
        c = self.covariance
        fine = c.ndim == 4 and c.shape[0] % 2 == 1 and c.shape[1] % 2 == 1
        if not fine or c.shape[2] not in (1, 3) or c.shape[2] != c.shape[3]:
            message = f"covariance must be (odd, odd, channel, channel), 1 or 3 channels: {c.shape}"
            raise ValueError(message)
        if not np.isfinite(c).all():
            raise ValueError("covariance must be finite")
        if (np.diagonal(self.at_lag_zero) < 0).any():
            raise ValueError("variances must not be negative")
        if not np.allclose(c, c[::-1, ::-1].swapaxes(2, 3), rtol=0, atol=1e-6 * np.abs(c).max()):
            raise ValueError("covariance at lag -d must be the transpose of that at lag d")

    @classmethod
    def white(cls, sigma: ArrayLike) -> "NoiseSpectrum":
        """Return white noise of standard deviation `sigma`: one number, or one for each of three.

        One number stands for independent channels of the same noise, or for a grey image.
        """
        deviation = np.atleast_1d(np.asarray(sigma, np.float64))
        if deviation.shape not in {(1,), (3,)} or not (deviation >= 0).all():
            message = f"sigma must be one number or three, at least 0: {deviation}"
            raise ValueError(message)
        return cls(np.diag(deviation**2)[None, None])

    @classmethod
    def of_autocovariance(cls, kernel: ArrayLike) -> "NoiseSpectrum":
        """Return noise of a compact autocovariance, lag 0 in the middle.

        Parameters
        ----------
        kernel
            (2 k + 1, 2 l + 1), or that with a last axis of three channels that are independent of
            one another, or with two: their covariances, (2 k + 1, 2 l + 1, 3, 3).
        """
        given = np.asarray(kernel, np.float64)
        if given.ndim == 2:
            return cls(given[..., None, None])
        if given.ndim == 3:
            return cls(given[..., None] * np.eye(given.shape[2]))
        return cls(given)

    @classmethod
    def of_power(cls, power: ArrayLike) -> "NoiseSpectrum":
        """Return noise of a power spectrum on the grid of `numpy.fft.fft2`.

        Parameters
        ----------
        power
            (row, column) or (row, column, 3), real; its mean is the variance of the noise:
            P(f) = E|FFT(noise)|^2 / number of pixels.
        """
        given = np.asarray(power, np.float64)
        if given.ndim not in (2, 3) or not (given >= 0).all():
            raise ValueError("power must be (row, column) or (row, column, 3) and at least 0")
        lags = np.fft.fftshift(np.fft.ifft2(given, axes=(0, 1)).real, axes=(0, 1))
        for axis in (0, 1):
            if lags.shape[axis] % 2 == 0:  # half of lag -n/2 belongs to lag n/2
                edge = np.take(lags, [0], axis) / 2
                inner = np.delete(lags, 0, axis)
                lags = np.concatenate([edge, inner, edge], axis)
        lags = (lags + lags[::-1, ::-1]) / 2  # rounding, and spectra that are not symmetric
        return cls.of_autocovariance(lags)

    @property
    def at_lag_zero(self) -> NDArray[np.float64]:
        """Covariance of the channels of one pixel: (channel, channel), unit squared."""
        rows, columns = self.covariance.shape[:2]
        return np.asarray(self.covariance[rows // 2, columns // 2])

    def mixed(self, matrix: NDArray[np.float64]) -> "NoiseSpectrum":
        """Return the spectrum of `matrix @ noise`, (channel, channel), at every pixel."""
        given = self.covariance
        if given.shape[2] == 1:
            given = given * np.eye(len(matrix))
        return NoiseSpectrum(np.einsum("ia,yxab,jb->yxij", matrix, given, matrix))

    def normalised(self) -> "NoiseSpectrum":
        """Return the correlation: each channel divided by its standard deviation.

        Raises
        ------
        ValueError
            Where a channel has no noise.
        """
        variance = np.diagonal(self.at_lag_zero)
        if not (variance > 0).all():
            raise ValueError("a channel without noise has no correlation")
        return NoiseSpectrum(self.covariance / np.sqrt(np.outer(variance, variance)))

    def autocovariance(self, channel: int, reach: int) -> NDArray[np.float64]:
        """Return lags -reach..reach of one channel, (2 reach + 1, 2 reach + 1), unit squared."""
        out = np.zeros((2 * reach + 1, 2 * reach + 1))
        given = self.covariance[:, :, channel, channel]
        k, m = (min(reach, size // 2) for size in given.shape)
        y, x = given.shape[0] // 2, given.shape[1] // 2
        out[reach - k : reach + k + 1, reach - m : reach + m + 1] = given[
            y - k : y + k + 1, x - m : x + m + 1
        ]
        return out

    def power(self, channel: int, rows: int, columns: int) -> NDArray[np.float64]:
        """Return one channel's power on the grid of `fft2` of a size; its mean is the variance.

        Lags beyond the grid wrap around it. A covariance cut off at some lag can leave slightly
        negative power, which no noise has: it is raised to 0.
        """
        given = self.covariance[:, :, channel, channel]
        wrapped = np.zeros((rows, columns))
        y = (np.arange(given.shape[0]) - given.shape[0] // 2) % rows
        x = (np.arange(given.shape[1]) - given.shape[1] // 2) % columns
        np.add.at(wrapped, (y[:, None], x), given)
        return np.maximum(np.fft.fft2(wrapped).real, 0.0)
