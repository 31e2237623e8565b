"""What a denoiser is, and its two arguments, checked in one place."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.denoising.spectrum import NoiseSpectrum

Noise = ArrayLike | NoiseSpectrum


class Denoiser(Protocol):
    """A function (image, noise) -> image: `bm3d`, `bls_gsm`, or anything that keeps to the same."""

    def __call__(
        self, image: NDArray[np.float32], noise: Noise, *, threads: int = 1
    ) -> NDArray[np.float32]:
        """Remove additive stationary Gaussian noise.

        Parameters
        ----------
        image
            (row, column) or (row, column, 3), any unit and range; nothing is clipped.
        noise
            Standard deviation in the unit of the image, one for all channels or three, or the
            noise's `NoiseSpectrum`.
        threads
            Number of threads; the result does not depend on it.

        Returns
        -------
        NDArray[np.float32]
            The estimate, shape and unit of `image`.

        Raises
        ------
        ValueError
            Where an argument is not as said above, or the image too small.
        """


def checked(
    image: NDArray[np.float32], noise: Noise, smallest: int
) -> tuple[NDArray[np.float32], NoiseSpectrum]:
    """Return the image as float32 and the noise as a spectrum.

    Raises
    ------
    ValueError
        Where the image is not (row, column) or (row, column, 3), is smaller than `smallest` along
        an axis or holds a number that is not finite, or where the noise does not fit it.
    """
    given = np.asarray(image, np.float32)
    if given.ndim not in (2, 3) or (given.ndim == 3 and given.shape[2] != 3):
        message = f"image must be (row, column) or (row, column, 3): {given.shape}"
        raise ValueError(message)
    if min(given.shape[:2]) < smallest:
        message = f"image must be at least {smallest} x {smallest}: {given.shape}"
        raise ValueError(message)
    if not np.isfinite(given).all():
        raise ValueError("image must be finite")
    spectrum = noise if isinstance(noise, NoiseSpectrum) else NoiseSpectrum.white(noise)
    if given.ndim == 2 and spectrum.covariance.shape[2] != 1:
        raise ValueError("noise of three channels does not fit a grey image")
    return given, spectrum
