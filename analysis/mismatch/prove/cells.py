"""What a converter makes of signals: the cell of each code.

Rounding to whole codes is exact. Other converters are asked: a ramp goes through the links of the
camera. Where two sensors give two answers the widths of codes are random; then the training frames
tell them, shrunk by the model's own spread of widths.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial

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
_CLEAR = 4.0  # standard deviations from an end of the converter: nothing is clipped
_COARSE = 0.6  # of a cell: narrower noise is moved by rounding
_OUTER = 1e7  # DN: beyond every signal


@dataclass(frozen=True)
class Cells:
    """Cells of the codes of a converter.

    Attributes
    ----------
    lower_dn, upper_dn
        Edges of each code's cell, DN above black; equal where a code never occurs.
    black_dn
        The black level.
    width_variance
        Of the codes' relative widths from sensor to sensor; 0: all sensors alike.
    weight
        Relative width of each code as it was learned; 1 where nothing was.
    """

    lower_dn: Array
    upper_dn: Array
    black_dn: float
    width_variance: float
    weight: Array

    @property
    def plain(self) -> bool:
        """Whether every sensor has the same cells."""
        return not self.width_variance

    @cached_property
    def step_dn(self) -> float:
        """Width of the median code that occurs, those at the ends left out; none between: of 1."""
        width = (self.upper_dn - self.lower_dn)[self.occurring[1:-1]]
        return float(np.median(width)) if width.size else 1.0

    @cached_property
    def occurring(self) -> NDArray[np.intp]:
        """The codes that occur, ascending."""
        return np.flatnonzero(self.upper_dn > self.lower_dn)

    def centre(self, mean_dn: float, sd_dn: float) -> float:
        """Return the centre of normal noise whose codes have a mean, both in DN above black.

        Clipping and coarse codes move the mean; elsewhere it is the centre itself.
        """
        step = self.step_dn
        first, last = self.occurring[[0, -1]]
        ends = min(mean_dn - self.upper_dn[first], self.lower_dn[last] - mean_dn)
        if ends > _CLEAR * sd_dn and sd_dn > _COARSE * step:
            return mean_dn
        reach = 1.5 * step + 2.5 * sd_dn
        grid = np.linspace(mean_dn - reach, mean_dn + reach, 81)
        edges = self.upper_dn[:-1]
        first, last = np.searchsorted(edges, [grid[0] - 9 * sd_dn, grid[-1] + 9 * sd_dn])
        below = ndtr((edges[first:last] - grid[:, np.newaxis]) / sd_dn)
        code = last - below.sum(1)  # the last code less the chances of lying below each edge
        return float(np.interp(mean_dn + self.black_dn, code, grid))

    def learned(self, counts: NDArray[np.int64], expected: Array) -> "Cells":
        """Return the cells with the widths that training frames show.

        Parameters
        ----------
        counts
            How often each code occurred.
        expected
            How often it would have with these cells.

        Widths have mean 1 and variance s: gamma-distributed, of which Poisson counts are seen, so
        that the posterior mean is (1 / s + counts) / (1 / s + expected). What changes slowly from
        code to code is the law of the noise, not a width, and divided out.
        """
        prior = 1 / self.width_variance
        weight = (prior + counts) / (prior + expected)
        smooth = gaussian_filter1d(expected * weight, _SMOOTH_CODES)
        density = gaussian_filter1d(expected, _SMOOTH_CODES)
        level = np.divide(smooth, density, out=np.ones_like(smooth), where=density > 0)
        return replace(self, weight=weight / level)


def cells_of(camera: Camera, seed: int) -> Cells:
    """Return the cells of a camera's converter."""
    codes = np.arange(int(camera.white_level) + 1)
    links = [link for link in camera.chain() if of_converter(link)]
    ones = np.ones(codes.size)
    if len(links) == 1:  # rounding alone
        lower = codes - 0.5 - camera.black_level
        return Cells(*_open(lower, lower + 1), camera.black_level, 0.0, ones)
    ramp = (np.arange(codes.size * _PER_DN) + 0.5) / _PER_DN - 0.5 - camera.black_level
    grid = PixelGrid(1, ramp.size, camera.cfa)
    image = ramp.astype(np.float32)[np.newaxis]
    one, two = (
        np.rint(converted(camera, image, grid, Draw(seed).within("ramp", str(k)))[0])
        for k in range(2)
    )
    width = np.bincount(one.astype(np.intp), minlength=codes.size) / _PER_DN
    other = np.bincount(two.astype(np.intp), minlength=codes.size) / _PER_DN
    if (width != other).any():
        inner = np.concatenate([width[1:-1], other[1:-1]])
        lower = codes - 0.5 - camera.black_level
        spread = float(((inner - 1) ** 2).mean())
        return Cells(*_open(lower, lower + 1), camera.black_level, spread, ones)
    lower = np.concatenate([[0.0], np.cumsum(width)[:-1]]) - 0.5 - camera.black_level
    return Cells(*_open(lower, lower + width), camera.black_level, 0.0, ones)


def _open(lower: NDArray[np.floating], upper: NDArray[np.floating]) -> tuple[Array, Array]:
    """Return edges, ascending, whose first and last cells take all that lies beyond."""
    first, last = np.flatnonzero(upper > lower)[[0, -1]]
    low, high = lower.astype(np.float64), upper.astype(np.float64)
    low[: first + 1], high[:first] = -_OUTER, -_OUTER
    low[last + 1 :], high[last:] = _OUTER, _OUTER
    return low, high


def converted(camera: Camera, image: Image, grid: PixelGrid, sensor: Draw) -> Image:
    """Return codes, float32, of a signal in DN above black."""
    for link in camera.chain():
        if of_converter(link):
            still = partial(_same, image)
            exposure = Exposure(grid, 0, sensor, sensor, image, camera.read_out, still)
            image = link.apply(image, exposure)
    codes: Image = image + np.float32(camera.black_level)
    return codes


def _same(image: Image, _: int) -> Image:
    return image
