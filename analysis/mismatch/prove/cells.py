"""What a converter makes of signals: the cell of each code.

Rounding to whole codes is exact. Other converters are asked: a ramp goes through the links of the
camera. Where two sensors give two answers the widths of codes are random; then the training frames
tell them, shrunk by the model's own spread of widths.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtr

from analysis.mismatch.prove.virtual import of_converter
from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Exposure, Image
from dsis.grid import PixelGrid

Array = NDArray[np.float64]
_PER_DN = 32  # steps of the ramp
_SMOOTH_CODES = 4.0  # what varies slower than this is no code's own width
_REACH = 8.0  # standard deviations
_OUTER = 1e6  # DN: beyond every signal


@dataclass(frozen=True)
class Cells:
    """Cells of the codes of a converter.

    Attributes
    ----------
    lower_dn, upper_dn
        Edges of each code's cell, DN above black; equal where a code never occurs.
    width_variance
        Of the codes' relative widths from sensor to sensor; 0: all sensors alike.
    weight
        Relative width of each code that was learned; None: all as the cells say.
    """

    lower_dn: Array
    upper_dn: Array
    width_variance: float
    weight: Array | None = None

    @property
    def step_dn(self) -> float:
        """Usual width of the cells that are there, DN."""
        width = (self.upper_dn - self.lower_dn)[1:-1]
        return float(np.median(width[width > 0])) if (width > 0).any() else 1.0

    def centre(self, mean_dn: float, sd_dn: float) -> float:
        """Return the centre of normal noise whose *codes* have a mean, all in DN above black.

        Clipping and coarse codes move the mean; elsewhere it is the centre itself.
        """
        low, high = self.upper_dn[0], self.lower_dn[-1]
        clear = min(mean_dn - low, high - mean_dn) > 4 * sd_dn
        if clear and sd_dn > 0.6 * self.step_dn:
            return mean_dn
        reach = 1.5 * self.step_dn + 2.5 * sd_dn
        grid = np.linspace(mean_dn - reach, mean_dn + reach, 81)
        edges = self.upper_dn[:-1]
        first, last = np.searchsorted(edges, [grid[0] - 9 * sd_dn, grid[-1] + 9 * sd_dn])
        near = slice(first, last + 1)
        below = ndtr((edges[near] - grid[:, np.newaxis]) / sd_dn)
        # The mean code is the highest less the probabilities of lying below each edge.
        top = first + below.shape[1]
        code = top - below.sum(1)
        black = -0.5 - float(self.lower_dn[1] - 1) if self.step_dn == 1 else 0.0
        del black
        return float(np.interp(mean_dn + self._black_dn(), np.maximum.accumulate(code), grid))

    def _black_dn(self) -> float:
        """Return the black level that signals are counted from."""
        return float(np.median(self._codes_less_centres()))

    def _codes_less_centres(self) -> Array:
        inner = slice(1, -1)
        return np.arange(self.lower_dn.size)[inner] - (self.lower_dn + self.upper_dn)[inner] / 2
