"""How far a frame is from its reference: PSNR as delivered, and as computed."""

import numpy as np
from numpy.typing import NDArray

from dsis.imagefile import codes

Frame = NDArray[np.float32]


def delivered(display: Frame) -> NDArray[np.uint8]:
    """Return what a screen gets of a display frame 0..1: 8-bit codes, clipped and rounded."""
    return codes(display, 255).astype(np.uint8)


def psnr_db(test: NDArray[np.uint8], reference: NDArray[np.uint8]) -> float:
    """Return 10 log10(255^2 / MSE) over all pixels and channels; inf for equal frames."""
    difference = test.astype(np.int32) - reference
    return _db(float(np.square(difference).mean()))


def psnr_float_db(test: Frame, reference: Frame) -> float:
    """Return the same of display frames 0..1, neither clipped nor rounded."""
    difference = (test - reference).astype(np.float64)
    return _db(float(np.square(difference).mean()) * 255**2)


def _db(mean_square_error: float) -> float:
    if mean_square_error == 0:
        return float("inf")
    return float(10 * np.log10(255**2 / mean_square_error))
