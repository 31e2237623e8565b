"""The Bayes least-squares estimate of a band's coefficients under a Gaussian scale mixture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel

CHUNK = 128  # coefficients that are worked on together: their planes stay in the first-level cache
_U = np.uintp
_LOG2_E, _ROUND = np.float32(1.4426950408889634), np.float32(12582912.0)
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)


class Mixture(NamedTuple):
    """Prior of a neighbourhood, diagonal: y = S Q v, v_n of variance z l_n + 1 given z.

    Attributes
    ----------
    analysis
        (n, n), v = analysis y.
    centre
        (n,), row of S Q that gives the coefficient itself.
    noise_share
        (z, n), 1 / (z l_n + 1).
    log_weight
        (z,), log of the prior times the normalisation of p(y|z).
    """

    analysis: NDArray[np.float32]
    centre: NDArray[np.float32]
    noise_share: NDArray[np.float32]
    log_weight: NDArray[np.float32]


@inlined
def _exponential(x: np.float32) -> np.float32:
    """Return e^x for x <= 0, relative error 1e-7; 0 stands for what float32 cannot hold."""
    x = max(x, np.float32(-87))
    n = (x * _LOG2_E + _ROUND) - _ROUND
    r = x - n * _LN2_HIGH - n * _LN2_LOW
    p = np.float32(1.9875691500e-4) * r + np.float32(1.3981999507e-3)
    p = p * r + np.float32(8.3334519073e-3)
    p = p * r + np.float32(4.1665795894e-2)
    p = p * r + np.float32(1.6666665459e-1)
    p = p * r + np.float32(5.0000001201e-1)
    power = np.int32((np.int32(n) + np.int32(127)) << np.int32(23)).view(np.float32)
    return (p * r * r + r + np.float32(1)) * power


@kernel
def estimate_rows(
    band: NDArray[np.float32],
    parent: NDArray[np.float32],
    mixture: Mixture,
    first: int,
    last: int,
    out: NDArray[np.float32],
) -> None:
    """Fill rows first..last-1 of `out` with E[x|y], Portilla et al. (2003), equations (5) to (11).

    Parameters
    ----------
    band
        float32 (row + 2, column + 2): the band, one sample wrapped around at each border.
    parent
        float32 (row, column): the next octave at the same places; or no row at all.
    mixture
        Of the 3 x 3 neighbourhood, row by row, and the parent where there is one.
    """
    columns = band.shape[1] - 2
    size, scales = mixture.analysis.shape[0], mixture.log_weight.size
    v = np.empty((size, CHUNK), np.float32)
    square = np.empty((size, CHUNK), np.float32)
    log_p = np.empty((scales, CHUNK), np.float32)
    removed = np.empty((scales, CHUNK), np.float32)
    for y in range(first, last):
        for x in range(0, columns, CHUNK):
            width = min(CHUNK, columns - x)
            v[:] = np.float32(0)
            for k in range(size):
                source = band[y + k // 3, x + k % 3 :] if k < 9 else parent[y, x:]
                for n in range(size):
                    _add(v[n], source, mixture.analysis[n, k], width)
            for n in range(size):
                _square(v[n], square[n], mixture.centre[n], width)
            for z in range(scales):
                log_p[z] = mixture.log_weight[z]
                removed[z] = np.float32(0)
                for n in range(size):
                    share = mixture.noise_share[z, n]
                    _add(log_p[z], square[n], np.float32(-0.5) * share, width)
                    _add(removed[z], v[n], share, width)
            _average(log_p, removed, band[y + 1, x + 1 :], out[y, x:], width)


@inlined
def _add(
    total: NDArray[np.float32], plane: NDArray[np.float32], weight: np.float32, width: int
) -> None:
    for i in range(width):
        total[_U(i)] += weight * plane[_U(i)]


@inlined
def _square(
    v: NDArray[np.float32], square: NDArray[np.float32], centre: np.float32, width: int
) -> None:
    """Keep v^2, and what v contributes to the coefficient."""
    for i in range(width):
        square[_U(i)] = v[_U(i)] * v[_U(i)]
        v[_U(i)] *= centre


@inlined
def _average(
    log_p: NDArray[np.float32],
    removed: NDArray[np.float32],
    observed: NDArray[np.float32],
    out: NDArray[np.float32],
    width: int,
) -> None:
    """Fill `out` with the observed coefficient less the noise in it, averaged over p(z|y)."""
    scales = log_p.shape[0]
    peak = np.empty(CHUNK, np.float32)
    total = np.empty(CHUNK, np.float32)
    noise = np.empty(CHUNK, np.float32)
    for i in range(width):
        peak[_U(i)] = log_p[0, _U(i)]
        total[_U(i)] = np.float32(0)
        noise[_U(i)] = np.float32(0)
    for z in range(1, scales):
        row = log_p[z]
        for i in range(width):
            peak[_U(i)] = max(peak[_U(i)], row[_U(i)])
    for z in range(scales):
        row, part = log_p[z], removed[z]
        for i in range(width):
            p = _exponential(row[_U(i)] - peak[_U(i)])
            total[_U(i)] += p
            noise[_U(i)] += p * part[_U(i)]
    for i in range(width):
        out[_U(i)] = observed[_U(i)] - noise[_U(i)] / total[_U(i)]
