"""Which pixels are noisy in every exposure."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import UNKNOWN, Number

Array = NDArray[np.float64]
OUTSTANDING = (4, 7, 12)  # standard deviations of a pixel's summed variance


class VarianceSums:
    """Which pixels are noisy in every exposure.

    Products of the pixel variances of different exposures: what they have in common is a property
    of the pixel (its read noise, a trap); heavy tails and spikes leave it at zero.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.total = np.zeros(shape)
        self.squares, self.fourths = 0.0, 0.0

    def add(self, variance_map: Array, weight: float) -> None:
        """Take the variance of each pixel (row, column) of one exposure."""
        mean = float(variance_map.mean())
        if not mean > 0:
            return
        part = weight * (variance_map / mean - 1)
        self.total += part
        square = float((part**2).mean())
        self.squares += square
        self.fourths += square**2

    def numbers(self) -> dict[str, Number]:
        """Return the persistence, and how many pixels stand out by so many standard deviations.

        Counts enter as twice their root (Anscombe 1948), of standard deviation 1.
        """
        found = {"variance_persistence": self._persistence()}
        sd = sqrt(self.squares)
        for limit in OUTSTANDING:
            count = int((self.total > limit * sd).sum()) if sd > 0 else 0
            found[f"noisy_pixels of {limit}"] = (2 * sqrt(count + 3 / 8), 1.0)
        return found

    def _persistence(self) -> Number:
        """Return the mean product of different exposures in units of its null error."""
        excess = float((self.total**2).mean()) - self.squares
        null = 2 * (self.squares**2 - self.fourths) / self.total.size
        if null <= 1e-12 * self.squares**2:
            return UNKNOWN
        return excess / sqrt(null), 1.0
