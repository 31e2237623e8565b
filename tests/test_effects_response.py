"""Promise: effects bend, clip and round the response to light as their closed forms say.

Measured without dsis's own measures; tolerances are five standard errors.
"""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import stats

from dsis.camera import camera_values, read_camera, write_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects.adc_dnl import code_edges
from dsis.grid import PixelGrid
from exposing import BLACK_DN, SIDE, WHITE_DN, Z_MAX, apply, camera, effect, flat, recorded, white


def test_saturation_is_a_censored_law() -> None:
    well, level, slope = 3000.0, 2950.0, 1.0
    stack = recorded(camera(effect("saturation", full_well_dn=well), slope=slope), level, 50)
    assert stack.max() == well
    sigma = np.sqrt(slope * level)
    z = (well - level) / sigma
    law = stats.truncnorm(-np.inf, z, level, sigma)
    p = stats.norm.cdf(z)
    mean = p * law.mean() + (1 - p) * well
    variance = p * (law.var() + law.mean() ** 2) + (1 - p) * well**2 - mean**2
    n = stack.size
    assert abs(stack.mean() - mean) < Z_MAX * np.sqrt(variance / n)
    # Rounding adds up to 1/12 where codes are not at the well.
    assert abs(stack.var() - variance) < Z_MAX * variance * np.sqrt(2 / n) + 1 / 12


@pytest.mark.parametrize("beyond", [200.0, 5000.0])
def test_a_full_camera_has_read_noise_alone(beyond: float) -> None:
    """At 200 DN above the full well shot noise (sd 6.5) never comes below it."""
    full, read = 4000.0, 25.0
    noisy = camera(slope=0.01, intercept=read)
    stack = recorded(noisy.model_copy(update={"saturation_dn": full}), full + beyond, 50)
    n, variance = stack.size, read + 1 / 12
    assert abs(stack.mean() - full) < Z_MAX * np.sqrt(variance / n)
    assert abs(stack.var() / variance - 1) < Z_MAX * np.sqrt(2 / n)


def test_a_camera_fills_as_the_effect_saturation_does() -> None:
    noisy = camera(slope=1.0, intercept=4.0)
    by_effect = camera(effect("saturation", full_well_dn=3000.0), slope=1.0, intercept=4.0)
    by_camera = noisy.model_copy(update={"saturation_dn": 3000.0})
    np.testing.assert_array_equal(recorded(by_camera, 2980.0, 3), recorded(by_effect, 2980.0, 3))
    # Far above what occurs it changes no bit.
    unfilled = noisy.model_copy(update={"saturation_dn": 9000.0})
    np.testing.assert_array_equal(recorded(unfilled, 2980.0, 3), recorded(noisy, 2980.0, 3))


@given(percent=st.floats(-15, 15), exponent=st.just(1.0) | st.floats(-0.9, 30))
def test_nonlinearity_is_the_largest_deviation_from_the_line(
    percent: float, exponent: float
) -> None:
    full_scale = WHITE_DN - BLACK_DN
    signal = np.linspace(0, full_scale, 2001)[np.newaxis]
    try:
        bent = effect("nonlinearity", percent_full_scale=percent, exponent=exponent)
    except ValidationError:
        # What is refused falls somewhere, by powers and differences.
        u = np.append(np.geomspace(1e-6, 1.1e-4, 200), np.linspace(1.2e-4, 1 / 0.85, 20001))
        k = exponent if abs(exponent) > 1e-6 else 1e-6
        bend = (u - u ** (1 + k)) / k
        top = np.abs(bend[u <= 1]).max()
        assert np.diff(0.85 * u + percent / 100 * bend / top).min() < 1e-9
        return
    made = apply(bent, signal)[0]
    assert np.diff(made).min() >= -1e-3  # float32
    at_85 = np.interp(0.85 * full_scale, signal[0], made)
    deviation = (made - signal[0] * at_85 / (0.85 * full_scale))[:1701]  # up to there
    assert np.abs(deviation).max() == pytest.approx(
        abs(percent) / 100 * full_scale, rel=1e-3, abs=0.01
    )
    assert made[0] == 0


