"""Fields of gains that are denied by the long waves of a map: they would fill all of them.

The spectrum of short waves may tell no length of a field, where light may be uneven the long ones
tell no field either: but uneven light only adds to them. A long field whose waves are not there is
none.
"""

import numpy as np
import scipy.stats
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.clues import Clues
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
_LINES = 96  # of the shorter side, into which larger maps are averaged


class LongWaves:
    """The long waves of the map of gains, less a pattern.

    Waves are the smooth surfaces of `Smooth`, with what is left of them beside the pattern, of
    norm 1. A field of covariance C has among them the covariance W C W', and white noise beside it:
    the square of what is seen, over that, is chi-squared with as many degrees of freedom. Whatever
    else the light does makes it more.

    Parameters
    ----------
    clues
        The recording, with a map of gains of all channels.
    pattern
        What is not asked, per cent: (row, column).
    """

    def __init__(self, clues: Clues, pattern: Array) -> None:
        self.shared: dict[float, Array] = {}
        images = clues.image("gain")
        self.known = set(images) == set(clues.layout.sites)
        if not self.known:
            return
        whole, step = np.zeros(pattern.shape), 1 + (len(images) > 1)
        squares = []
        for channel, (image, noise) in images.items():
            y, x = clues.layout.sites[channel]
            unit = 100 / clues.scale("gain", channel)
            part = whole[y::step, x::step][: image.shape[0], : image.shape[1]]
            part[...] = (image - image.mean()) * unit
            squares.append((noise * unit) ** 2)
        self.step = max(min(pattern.shape) // _LINES, 1)
        image, own = (_averaged(one, self.step) for one in (whole, pattern))
        smooth = Smooth.of(*image.shape)
        waves = [
            np.outer(smooth.along_rows[:, i], smooth.along_columns[:, j]).ravel()
            for i in range(smooth.degree + 1)
            for j in range(smooth.degree + 1 - i)
        ]  # the constant first, which a map about its mean has not
        basis = np.linalg.qr(np.stack([waves[0], own.ravel(), *waves[1:]], 1))[0][:, 2:]
        self.waves = basis.T.reshape(-1, *image.shape)
        self.seen = np.tensordot(self.waves, image, 2)
        self.white = float(np.mean(squares)) / self.step**2

    def chance(self, variance: float, length: float) -> float:
        """Return the chance that a field has as little of the waves; 1 where there is no map.

        Of a variance in %^2 and a length in pixels.
        """
        if not self.known or not len(self.waves):
            return 1.0
        expected = variance * self._covariance(length) + self.white * np.eye(len(self.waves))
        size = float(self.seen @ np.linalg.solve(expected, self.seen))
        return float(scipy.stats.chi2.cdf(size, self.seen.size))

    def _covariance(self, length: float) -> Array:
        """Return the covariance of the waves in a field of variance 1: (wave, wave)."""
        if length in self.shared:
            return self.shared[length]
        shape = self.waves.shape[1:]
        around = tuple(2 * size for size in shape)
        y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in around)
        shared = np.exp(-np.hypot(y[:, None], x) * self.step / length)
        # Averages over blocks longer than the field share less: as much as its pixels do in all.
        shared *= min(2 * np.pi * (length / self.step) ** 2 / float(shared.sum()), 1.0)
        made = fft.irfft2(fft.rfft2(self.waves, around) * fft.rfft2(shared).real, around)
        inside = made[:, : shape[0], : shape[1]]
        found = np.asarray(np.tensordot(inside, self.waves, ((1, 2), (1, 2))))
        self.shared[length] = found
        return found


def _averaged(image: Array, step: int) -> Array:
    """Return means of an image over squares of so many pixels a side."""
    rows, columns = (size // step for size in image.shape)
    own = image[: rows * step, : columns * step].reshape(rows, step, columns, step)
    return np.asarray(own.mean((1, 3)))
