"""Promise: the noise is the paper's: variance m x + t by read-out segment, scaled by g^2."""

import numpy as np
import pytest

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.noise import Segments, awgn, camera_noise

Z_MAX = 5.0
SWITCH_DN = 1000.0
LOW, HIGH = (2.18, 22.9), (8.7, 383.0)
SIDE = 1024  # 1024^2 samples a level: more than 10^6
LEVELS = (0.0, 30.0, 200.0, 600.0, 990.0, 999.0, 1000.0, 1010.0, 1500.0, 6000.0, 20000.0, 60000.0)

CAMERA = Camera(
    name="two segments",
    cfa=Cfa.RGGB,
    black_level=256.0,
    white_level=65535.0,
    bit_depth=16,
    diffuse_white_dn=9000.0,
    white_balance=(2.0, 1.0, 1.6),
    noise=BaseNoise(
        segment=(
            Segment(upper_dn=SWITCH_DN, slope=LOW[0], intercept=LOW[1]),
            Segment(slope=HIGH[0], intercept=HIGH[1]),
        )
    ),
)
SEGMENTS = Segments.of([(-np.inf, *LOW), (SWITCH_DN, *HIGH)])
GRID = PixelGrid(SIDE, SIDE, Cfa.RGGB)


def variance_dn2(level: float) -> float:
    """Variance as the paper states it, written out once more."""
    m, t = HIGH if level >= SWITCH_DN else LOW
    return m * level + t


def assert_gaussian(noise: np.ndarray, variance: float) -> None:
    n = noise.size
    assert abs(noise.mean()) < Z_MAX * np.sqrt(variance / n)
    assert abs(noise.var() - variance) < Z_MAX * variance * np.sqrt(2 / n)


@pytest.mark.parametrize("level", LEVELS)
def test_mean_and_variance_on_both_sides_of_the_switch(level: float) -> None:
    clean = np.full(GRID.shape, level, np.float32)
    noisy = camera_noise(clean, SEGMENTS, Draw(1), GRID, frame=3)
    assert_gaussian(noisy.astype(np.float64) - level, variance_dn2(level))


@pytest.mark.parametrize("level", [200.0, 999.0, 1000.0, 20000.0])
def test_a_camera_adds_rounding_and_nothing_else(level: float) -> None:
    clean = np.full(GRID.shape, level, np.float32)
    noisy = CAMERA.expose(clean, Draw(1), Draw(1), 3, GRID)
    np.testing.assert_array_equal(noisy, np.rint(noisy))
    # Sheppard: rounding adds 1/12 where the noise is far wider than a code.
    assert_gaussian(noisy.astype(np.float64) - level, variance_dn2(level) + 1 / 12)


def test_codes_are_clipped_and_negative_values_kept() -> None:
    dark = CAMERA.expose(np.zeros(GRID.shape, np.float32), Draw(1), Draw(1), 0, GRID)
    assert dark.min() < -10
    top = CAMERA.white_level - CAMERA.black_level
    bright = CAMERA.expose(np.full(GRID.shape, top, np.float32), Draw(1), Draw(1), 0, GRID)
    assert bright.max() == top


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_any_number_of_segments(count: int) -> None:
    table = [(-np.inf if k == 0 else 100.0 * k, 1.0 + k, 10.0 * k) for k in range(count)]
    for k in range(count):
        clean = np.full((512, 512), 100.0 * k + 50, np.float32)
        grid = PixelGrid(512, 512, Cfa.MONO)
        noise = camera_noise(clean, Segments.of(table), Draw(k), grid, 0) - clean
        assert_gaussian(noise.astype(np.float64), (1.0 + k) * (100 * k + 50) + 10 * k)


def test_a_negative_intercept_lowers_the_variance() -> None:
    clean = np.full(GRID.shape, 500.0, np.float32)
    noise = camera_noise(clean, Segments.of([(-np.inf, 2.0, -300.0)]), Draw(4), GRID, 0) - clean
    assert_gaussian(noise.astype(np.float64), 700.0)


