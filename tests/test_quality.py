"""Promise: codes and PSNR of a frame are what plain arithmetic gives, whatever the frame holds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dsis.imagefile import codes
from dsis.stimuli.quality import delivered, psnr_db, psnr_float_db

FLOAT32 = st.floats(width=32, allow_nan=True, allow_infinity=True)


@given(st.lists(FLOAT32 | st.floats(0, 1, width=32), min_size=3, max_size=60))
def test_codes_are_rounded_half_up_and_clipped(values: list[float]) -> None:
    display = np.array(values[: len(values) // 3 * 3], np.float32).reshape(1, -1, 3)
    for top, kind in ((255, np.uint8), (65535, np.uint16)):
        held = np.clip(np.nan_to_num(display, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
        expected = np.floor(held * np.float32(top) + np.float32(0.5)).astype(kind)
        found = codes(display, top)
        assert found.dtype == kind
        np.testing.assert_array_equal(found, expected)


def test_every_code_comes_back() -> None:
    for top in (255, 65535):
        whole = np.arange(top + 1)
        np.testing.assert_array_equal(codes((whole / top).astype(np.float32), top), whole)


def test_the_memory_layout_of_a_frame_does_not_matter() -> None:
    frame = np.random.default_rng(0).random((24, 30, 3), np.float32)
    for view in (frame[::2, ::3], np.asfortranarray(frame), frame[::-1]):
        same = np.ascontiguousarray(view)
        np.testing.assert_array_equal(delivered(view), delivered(same))
        assert psnr_float_db(view, same * np.float32(0.5)) == psnr_float_db(
            same, same * np.float32(0.5)
        )


@given(seed=st.integers(0, 99), spread=st.sampled_from([0.0, 1e-3, 0.1, 3.0]))
def test_psnr_is_the_textbooks(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    reference = rng.random((17, 23, 3), np.float32)
    test = (reference + spread * rng.standard_normal(reference.shape)).astype(np.float32)
    a, b = delivered(test).astype(float), delivered(reference).astype(float)
    with np.errstate(divide="ignore"):
        expected = 10 * np.log10(255**2 / np.mean((a - b) ** 2))
        as_computed = -10 * np.log10(np.mean((test - reference).astype(float) ** 2))
    assert psnr_db(delivered(test), delivered(reference)) == pytest.approx(expected, rel=1e-12)
    assert psnr_float_db(test, reference) == pytest.approx(as_computed, rel=1e-9)


def test_the_largest_difference_does_not_overflow() -> None:
    black, white = (np.full((1080, 1920, 3), code, np.uint8) for code in (0, 255))
    assert psnr_db(black, white) == 0.0
