"""BM3D: block matching and collaborative filtering, for grey and RGB images.

Dabov, Foi, Katkovnik and Egiazarian, "Image denoising by sparse 3-D transform-domain collaborative
filtering", IEEE Trans. Image Processing 16 (2007) 2080-2095, with the parameters of its normal
profile but for two: the second stage has a reference block at every second pixel, and similarity is
counted in noise variances instead of 8-bit codes, so that scaling image and noise scales the result
(it hardly matters: the nearest blocks are taken anyway). A shift of the image shifts the result.
RGB in opponent colours, grouped by luminance (the same authors, Proc. IEEE ICIP 2007).

Coloured noise, as Makinen, Azzari and Foi, "Collaborative filtering of correlated noise: exact
transform-domain variance for improved shrinkage and patch matching", IEEE Trans. Image Processing
29 (2020) 8339-8354: every coefficient of a group has the variance that the spectrum and the places
of the blocks give it, and blocks are compared beyond what correlated noise makes alike. White noise
is filtered as in 2007, its blocks taken to be independent though they may overlap.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.denoising.arguments import Noise, checked
from analysis.denoising.bm3d_filtering import filter_groups
from analysis.denoising.bm3d_groups import MOST, Groups, Sums, bit_reversed
from analysis.denoising.bm3d_matching import match_blocks
from analysis.denoising.bm3d_shrinkage import Shrinkage
from analysis.denoising.bm3d_transforms import BLOCK, bior15, coefficient_covariances, dct
from analysis.denoising.opponent import image_of, planes_of
from analysis.denoising.spectrum import NoiseSpectrum
from dsis.compiled import ROWS_PER_BLOCK, over_rows

HARD_STEP, WIENER_STEP = 3, 2  # from one reference block to the next; the paper: 3, 3
REACH = 19  # of the search, to each side
HARD_MEMBERS, WIENER_MEMBERS = 16, MOST
GAMMA = 3.0  # how much of the likeness of correlated noise is taken off (Makinen et al. 2020)
HARD_THRESHOLD = 2.7  # standard deviations
HARD_SIMILAR = 30.0  # mean squared difference in noise variances; the paper: 3000 codes^2
WIENER_SIMILAR = 2.0  # the paper: 400 codes^2, 4 at a noise of 10 codes and 0.64 at 25
WINDOW_BETA = 2.0  # of Kaiser's window over a block
LEAST_VARIANCE = 1e-6  # of a coefficient; where a spectrum says 0 a weight would be infinite


def bm3d(image: NDArray[np.float32], noise: Noise, *, threads: int = 1) -> NDArray[np.float32]:
    """Remove additive stationary Gaussian noise: a `Denoiser`, for images of 8 x 8 and more."""
    given, spectrum = checked(image, noise, BLOCK)
    planes, spectrum = planes_of(given, spectrum)
    unit = np.sqrt(float(np.trace(spectrum.at_lag_zero)) / len(spectrum.at_lag_zero))
    if unit == 0:
        return given.copy()
    # Without its mean a plane is closer to 0, where float32 is finest.
    mean = planes.mean(axis=(1, 2), dtype=np.float64, keepdims=True).astype(np.float32)
    planes = (planes - mean) / np.float32(unit)
    spectrum = NoiseSpectrum(spectrum.covariance / unit**2)
    basic = _Stage.first(planes, spectrum).estimate(threads)
    found = _Stage.second(planes, basic, spectrum).estimate(threads)
    return image_of(found * np.float32(unit) + mean)


@dataclass(frozen=True)
class _Stage:
    """What the bands of one stage share; `basic` is empty in the first stage."""

    planes: NDArray[np.float32]
    basic: NDArray[np.float32]
    shrinkage: Shrinkage
    bias: NDArray[np.float32]
    limit: np.float32
    step: int
    members: int

    @classmethod
    def first(cls, planes: NDArray[np.float32], spectrum: NoiseSpectrum) -> "_Stage":
        """Return the stage that cuts small coefficients."""
        # Noise alone makes blocks differ by 2 (R(0) - R(d)); where it does so by less, they are
        # not more alike.
        bias = -2 * GAMMA * BLOCK**2 * spectrum.autocovariance(0, REACH)
        limit = HARD_SIMILAR * BLOCK**2 * spectrum.at_lag_zero[0, 0]
        shrinkage = _shrinkage(bior15(), planes, spectrum)
        similar = bias.astype(np.float32), np.float32(limit)
        return cls(planes, planes[:0], shrinkage, *similar, HARD_STEP, HARD_MEMBERS)

    @classmethod
    def second(
        cls, planes: NDArray[np.float32], basic: NDArray[np.float32], spectrum: NoiseSpectrum
    ) -> "_Stage":
        """Return the stage that filters as Wiener does, with the first one's result for signal."""
        bias = np.zeros((2 * REACH + 1, 2 * REACH + 1), np.float32)
        limit = np.float32(WIENER_SIMILAR * BLOCK**2 * spectrum.at_lag_zero[0, 0])
        shrinkage = _shrinkage(dct(), planes, spectrum)
        return cls(planes, basic, shrinkage, bias, limit, WIENER_STEP, WIENER_MEMBERS)

    def estimate(self, threads: int) -> NDArray[np.float32]:
        """Return the estimate, (channel, row, column): bands are filtered, then added in order."""
        height = self.planes.shape[1]
        bands: list[Sums | None] = [None] * -(-height // ROWS_PER_BLOCK)

        def work(first: int, last: int) -> None:
            for top in range(first, last, ROWS_PER_BLOCK):
                bands[top // ROWS_PER_BLOCK] = self._band(top)

        over_rows(work, height, threads)
        total, weight = np.zeros_like(self.planes), np.zeros_like(self.planes)
        for band in bands:
            if band is not None:
                rows = slice(band.top, band.top + band.total.shape[1])
                total[:, rows] += band.total
                weight[:, rows] += band.weight
        return total / weight

    def _band(self, top: int) -> Sums:
        """Filter the groups whose reference blocks begin in the rows from `top`."""
        _, height, width = self.planes.shape
        rows, columns = (_corners(size, self.step) for size in (height, width))
        rows = rows[(rows >= top) & (rows < top + ROWS_PER_BLOCK)]
        places = np.empty((rows.size, columns.size, self.members), np.int32)
        counts = np.empty(places.shape[:2], np.int32)
        compared = self.basic[0] if len(self.basic) else self.planes[0]
        match_blocks(compared, rows, columns, self.bias, self.limit, places, counts)
        start = max(0, top - REACH)
        stop = min(height, top + ROWS_PER_BLOCK + REACH + BLOCK)
        total = np.zeros((len(self.planes), stop - start, width), np.float32)
        sums = Sums(start, total, np.zeros_like(total))
        groups = Groups(places, counts, bit_reversed())
        filter_groups(self.planes, self.basic, groups, self.shrinkage, sums)
        return sums


def _corners(size: int, step: int) -> NDArray[np.intp]:
    """Return where reference blocks begin along an axis; the last one ends with the image."""
    return np.unique(np.append(np.arange(0, size - BLOCK + 1, step), size - BLOCK)).astype(np.intp)


def _shrinkage(
    transform: NDArray[np.float64], planes: NDArray[np.float32], spectrum: NoiseSpectrum
) -> Shrinkage:
    reach = _reach(spectrum)
    covariances = []
    for channel in range(len(planes)):
        lags = spectrum.autocovariance(channel, reach + BLOCK - 1)
        found = coefficient_covariances(transform, lags)
        covariances.append(found.swapaxes(2, 3).reshape(*found.shape[:2], -1))
    window = np.kaiser(BLOCK, WINDOW_BETA)
    arrays = transform, np.linalg.inv(transform), np.stack(covariances), np.outer(window, window)
    forward, inverse, covariance, weights = (a.astype(np.float32) for a in arrays)
    numbers = np.float32(LEAST_VARIANCE), np.float32(HARD_THRESHOLD)
    return Shrinkage(forward, inverse, covariance, *numbers, weights)


def _reach(spectrum: NoiseSpectrum) -> int:
    """Return how far apart blocks have correlated noise; 0 where no two pixels have.

    Correlations below a thousandth are left out.
    """
    correlation = np.abs(np.diagonal(spectrum.covariance, axis1=2, axis2=3)).max(axis=2)
    y, x = np.nonzero(correlation > 1e-3 * correlation.max())
    rows, columns = correlation.shape
    longest = int(max(np.abs(y - rows // 2).max(), np.abs(x - columns // 2).max()))
    return min(longest + BLOCK - 1, 2 * REACH) if longest else 0