@pytest.mark.parametrize("step", [2.0, 4.0, 16.0])
def test_quantisation_leaves_multiples_of_the_step(step: float) -> None:
    image = white(50.0, mean=800)
    codes = apply(effect("quantisation", step_dn=step), image) + BLACK_DN
    assert (codes % step == 0).all()
    assert np.abs(codes - BLACK_DN - image).max() <= step / 2 + 1e-3
    error = (codes - BLACK_DN - image).var() * 12 / step**2
    assert abs(error - 1) < Z_MAX * np.sqrt(0.8) / SIDE  # uniform law: kurtosis 1.8


@pytest.mark.parametrize("step", [3.0, 4.0, 7.0, 1000.0])
def test_quantisation_leaves_multiples_where_codes_are_clipped(step: float) -> None:
    one = camera(effect("quantisation", step_dn=step), intercept=400.0)
    for level in (-BLACK_DN, WHITE_DN - BLACK_DN):
        codes = recorded(one, level, 2) + BLACK_DN
        assert (codes % step == 0).all()
        assert codes.min() >= 0
        assert codes.max() <= WHITE_DN


@given(step=st.integers(1, 300), part=st.floats(0, 1, exclude_max=True), seed=st.integers(0, 99))
def test_codes_are_whole_steps_from_the_phase(step: int, part: float, seed: int) -> None:
    """Also where they are clipped; the nearest such code is taken."""
    phase = int(part * step)
    one = camera(effect("quantisation", step_dn=float(step), phase_dn=phase), cfa=Cfa.RGGB)
    ends = (-BLACK_DN - 50, WHITE_DN - BLACK_DN + 50)
    clean = np.random.default_rng(seed).uniform(*ends, (8, 8)).astype(np.float32)
    grid = PixelGrid(8, 8, Cfa.RGGB)
    codes = one.expose(clean, Draw(5), Draw(6), 0, grid).astype(np.float64) + BLACK_DN
    assert (codes % step == phase).all()
    assert codes.min() >= phase
    assert codes.max() <= WHITE_DN
    lowest, highest = phase, WHITE_DN - (WHITE_DN - phase) % step
    nearest = np.clip(clean + BLACK_DN, lowest, highest)
    assert np.abs(codes - nearest).max() <= step / 2 + 2e-3  # single precision of 16 383 DN


