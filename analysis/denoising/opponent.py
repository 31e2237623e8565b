"""Opponent colours: the space in which both denoisers take an RGB image apart.

Y = (R + G + B)/3, U = (R - B)/2, V = (R - 2 G + B)/4, as the color BM3D of Dabov, Foi, Katkovnik
and Egiazarian, "Color image denoising via sparse 3D collaborative filtering with grouping
constraint in luminance-chrominance space", Proc. IEEE ICIP (2007), whose rows are orthogonal: white
noise that is equal and independent in R, G, B is so in Y, U, V too, at other levels.
"""

import numpy as np
from numpy.typing import NDArray

from analysis.denoising.spectrum import NoiseSpectrum

OPPONENT_FROM_RGB = np.array([[1 / 3, 1 / 3, 1 / 3], [1 / 2, 0, -1 / 2], [1 / 4, -1 / 2, 1 / 4]])


def planes_of(
    image: NDArray[np.float32], noise: NoiseSpectrum
) -> tuple[NDArray[np.float32], NoiseSpectrum]:
    """Return an image's planes, float32 (channel, row, column), and the noise in them."""
    if image.ndim == 2:
        return np.ascontiguousarray(image, np.float32)[None], noise
    matrix = OPPONENT_FROM_RGB.astype(np.float32)
    red, green, blue = np.moveaxis(image, -1, 0)
    planes = np.empty((3, *image.shape[:2]), np.float32)
    for plane, (r, g, b) in zip(planes, matrix, strict=True):
        plane[:] = r * red + g * green + b * blue
    return planes, noise.mixed(OPPONENT_FROM_RGB)


def image_of(planes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the image, (row, column) or (row, column, 3), of planes made by `planes_of`."""
    if len(planes) == 1:
        return np.asarray(planes[0])
    matrix = np.linalg.inv(OPPONENT_FROM_RGB).astype(np.float32)
    image = np.empty((*planes.shape[1:], 3), np.float32)
    for channel, (y, u, v) in enumerate(matrix):
        image[..., channel] = y * planes[0] + u * planes[1] + v * planes[2]
    return image
