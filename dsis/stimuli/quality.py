"""How far a frame is from its reference: PSNR as delivered, and as computed."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.imagefile import codes

Frame = NDArray[np.float32]
Codes = NDArray[np.uint8]


def delivered(display: Frame) -> Codes:
    """Return what a screen gets of a display frame 0..1: 8-bit codes, clipped and rounded."""
    return codes(display, 255).astype(np.uint8, copy=False)


def psnr_db(test: Codes, reference: Codes) -> float:
    """Return 10 log10(255^2 / MSE) over all pixels and channels; inf for equal frames."""
    return _db(float(_squared_codes(test.reshape(-1), reference.reshape(-1))) / test.size)


def psnr_float_db(test: Frame, reference: Frame) -> float:
    """Return the same of display frames 0..1, neither clipped nor rounded."""
    rows = np.empty(len(test), np.float64)
    _squared(test.reshape(len(test), -1), reference.reshape(len(test), -1), rows)
    return _db(float(rows.sum()) / test.size * 255**2)


def _db(mean_square_error: float) -> float:
    if mean_square_error == 0:
        return float("inf")
    return float(10 * np.log10(255**2 / mean_square_error))


@kernel
def _squared_codes(test: Codes, reference: Codes) -> np.int64:
    """Return the sum of squared differences, exactly."""
    total = np.int64(0)
    for i in range(test.size):
        difference = np.int32(test[i]) - np.int32(reference[i])
        total += np.int64(difference * difference)
    return total


@kernel
def _squared(test: Frame, reference: Frame, rows: NDArray[np.float64]) -> None:
    """Fill `rows` with the sum of squared differences of each row (row, sample)."""
    for row in range(test.shape[0]):
        total = np.float64(0)
        for i in range(test.shape[1]):
            difference = np.float64(test[row, i] - reference[row, i])
            total += difference * difference
        rows[row] = total
