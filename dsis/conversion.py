"""What a converter makes of a signal: whole codes between its ends, in one pass over an image."""

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Image = NDArray[np.float32]


def converted(image: Image, black: float, white: float) -> Image:
    """Return whole codes less black, none below 0 and none above white; nan stays nan.

    Parameters
    ----------
    image
        Signal of any shape, DN above black.
    black, white
        Code of no light, and the largest code, DN.
    """
    flat = np.ascontiguousarray(image).reshape(-1)
    return _converted(flat, np.float32(black), np.float32(white)).reshape(image.shape)


def codes_of(image: Image, black: float) -> Image:
    """Return the codes of an image of whole codes less black, which rounding may have moved."""
    flat = np.ascontiguousarray(image).reshape(-1)
    return _codes_of(flat, np.float32(black)).reshape(image.shape)


@kernel
def _converted(image: Image, black: np.float32, white: np.float32) -> Image:
    out, zero = np.empty_like(image), np.float32(0)
    for i in range(image.size):
        code = np.rint(image[i] + black)
        out[i] = np.minimum(np.maximum(code, zero), white) - black  # where nan stays nan
    return out


@kernel
def _codes_of(image: Image, black: np.float32) -> Image:
    out = np.empty_like(image)
    for i in range(image.size):
        out[i] = np.rint(image[i] + black)
    return out
