"""Fixed features of 32 x 32 patches: what a frame looks like beside others of its sensor."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import gaussian_filter1d

Array = NDArray[np.float64]
SIDE = 32
_SMOOTH_CODES = 4.0  # what varies slower than this is no code's own width
NAMES = (
    "mean squared",
    "variance",
    "skewness",
    "kurtosis",
    "largest",
    "smallest",
    "variance of row means",
    "variance of column means",
    "lag 0 1",
    "lag 1 0",
    "lag 1 1",
    "lag 0 2",
    "lag 2 0",
    "low frequencies",
    "corner frequencies",
    "spectral peak",
    "widths of codes",
    "frame before",
    "map variance",
    "map row variance",
    "map column variance",
    "map smooth",
    "map largest",
    "spread of variances",
)


def patches(frame: NDArray[np.generic]) -> Array:
    """Return the patches of a frame (row, column): (patch, row, column)."""
    rows, columns = (n // SIDE for n in frame.shape)
    cut = np.asarray(frame[: rows * SIDE, : columns * SIDE], np.float64)
    tiles = cut.reshape(rows, SIDE, columns, SIDE).swapaxes(1, 2)
    return tiles.reshape(-1, SIDE, SIDE)


def code_widths(codes: NDArray[np.intp]) -> Array:
    """Return by how much each code, from 0, is more frequent in a frame than those about it.

    The converter is one for all patches of a sensor: only how unequal its codes are, found in a
    patch as in the whole frame, is a law that another sensor shares; which of them are wide is not.
    """
    counts = np.bincount(codes.reshape(-1)).astype(np.float64)
    about = gaussian_filter1d(counts, _SMOOTH_CODES, mode="constant")
    return np.divide(counts, about, out=np.ones_like(counts), where=about > 0) - 1


def patch_features(
    residual: Array, before: Array | None, codes: NDArray[np.intp], pattern: Array, spread: Array
) -> Array:
    """Return the features of each patch of a frame: (patch, feature), in the order of `NAMES`.

    Parameters
    ----------
    residual
        Frame less training mean, in units of its standard deviation.
    before
        The same of the frame before; None: there is none.
    codes
        The frame.
    pattern
        Training mean less its own mean, in units of its standard deviation.
    spread
        Temporal variance of each pixel over the training frames, mean 1.
    """
    d = patches(residual)
    mean = d.mean((1, 2))
    z = d - mean[:, np.newaxis, np.newaxis]
    square = z * z
    variance = square.mean((1, 2))
    power = np.abs(fft.rfft2(z)) ** 2 / SIDE**2
    low = power[:, 1:4, 1:4].mean((1, 2))
    corner = (power[:, 16, 16] + power[:, 16, 0] + power[:, 0, 16]) / 3
    memory = np.zeros(len(d)) if before is None else (z * patches(before)).mean((1, 2))
    m = patches(pattern)
    m = m - m.mean((1, 2), keepdims=True)
    s = patches(spread)
    down, across = np.linspace(-1, 1, SIDE)[:, np.newaxis], np.linspace(-1, 1, SIDE)
    smooth = (m * down).mean((1, 2)) ** 2 + (m * across).mean((1, 2)) ** 2
    return np.stack(
        [
            mean**2 * SIDE**2,
            variance,
            (square * z).mean((1, 2)),
            (square * square).mean((1, 2)) - 3 * variance**2,
            np.log(np.maximum(z.max((1, 2)), 0.1)),
            np.log(np.maximum(-z.min((1, 2)), 0.1)),
            z.mean(2).var(1) * SIDE,
            z.mean(1).var(1) * SIDE,
            (z[:, :, 1:] * z[:, :, :-1]).mean((1, 2)),
            (z[:, 1:] * z[:, :-1]).mean((1, 2)),
            (z[:, 1:, 1:] * z[:, :-1, :-1]).mean((1, 2)),
            (z[:, :, 2:] * z[:, :, :-2]).mean((1, 2)),
            (z[:, 2:] * z[:, :-2]).mean((1, 2)),
            low,
            corner,
            np.log(np.maximum(power[:, 1:].max((1, 2)), 1e-12)),
            patches(code_widths(codes)[codes]).mean((1, 2)),
            memory,
            (m**2).mean((1, 2)),
            m.mean(2).var(1) * SIDE,
            m.mean(1).var(1) * SIDE,
            smooth * SIDE**2,
            np.log(np.maximum(np.abs(m).max((1, 2)), 0.1)),
            s.var((1, 2)),
        ],
        1,
    )
