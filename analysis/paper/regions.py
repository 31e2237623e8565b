"""Flat, edge and texture: parts of a picture by the structure tensor of its lightness."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

REGIONS = ("flat", "edge", "texture")
WINDOW_PX = 2.0  # standard deviation of the window
FLAT_CODES = 2.0  # root mean square gradient per pixel
COHERENT = 0.7


def regions(codes: NDArray[np.float32]) -> dict[str, NDArray[np.bool_]]:
    """Return the pixels of each kind: bool (row, column), which cover the picture.

    Flat: the gradient is below 2 codes per pixel, root mean square over a Gaussian window of
    2 pixels. Edge: above, and one direction has it: coherence (l1 - l2) / (l1 + l2) above 0.7 of
    the eigenvalues of the structure tensor. Texture: the rest.

    Parameters
    ----------
    codes
        Noise-free display frame, 8-bit codes, float32 (row, column, 3).
    """
    lightness = codes.mean(axis=2)
    dy, dx = np.gradient(lightness)
    yy, xx, xy = (ndimage.gaussian_filter(p, WINDOW_PX) for p in (dy * dy, dx * dx, dy * dx))
    energy = xx + yy
    coherence = np.hypot(xx - yy, 2 * xy) / np.maximum(energy, np.float32(1e-12))
    flat = energy < FLAT_CODES**2
    edge = ~flat & (coherence > COHERENT)
    return {"flat": flat, "edge": edge, "texture": ~flat & ~edge}
