"""Promise: lines are added and scaled in one pass, to the same bytes as term by term."""

import numpy as np
import pytest

from dsis.lines import gained, lit, moved, settled, shifted

RNG = np.random.default_rng(1)


def _some(*shape: int) -> np.ndarray:
    return RNG.normal(100, 30, shape).astype(np.float32)


@pytest.mark.parametrize(
    ("size", "lines"),
    [
        ((7, 5), (7, 1)),
        ((7, 5), (1, 5)),
        ((7, 1), (1, 1)),
        ((7, 1), (7, 1)),
        ((1, 5), (1, 1)),
        ((1, 5), (1, 5)),
        ((1, 1), (1, 1)),
    ],
)
def test_lines_are_added_and_scaled_as_numpy_does(
    size: tuple[int, int], lines: tuple[int, int]
) -> None:
    image, gains, offsets = _some(*size), _some(*lines), _some(*lines)
    np.testing.assert_array_equal(moved(image, offsets), image + offsets)
    np.testing.assert_array_equal(settled(image, gains, offsets), image * gains + offsets)


def test_light_is_a_sum_of_two_lines() -> None:
    image, down, across = _some(7, 5), _some(7, 1), _some(1, 5)
    np.testing.assert_array_equal(lit(image, down, across), image * (down + across))


def test_full_planes_share_their_lines() -> None:
    planes, down, across = _some(7, 5, 3), _some(7, 1, 1), _some(1, 5, 1)
    np.testing.assert_array_equal(moved(planes, down[..., 0]), planes + down)
    np.testing.assert_array_equal(settled(planes, across, across), planes * across + across)
    np.testing.assert_array_equal(lit(planes, down, across), planes * (down + across))


@pytest.mark.parametrize("size", [(7, 5), (7, 5, 3)])
def test_patterns_are_added_and_scaled_as_numpy_does(size: tuple[int, ...]) -> None:
    image, pattern, by = _some(*size), _some(*size), np.float32(0.37)
    pattern.flags.writeable = False
    np.testing.assert_array_equal(shifted(image, pattern, by), image + by * pattern)
    np.testing.assert_array_equal(gained(image, pattern, by), image * (by * pattern + 1))
    part = pattern[::2, 1:4]
    np.testing.assert_array_equal(shifted(part, part, by), part + by * part)
    with pytest.raises(ValueError, match="must be as the image"):
        shifted(image, pattern[1:], by)