@pytest.mark.parametrize("step", [1.0, 2.5, 6.0, 100.0])
def test_without_a_phase_codes_are_as_they_always_were(step: float) -> None:
    """Bit for bit: by the formula without a phase, then whole and clipped."""
    image = white(4000.0, mean=6000).astype(np.float32)
    one = camera(effect("quantisation", step_dn=step))
    codes = one.expose(image, Draw(5), Draw(6), 0, PixelGrid(SIDE, SIDE, Cfa.MONO))
    black, width = np.float32(BLACK_DN), np.float32(step)
    coarse = width * np.minimum(np.rint((image + black) / width), np.float32(WHITE_DN // step))
    whole = np.clip(np.rint(coarse - black + black), np.float32(0), np.float32(WHITE_DN)) - black
    np.testing.assert_array_equal(codes, whole)
    assert camera_values(one)["effect"] == [{"kind": "quantisation", "step_dn": step}]


def test_a_phase_is_below_the_step_and_the_white_level(tmp_path: Path) -> None:
    one = camera(effect("quantisation", step_dn=6.0, phase_dn=5))
    write_camera(one, tmp_path / "camera.toml")
    assert "phase_dn = 5" in (tmp_path / "camera.toml").read_text()
    assert read_camera(tmp_path / "camera.toml") == one
    with pytest.raises(ValueError, match="phase_dn is 6, must be below step_dn = 6"):
        effect("quantisation", step_dn=6.0, phase_dn=6)
    with pytest.raises(ValueError, match="phase_dn"):
        effect("quantisation", step_dn=6.0, phase_dn=-1)
    beyond = effect("quantisation", step_dn=20000.0, phase_dn=17000)
    with pytest.raises(ValueError, match="phase_dn is 17000, must be at most white_level = 16383"):
        camera(beyond)


@pytest.mark.parametrize("rms", [0.1, 0.5, 1.0])
def test_code_widths_have_the_rms_asked_for(rms: float) -> None:
    """A slow ramp through the converter, as IEEE 1241 tests it."""
    per_lsb = 64
    ramp = (np.arange(0, 4096 * per_lsb) / per_lsb - BLACK_DN)[np.newaxis]
    codes = apply(effect("adc_dnl", rms_lsb=rms), ramp)[0] + BLACK_DN
    assert np.diff(codes).min() >= 0
    widths = np.bincount(codes.astype(int), minlength=4096)[1:4000] / per_lsb
    kurtosis = stats.kurtosis(widths, fisher=False)
    assert abs(widths.mean() - 1) < 0.02
    assert abs(widths.std() / rms - 1) < Z_MAX * np.sqrt((kurtosis - 1) / (4 * 4000)) + 0.01
    # The mean of the integral non-linearity: a bridge over 64 codes, averaged over 64 of them.
    off = (codes - BLACK_DN - ramp[0]).mean()
    assert abs(off) < Z_MAX * rms * np.sqrt(64 / 12) / np.sqrt(64) + 1 / per_lsb
    edges = code_edges(Draw(4), int(WHITE_DN), rms)
    integral = edges - np.arange(edges.size) + 0.5
    assert np.abs(integral[::64]).max() < 1e-9
    assert np.abs(integral).max() < Z_MAX * rms * np.sqrt(64) / 2


@pytest.mark.parametrize(
    "regions", ["left_right", "top_bottom", "even_odd_columns", "even_odd_rows"]
)
def test_taps_differ_by_their_gain(regions: str) -> None:
    image = apply(effect("tap_mismatch", gain_percent=3.0, regions=regions), flat(1000, 8))
    first, second = {
        "left_right": (image[:, :4], image[:, 4:]),
        "top_bottom": (image[:4], image[4:]),
        "even_odd_columns": (image[:, ::2], image[:, 1::2]),
        "even_odd_rows": (image[::2], image[1::2]),
    }[regions]
    np.testing.assert_allclose(first, 985, rtol=1e-6)
    np.testing.assert_allclose(second, 1015, rtol=1e-6)


@pytest.mark.parametrize(("cfa", "gr", "gb"), [
    (Cfa.RGGB, (0, 1), (1, 0)), (Cfa.BGGR, (1, 0), (0, 1)),
    (Cfa.GRBG, (0, 0), (1, 1)), (Cfa.GBRG, (1, 1), (0, 0)),
])  # fmt: skip
def test_greens_differ_by_the_imbalance(cfa: Cfa, gr: tuple[int, int], gb: tuple[int, int]) -> None:
    one = effect("channel_imbalance", gain_percent=4.0)
    image = apply(one, flat(1000, 8), grid=PixelGrid(8, 8, cfa))
    expected = np.full((2, 2), 1000.0)
    expected[gr], expected[gb] = 1020.0, 980.0
    np.testing.assert_allclose(image, np.tile(expected, (4, 4)), rtol=1e-6)


def test_the_mean_steps_where_gains_disagree() -> None:
    one = camera(effect("dual_gain_mismatch", gain_error_percent=2.0), intercept=100, switch=1000.0)
    for level, gain in ((900.0, 1.0), (1100.0, 1.02)):
        stack = recorded(one, level, 20)
        assert abs(stack.mean() - gain * level) < Z_MAX * 10.2 / np.sqrt(stack.size)
        variance = 100 * gain**2 + 1 / 12
        assert abs(stack.var() / variance - 1) < Z_MAX * np.sqrt(2 / stack.size)


def test_the_mean_kinks_where_both_paths_read_the_same_at_the_switch() -> None:
    one = effect("dual_gain_mismatch", gain_error_percent=2.0, mean="kinks")
    for level in (900.0, 1100.0, 2000.0):
        stack = recorded(camera(one, intercept=100, switch=1000.0), level, 20)
        expected = level + 0.02 * max(level - 1000, 0)
        assert abs(stack.mean() - expected) < Z_MAX * 10.2 / np.sqrt(stack.size)
    assert one.model_dump()["mean"] == "kinks"
    assert "mean" not in effect("dual_gain_mismatch", gain_error_percent=2.0).model_dump()
