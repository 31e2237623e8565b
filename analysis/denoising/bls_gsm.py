"""BLS-GSM: Bayes least squares under a Gaussian scale mixture of steerable pyramid coefficients.

Portilla, Strela, Wainwright and Simoncelli, "Image denoising using scale mixtures of Gaussians in
the wavelet domain", IEEE Trans. Image Processing 12 (2003) 1338-1351, in its published
configuration: full steerable pyramid of eight orientations, neighbourhoods of 3 x 3 and the parent,
Jeffreys' prior p(z) = 1/z on log z = -20.5 .. 3.5. A neighbourhood is y = sqrt(z) u + w; C_w comes
from the noise spectrum, C_u = C_y - C_w with its negative eigenvalues (in units of the noise)
raised to zero. RGB is denoised in opponent colours, each with its own noise.
"""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.denoising.arguments import Noise, checked
from analysis.denoising.bls_gsm_estimate import Mixture, estimate_rows
from analysis.denoising.opponent import image_of, planes_of
from analysis.denoising.pyramid import Level, Pyramid, good_odd_size
from dsis.compiled import over_rows

LOG_Z = np.arange(-20.5, 3.5 + 0.5, 1.0)  # steps of 0.5 change the result by 0.005 dB
MARGIN = 16  # pixels that the image is reflected by, at least, so that its ends do not meet
SMALLEST = 33


def bls_gsm(image: NDArray[np.float32], noise: Noise, *, threads: int = 1) -> NDArray[np.float32]:
    """Remove additive stationary Gaussian noise: a `Denoiser`, for images of 33 x 33 and more."""
    given, spectrum = checked(image, noise, SMALLEST)
    rows, columns = given.shape[:2]
    octaves = max(1, int(np.ceil(np.log2(min(rows, columns)))) - 4)
    before = [MARGIN, MARGIN]
    sizes = [good_odd_size(size + 2 * MARGIN) for size in (rows, columns)]
    after = [size - MARGIN - n for size, n in zip(sizes, (rows, columns), strict=True)]
    pyramid = Pyramid.of(sizes[0], sizes[1], octaves)
    planes, spectrum = planes_of(given, spectrum)
    out = np.empty_like(planes)
    for channel, plane in enumerate(planes):
        # Without its mean a plane is closer to 0, where float32 is finest.
        mean = np.float32(plane.mean(dtype=np.float64))
        extended = np.pad(plane - mean, list(zip(before, after, strict=True)), "symmetric")
        power = spectrum.power(channel, sizes[0], sizes[1])[:, : sizes[1] // 2 + 1]
        found = _denoised(extended, power, pyramid, threads) if power.any() else extended
        out[channel] = found[MARGIN : MARGIN + rows, MARGIN : MARGIN + columns] + mean
    return image_of(out)


def _denoised(
    plane: NDArray[np.float32], power: NDArray[np.float64], pyramid: Pyramid, threads: int
) -> NDArray[np.float32]:
    """Return the estimate of a periodic plane; `power` of the noise on its half spectrum."""
    spectrum = pyramid.grid.forward(plane)
    samples = plane.size
    observed = np.abs(spectrum).astype(np.float64) ** 2 * samples
    result = spectrum * pyramid.low_pass**2
    for level in pyramid.levels:
        grid = level.grid
        here = grid.crop(spectrum) * np.complex64(1j)
        noise, image = grid.crop(power) / samples, grid.crop(observed) / samples
        total = np.zeros_like(here)
        for angular in level.angular:
            own = level.radial * angular
            parent = None if level.parent is None else level.parent * angular
            c_w = neighbourhood_covariance(noise, own, parent, level)
            mixture = mixture_of(c_w, neighbourhood_covariance(image, own, parent, level))
            band = np.pad(grid.inverse(here * own), 1, "wrap")
            above = grid.inverse(here * parent) if parent is not None else band[:0]
            estimate = np.empty((grid.rows, grid.columns), np.float32)
            work = partial(_fill, band, above, mixture, estimate)
            over_rows(work, grid.rows, threads)
            total += grid.forward(estimate) * own
        grid.add_to(result, total * np.complex64(-1j))
    return pyramid.grid.inverse(result)


def _fill(
    band: NDArray[np.float32],
    above: NDArray[np.float32],
    mixture: Mixture,
    estimate: NDArray[np.float32],
    first: int,
    last: int,
) -> None:
    estimate_rows(band, above, mixture, first, last, estimate)


def neighbourhood_covariance(
    power: NDArray[np.float64],
    own: NDArray[np.float32],
    parent: NDArray[np.float32] | None,
    level: Level,
) -> NDArray[np.float64]:
    """Return the covariance of a 3 x 3 neighbourhood of a band, and its parent where it has one.

    Parameters
    ----------
    power
        Power of what is filtered over the number of its samples, on the level's half spectrum:
        the noise's for C_w, the image's own periodogram for C_y.
    own, parent
        Transfer functions of the band and of its parent there.
    level
        Where they are sampled.
    """
    to_own = level.grid.autocovariance(power, own, own)
    y, x = np.divmod(np.arange(9), 3)
    spatial = to_own[y[:, None] - y + 2, x[:, None] - x + 2]
    if parent is None:
        return np.asarray(spatial)
    to_parent = level.grid.autocovariance(power, own, parent)[1:4, 1:4].reshape(-1, 1)
    variance = level.grid.autocovariance(power, parent, parent)[2:3, 2:3]
    return np.block([[spatial, to_parent], [to_parent.T, variance]])


def mixture_of(c_w: NDArray[np.float64], c_y: NDArray[np.float64]) -> Mixture:
    """Return the prior for noise and observation of these covariances, both (n, n).

    With C_w = S S^T and S^-1 C_u S^-T = Q diag(l) Q^T a neighbourhood is y = S Q v and the estimate
    of v_n given z is z l_n / (z l_n + 1) v_n.
    """
    values, vectors = np.linalg.eigh(c_w)
    floor = max(values.max(), c_y.max() * 1e-6) * 1e-6
    root = np.sqrt(np.maximum(values, floor))
    whiten = vectors.T / root[:, None]
    signal, rotation = np.linalg.eigh(whiten @ (c_y - c_w) @ whiten.T)
    lengths = np.maximum(signal, 0)
    shares = 1 / (np.exp(LOG_Z)[:, None] * lengths + 1)
    analysis = rotation.T @ whiten
    centre = ((vectors * root) @ rotation)[4]
    log_weight = 0.5 * np.log(shares).sum(axis=1)
    as_float32 = (a.astype(np.float32) for a in (analysis, centre, shares, log_weight))
    return Mixture(*as_float32)
