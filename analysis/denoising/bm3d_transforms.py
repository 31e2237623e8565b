"""The transforms of BM3D's 8 x 8 blocks, as matrices: rows are analysis vectors of unit norm."""

import numpy as np
from numpy.typing import NDArray

BLOCK = 8

# Low-pass of the biorthogonal spline wavelet 1.5 (Cohen, Daubechies and Feauveau, Communications on
# Pure and Applied Mathematics 45 (1992) 485-560), times 256 / sqrt(2); its high-pass is Haar's.
_LOW_PASS_1_5 = np.array([3, -3, -22, 22, 128, 128, 22, -22, -3, 3]) * np.sqrt(2) / 256


def dct() -> NDArray[np.float64]:
    """Return the orthonormal discrete cosine transform of 8 samples: (coefficient, sample)."""
    k, x = np.arange(BLOCK)[:, None], np.arange(BLOCK)
    return _of_unit_norm(np.cos(np.pi * k * (2 * x + 1) / (2 * BLOCK)))


def bior15() -> NDArray[np.float64]:
    """Return three periodic levels of the wavelet bior1.5 on 8 samples: (coefficient, sample).

    Coefficient 0 is the mean times sqrt(8). The rows are scaled to unit norm, so that white noise
    keeps its variance in each coefficient; they are not orthogonal: the inverse is the matrix's.
    """
    rows, size = np.eye(BLOCK), BLOCK
    while size > 1:
        level = np.zeros((size, size))
        for n in range(size // 2):
            for tap, weight in enumerate(_LOW_PASS_1_5):
                level[n, (2 * n + tap - 4) % size] += weight
            level[size // 2 + n, 2 * n : 2 * n + 2] = np.sqrt(0.5), -np.sqrt(0.5)
        rows[:size] = level @ rows[:size]
        size //= 2
    return _of_unit_norm(rows)


def coefficient_covariances(
    rows: NDArray[np.float64], autocovariance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the covariance of a block's coefficient with that of another block, by their offset.

    Cov[c](d) is the sum over p, q of t_c(p) t_c(q) R(p - q + d), t_c the separable analysis vector
    of c: R filtered by the autocorrelation of t_c. At d = 0 it is the variance (Makinen, Azzari and
    Foi 2020, where the variance of a group's coefficients is made of these).

    Parameters
    ----------
    rows
        (8, 8) analysis vectors.
    autocovariance
        R at lags -k..k along rows and columns, (2 k + 1, 2 k + 1), k >= 7, unit squared.

    Returns
    -------
    NDArray[np.float64]
        (2 j + 1, 2 j + 1, 8, 8), j = k - 7: offset along rows and columns, vertical and horizontal
        coefficient; unit squared.
    """
    offsets = len(autocovariance) - 2 * (BLOCK - 1)
    filters = np.zeros((BLOCK, offsets, len(autocovariance)))
    for coefficient, row in enumerate(rows):
        overlap = np.correlate(row, row, "full")
        for offset in range(offsets):
            filters[coefficient, offset, offset : offset + overlap.size] = overlap
    half = filters @ autocovariance
    return np.stack([half @ f.T for f in filters], -1).transpose(1, 2, 0, 3)


def _of_unit_norm(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))
