"""Colour filter arrays: which channel each pixel of a sensor sees."""

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

RED, GREEN, BLUE = 0, 1, 2


class Cfa(StrEnum):
    """Colours of rows 0, 1 and columns 0, 1, read row by row; MONO has no filters."""

    MONO = "MONO"
    RGGB = "RGGB"
    BGGR = "BGGR"
    GRBG = "GRBG"
    GBRG = "GBRG"


def pattern(cfa: Cfa) -> NDArray[np.uint8]:
    """Return the channel (0 red, 1 green, 2 blue) of rows 0, 1 and columns 0, 1: uint8 (2, 2).

    MONO gives zeros: its only channel has index 0.
    """
    if cfa is Cfa.MONO:
        return np.zeros((2, 2), np.uint8)
    return np.array(["RGB".index(letter) for letter in cfa.value], np.uint8).reshape(2, 2)


def mosaic(rgb: NDArray[np.float32], cfa: Cfa) -> NDArray[np.float32]:
    """Sample full-colour planes (row, column, 3) at the colour filters: (row, column)."""
    sampled = np.empty(rgb.shape[:2], rgb.dtype)
    colours = pattern(cfa)
    for row in (0, 1):
        for column in (0, 1):
            sampled[row::2, column::2] = rgb[row::2, column::2, colours[row, column]]
    return sampled