def test_white_balance_scales_the_noise_by_its_gain() -> None:
    """Equation (2): n_wb = g_c n_c, with x before the gain."""
    grid = PixelGrid(700, 700)
    clean = np.full(grid.shape, 2000.0, np.float32)
    raw = camera_noise(clean, SEGMENTS, Draw(5), grid, 0)
    light = CAMERA.scene_light(raw).astype(np.float64) * 9000.0
    for channel, gain in enumerate(CAMERA.white_balance):
        noise = light[:, :, channel] - gain * 2000.0
        assert_gaussian(noise, gain**2 * variance_dn2(2000.0))


def test_awgn_is_white_with_the_given_standard_deviation() -> None:
    grid = PixelGrid(700, 700)
    image = np.full(grid.shape, 100.0, np.float32)
    noise = awgn(image, 20.0, Draw(6), grid, 0).astype(np.float64) - 100.0
    assert_gaussian(noise, 400.0)


def test_a_crop_of_a_noisy_frame_is_the_noisy_crop() -> None:
    rng = np.random.default_rng(0)
    clean = rng.uniform(0, 5000, (120, 90)).astype(np.float32)
    whole = CAMERA.expose(clean, Draw(1), Draw(2), 7, PixelGrid(120, 90, Cfa.RGGB))
    crop = CAMERA.expose(
        clean[13:60, 21:80], Draw(1), Draw(2), 7, PixelGrid(47, 59, Cfa.RGGB, 13, 21)
    )
    np.testing.assert_array_equal(crop, whole[13:60, 21:80])


@pytest.mark.parametrize("threads", [1, 2])
def test_every_row_of_a_large_frame_has_noise_of_its_own(threads: int) -> None:
    """Frames are worked on in runs of rows: each gets the deviates of its own rows."""
    grid = PixelGrid(300, 500)  # some runs of each thread's block
    image = np.full(grid.shape, 800.0, np.float32)
    draw = Draw(8)
    white = awgn(image, 2.0, draw, grid, 5)
    whole = draw.normal("awgn", grid, 5)
    np.testing.assert_allclose((white - image) / 2, whole, atol=1e-4)
    noisy = camera_noise(image, SEGMENTS, draw, grid, 5, threads)
    m, t = LOW
    shot, read = draw.normal("shot_noise", grid, 5), draw.normal("read_noise", grid, 5)
    wanted = image + np.sqrt(m * 800) * shot + np.sqrt(t) * read
    np.testing.assert_allclose(noisy, wanted, atol=1e-3)  # float32 of some 1000 DN


def test_the_memory_layout_of_the_signal_does_not_matter() -> None:
    """A transposed or strided signal is the same signal."""
    signal = np.random.default_rng(0).uniform(0, 5000, (140, 96)).astype(np.float32)
    grid = PixelGrid(96, 70, Cfa.RGGB)
    for view in (signal[::2].T, np.asfortranarray(signal[::2].T)):
        same = np.ascontiguousarray(view)
        assert not view.flags.c_contiguous
        np.testing.assert_array_equal(
            CAMERA.expose(view, Draw(1), Draw(2), 0, grid),
            CAMERA.expose(same, Draw(1), Draw(2), 0, grid),
        )


def test_scene_to_raw_and_back() -> None:
    """raw_c = clip(black + k (M rgb)_c / g_c, 0, white), and its inverse where nothing clips."""
    matrix = ((0.8, 0.15, 0.05), (0.1, 0.8, 0.1), (0.02, 0.28, 0.7))
    camera = CAMERA.model_copy(update={"camera_from_scene": matrix})
    scene = np.array([[[0.5, 0.25, 0.125], [-1.0, 0.0, 100.0]]], np.float32)
    raw = camera.clean_raw(scene)
    expected = 9000.0 * (np.array(matrix) @ [0.5, 0.25, 0.125]) / [2.0, 1.0, 1.6]
    np.testing.assert_allclose(raw[0, 0], expected, rtol=1e-6)
    np.testing.assert_allclose(camera.scene_light(raw)[0, 0], [0.5, 0.25, 0.125], rtol=1e-5)
    assert raw[0, 1].min() >= -256.0
    assert raw[0, 1].max() == 65535.0 - 256.0
