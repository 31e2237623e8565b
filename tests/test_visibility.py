"""Visible noise energy against CIELAB's published values and what is known of the eye."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.optimize import minimize_scalar

from dsis.errors import InputError
from dsis.model import structure
from dsis.visibility import (
    Eye,
    Viewing,
    contrast_sensitivity,
    pixels_per_degree,
    visible_noise_energy,
)

AT_3_HEIGHTS = Viewing(diagonal_inch=23.0, distance_heights=3.0, peak_cd_m2=100.0)
# Published for D65 and the primaries that BT.709 shares with sRGB, four decimals; the white's
# rounding moves them by a few 0.001.
LAB = {
    (1, 1, 1): (100.0, 0.0, 0.0),
    (0, 0, 0): (0.0, 0.0, 0.0),
    (1, 0, 0): (53.2408, 80.0925, 67.2032),
    (0, 1, 0): (87.7347, -86.1827, 83.1793),
    (0, 0, 1): (32.2970, 79.1875, -107.8602),
    (1, 1, 0): (97.1393, -21.5537, 94.4780),
}
LAB_ROUNDING = 0.02


def flat(*rgb: float, rows: int = 24, columns: int = 32) -> NDArray[np.float32]:
    return np.full((rows, columns, 3), rgb, np.float32)


def grating(cycles_per_px: float, light: NDArray[np.float64]) -> NDArray[np.float32]:
    """Grey of 18 % with a small wave along the columns, in light; whole half-waves in 128."""
    wave = np.cos(2.0 * math.pi * cycles_per_px * (np.arange(128) + 0.5))
    linear = 0.18 + 0.002 * wave[np.newaxis, :, np.newaxis] * light
    return np.repeat(linear ** (1.0 / 2.4), 8, axis=0).astype(np.float32)


ACHROMATIC = np.array([1.0, 1.0, 1.0])
ISOLUMINANT = np.array([0.7152, -0.2126, 0.0]) / 0.7152
GREY_18 = flat(*3 * (0.18 ** (1.0 / 2.4),), rows=8, columns=128)


@pytest.mark.parametrize("rgb", LAB)
def test_flat_fields_have_the_published_lab(rgb: tuple[int, int, int]) -> None:
    seen = Eye(40.0).seen(flat(*rgb))
    np.testing.assert_allclose(seen - np.array(LAB[rgb]), 0.0, atol=LAB_ROUNDING)


@pytest.mark.parametrize("first", LAB)
@pytest.mark.parametrize("second", LAB)
def test_flat_fields_differ_by_delta_e(
    first: tuple[int, int, int], second: tuple[int, int, int]
) -> None:
    eye = Eye(40.0)
    found = eye.difference(flat(*first), eye.seen(flat(*second)))
    lightness, a, b = np.subtract(LAB[first], LAB[second])
    assert math.sqrt(found.lightness) == pytest.approx(abs(lightness), abs=2 * LAB_ROUNDING)
    assert math.sqrt(found.colour) == pytest.approx(math.hypot(a, b), abs=4 * LAB_ROUNDING)
    energy = visible_noise_energy(flat(*first), flat(*second), AT_3_HEIGHTS)
    assert energy == pytest.approx(found.energy, abs=1e-3)  # a flat field has no distance


@given(value=st.floats(0.0, 1.0))
def test_greys_have_the_lightness_of_a_gamma_of_2_4(value: float) -> None:
    y = value**2.4
    lightness = 116.0 * y ** (1.0 / 3.0) - 16.0 if y > 216.0 / 24389.0 else y * 24389.0 / 27.0
    seen = Eye(40.0).seen(flat(value, value, value))
    np.testing.assert_allclose(seen[:, :, 0], lightness, atol=1e-3)  # float32 of 100
    np.testing.assert_allclose(seen[:, :, 1:], 0.0, atol=1e-3)


def test_luminance_sensitivity_peaks_at_4_cycles_per_degree() -> None:
    peak = minimize_scalar(
        lambda f: -float(contrast_sensitivity(np.array(f))[0]), bounds=(0.1, 60.0)
    )
    assert peak.x == pytest.approx(4.0, abs=1e-3)
    assert -peak.fun == pytest.approx(1.0, abs=1e-6)


def test_sensitivities_have_the_published_shape() -> None:
    f = np.arange(0.0, 61.0)
    luminance, red_green, blue_yellow = contrast_sensitivity(f)
    # Sensitivities 75 f^0.8 exp(-0.2 f) by hand: 61.4 at 1, 102.1 at 4, 28.1 at 16.
    np.testing.assert_allclose(
        luminance[[1, 4, 16]], np.array([61.4, 102.1, 28.1]) / 102.1, atol=1e-3
    )
    assert red_green[0] == blue_yellow[0] == 1.0
    assert (np.diff(red_green) < 0.0).all()
    assert (np.diff(blue_yellow) < 0.0).all()
    # Chromatic acuity is some 12 cycles per degree, luminance acuity three times that (Mullen).
    assert luminance[12] > red_green[12] > blue_yellow[12]
    assert red_green[30] < 0.01 < luminance[30]


def test_pixels_per_degree_of_full_hd_at_3_heights() -> None:
    # One degree at 3240 pixels' distance: 2 x 3240 tan(0.5 deg).
    assert pixels_per_degree(AT_3_HEIGHTS, 1080) == pytest.approx(56.55, abs=5e-3)


@pytest.mark.parametrize("light", [ACHROMATIC, ISOLUMINANT])
def test_twice_the_distance_is_half_the_period(light: NDArray[np.float64]) -> None:
    near = Eye(20.0).difference(grating(1 / 8, light), Eye(20.0).seen(GREY_18))
    far = Eye(40.0).difference(grating(1 / 16, light), Eye(40.0).seen(GREY_18))
    # Equal but for the curvature of L*, a*, b*, which the waves sample at other phases, and for
    # float32: a* is 500 times a difference of numbers below 1, and processors round differently.
    rounding = 2 * 500 * 2.0**-24 / math.sqrt(far.energy)
    assert near.energy == pytest.approx(far.energy, rel=1e-4 + rounding)
    assert Eye(40.0).difference(grating(1 / 8, light), Eye(40.0).seen(GREY_18)).energy < far.energy


def test_finer_than_60_cycles_per_degree_is_invisible() -> None:
    eye = Eye(256.0)
    seen = eye.seen(GREY_18)
    coarse = eye.difference(grating(4 / 256, ACHROMATIC), seen)
    fine = eye.difference(grating(64 / 256, ACHROMATIC), seen)
    assert coarse.energy > 0.01
    # Sensitivity there is 1e-4 of the peak; the rest is the rounding of L* near 50 in float32.
    assert fine.energy < 1e-7 * coarse.energy + (50.0 * 2.0**-23) ** 2 * 10


@pytest.mark.parametrize("cycles_per_degree", [1.0, 4.0, 8.0, 16.0, 24.0])
def test_a_grating_is_seen_by_the_sensitivity(cycles_per_degree: float) -> None:
    eye = Eye(64.0)
    cycles_per_px = cycles_per_degree / 64.0
    found = eye.difference(grating(cycles_per_px, ACHROMATIC), eye.seen(GREY_18))
    slope = 116.0 / 3.0 * 0.18 ** (-2.0 / 3.0)
    gain = (
        1.0
        if cycles_per_degree < 4.0
        else float(contrast_sensitivity(np.array(cycles_per_degree))[0])
    )
    predicted = 0.5 * (0.002 * slope * gain) ** 2
    # The opponent channels are not orthogonal: of white's Y, 1.035 passes the luminance filter and
    # -0.040 + 0.005 the chrominance filters, so that the amplitude is off by 3.6 % at most.
    assert found.lightness == pytest.approx(predicted, rel=1.036**2 - 1.0)


def test_identical_frames_differ_by_nothing() -> None:
    frame = np.random.default_rng(3).random((30, 41, 3), dtype=np.float32)
    assert visible_noise_energy(frame, frame.copy(), AT_3_HEIGHTS) == 0.0


def test_energy_grows_with_the_variance_of_small_noise() -> None:
    noise = np.random.default_rng(4).normal(0.0, 0.25 / 255, (540, 64, 3)).astype(np.float32)
    reference = flat(0.5, 0.5, 0.5, rows=540, columns=64)
    once, twice, four_times = (
        visible_noise_energy(reference + np.float32(k) * noise, reference, AT_3_HEIGHTS)
        for k in (1, 2, 4)
    )
    assert twice / once == pytest.approx(4.0, rel=1e-3)
    assert four_times / once == pytest.approx(16.0, rel=1e-3)


def test_correlated_noise_is_seen_better_than_white_noise_of_equal_psnr() -> None:
    white = np.random.default_rng(5).normal(0.0, 4.0 / 255, (1080, 96, 3))
    correlated = gaussian_filter(white, (1.0, 1.0, 0.0), mode="wrap")
    correlated *= white.std() / correlated.std()
    reference = flat(0.5, 0.5, 0.5, rows=1080, columns=96)
    seen_white, seen_correlated = (
        visible_noise_energy(reference + noise.astype(np.float32), reference, AT_3_HEIGHTS)
        for noise in (white, correlated)
    )
    assert seen_correlated > 2.0 * seen_white


def test_energy_is_split_into_lightness_and_colour() -> None:
    eye = Eye(64.0)
    seen = eye.seen(GREY_18)
    grey_noise = eye.difference(grating(1 / 64, ACHROMATIC), seen)
    coloured_noise = eye.difference(grating(1 / 64, ISOLUMINANT), seen)
    assert grey_noise.colour < 0.02 * grey_noise.energy
    assert coloured_noise.lightness < 0.02 * coloured_noise.energy
    assert grey_noise.energy == grey_noise.lightness + grey_noise.colour


def test_edges_do_not_leak_to_the_other_side() -> None:
    reference = flat(0.5, 0.5, 0.5, rows=16, columns=200)
    test = reference.copy()
    test[:, :4] = 1.0
    eye = Eye(20.0)
    changed = np.abs(eye.seen(test) - eye.seen(reference)).max(axis=(0, 2))
    assert changed[0] > 10.0
    assert changed[-20:].max() < 1e-3 * changed[0]


def test_a_seen_reference_serves_many_frames() -> None:
    rng = np.random.default_rng(6)
    reference = rng.random((45, 80, 3), dtype=np.float32)
    tests = [
        np.clip(reference + 0.02 * rng.standard_normal(reference.shape, np.float32), 0, 1)
        for _ in range(3)
    ]
    eye = Eye(pixels_per_degree(AT_3_HEIGHTS, 45))
    seen = eye.seen(reference)
    for test in tests:
        alone = visible_noise_energy(test, reference, AT_3_HEIGHTS)
        assert eye.difference(test, seen).energy == alone


def test_wrong_viewing_conditions_are_refused() -> None:
    wrong = {"diagonal_inch": 0, "distance_heights": -3.0, "peak": 100}
    with pytest.raises(InputError) as refused:
        structure(Viewing, wrong, "test.toml", "viewing")
    assert {fault.key for fault in refused.value.faults} == {
        "viewing.diagonal_inch",
        "viewing.distance_heights",
        "viewing.peak_cd_m2",
        "viewing.peak",
    }
