"""Promise: the converter's pass over an image gives what its steps give one after the other."""

import numpy as np
import pytest

from dsis.conversion import codes_of, converted

_RANDOM = np.random.default_rng(0)
IMAGE = _RANDOM.normal(50, 40, (7, 9, 3)).astype(np.float32)


@pytest.mark.parametrize("black", [0.0, 64.0, 63.5, 0.1])
def test_codes_are_rounded_and_clipped_above_black(black: float) -> None:
    image = IMAGE.copy()
    image[0, :4, 0] = np.nan, np.inf, -np.inf, -black
    b = np.float32(black)
    expected = np.clip(np.rint(image + b), np.float32(0), np.float32(100)) - b
    np.testing.assert_array_equal(converted(image, black, 100.0), expected)
    np.testing.assert_array_equal(codes_of(expected, black), np.rint(expected + b))


def test_every_second_pixel_is_converted_like_all() -> None:
    expected = converted(IMAGE, 3.0, 100.0)[::2, ::2]
    np.testing.assert_array_equal(converted(IMAGE[::2, ::2], 3.0, 100.0), expected)
