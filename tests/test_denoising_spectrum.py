"""A noise spectrum says what the noise is, and denoisers gain from knowing it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.denoising import NoiseSpectrum, bls_gsm, bm3d
from dsis.imagefile import read

DENOISERS = pytest.mark.parametrize("denoiser", [bm3d, bls_gsm])
SIGMA = 20 / 255

TRIANGLE = np.array([0.25, 0.5, 0.25])
# White noise averaged over 2 x 2: near what bilinear demosaicking leaves.
SMOOTH = np.outer([0.5, 1, 0.5], [0.5, 1, 0.5])


def pink(size=129):
    """Return the autocovariance of noise of power 1/f, variance 1."""
    f = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.fftfreq(size))
    power = 1 / np.maximum(f, 1 / size)
    return np.fft.fftshift(np.fft.ifft2(power / power.mean()).real)


def field(kernel, shape, seed):
    power = NoiseSpectrum.of_autocovariance(kernel).power(0, *shape)
    white = np.random.default_rng(seed).normal(size=shape)
    return np.fft.ifft2(np.fft.fft2(white) * np.sqrt(power)).real


def psnr(image, reference):
    return -10 * np.log10(np.mean((image.astype(np.float64) - reference) ** 2))


@pytest.fixture(scope="module")
def house(shared_data):
    samples = read(shared_data / "set12" / "02.png")
    grey = samples[..., 0] if samples.ndim == 3 else samples
    return np.ascontiguousarray(grey[64:192, 64:192])


@DENOISERS
@pytest.mark.parametrize(("kernel", "gain_db"), [(SMOOTH, 2.0), (pink(), 0.5)])
def test_knowing_the_correlation_gains(house, denoiser, kernel, gain_db):
    given = (house + SIGMA * field(kernel, house.shape, 0)).astype(np.float32)
    told = psnr(denoiser(given, NoiseSpectrum.of_autocovariance(kernel * SIGMA**2)), house)
    assert told > psnr(denoiser(given, SIGMA), house) + gain_db
    assert told > psnr(given, house) + 4


@DENOISERS
def test_knowing_the_correlation_gains_in_color(house, denoiser):
    house = house[:80, :80]
    clean = np.stack([house, 0.8 * house, 0.6 * house + 0.1], -1)
    common, rest = 0.8, 0.6  # of each channel's noise: shared by all, its own
    own = np.stack([field(SMOOTH, house.shape, s) for s in range(3)], -1)
    noise = common * field(SMOOTH, house.shape, 3)[..., None] + rest * own
    given = (clean + SIGMA * noise).astype(np.float32)
    between = common**2 * np.ones((3, 3)) + rest**2 * np.eye(3)
    full = SIGMA**2 * SMOOTH[..., None, None] * between
    told = psnr(denoiser(given, NoiseSpectrum.of_autocovariance(full)), clean)
    diagonal = NoiseSpectrum.of_autocovariance(SIGMA**2 * np.repeat(SMOOTH[..., None], 3, -1))
    apart = psnr(denoiser(given, diagonal), clean)
    assert told > apart + 0.5  # channels that are known to share noise
    assert apart > psnr(denoiser(given, SIGMA), clean) + 0.5


@given(a=st.floats(-0.99, 0.99), rows=st.integers(3, 12), columns=st.integers(3, 13))
def test_power_of_a_moving_average(a, rows, columns):
    # y_t = e_t + a e_(t-1) along the columns: R(0) = 1 + a^2, R(1) = a, P = |1 + a e^(-i w)|^2.
    spectrum = NoiseSpectrum.of_autocovariance([[a, 1 + a**2, a]])
    w = 2 * np.pi * np.fft.fftfreq(columns)
    wanted = np.broadcast_to(np.abs(1 + a * np.exp(-1j * w)) ** 2, (rows, columns))
    np.testing.assert_allclose(spectrum.power(0, rows, columns), wanted, atol=1e-12)


@given(rows=st.integers(1, 9), columns=st.integers(1, 9), seed=st.integers(0, 99))
def test_a_power_spectrum_comes_back(rows, columns, seed):
    noise = np.random.default_rng(seed).normal(size=(rows, columns))
    power = np.abs(np.fft.fft2(noise)) ** 2 / noise.size
    spectrum = NoiseSpectrum.of_power(power)
    np.testing.assert_allclose(spectrum.at_lag_zero, np.mean(noise**2), rtol=1e-9)
    np.testing.assert_allclose(spectrum.power(0, rows, columns), power, rtol=1e-9, atol=1e-9)


def test_power_of_each_channel():
    power = np.random.default_rng(0).random((7, 9, 3))
    power = (power + np.roll(power[::-1, ::-1], (1, 1), (0, 1))) / 2
    spectrum = NoiseSpectrum.of_power(power)
    for channel in range(3):
        np.testing.assert_allclose(spectrum.power(channel, 7, 9), power[..., channel], atol=1e-12)


def test_the_covariance_between_mixed_channels_is_that_of_samples():
    rng = np.random.default_rng(1)
    e = rng.normal(size=(3, 200_000))
    noise = np.stack([e[0, 1:], e[1, 1:] + 0.7 * e[0, :-1], e[2, 1:]])  # green follows red by 1
    covariance = np.zeros((1, 3, 3, 3))
    covariance[0, 1] = np.diag([1, 1.49, 1])
    covariance[0, 2, 1, 0] = covariance[0, 0, 0, 1] = 0.7
    matrix = np.array([[1, 1, 1], [1, 0, -1], [1, -2, 1]]) / 2
    mixed = NoiseSpectrum.of_autocovariance(covariance).mixed(matrix)
    samples = matrix @ noise
    for lag in range(2):
        later, now = samples[:, lag:], samples[:, : samples.shape[1] - lag]
        found = later @ now.T / now.shape[1]
        # Products of unit normals: their mean is known to 1/sqrt(n); entries here are below 4.
        assert np.abs(found - mixed.covariance[0, 1 + lag]).max() < 5 * 4 / np.sqrt(now.shape[1])


def test_lags_are_cut_and_filled():
    spectrum = NoiseSpectrum.of_autocovariance(np.outer(TRIANGLE, TRIANGLE))
    assert spectrum.autocovariance(0, 0).tolist() == [[0.25]]
    wide = spectrum.autocovariance(0, 3)
    assert wide.shape == (7, 7)
    assert wide.sum() == pytest.approx(1)
    assert wide[3, 2] == wide[2, 3] == 0.125


def test_a_correlation_has_unit_variance():
    scaled = SMOOTH[..., None] * np.array([4.0, 9.0, 1.0])
    found = NoiseSpectrum.of_autocovariance(scaled).normalised()
    np.testing.assert_allclose(found.autocovariance(1, 1), SMOOTH)
    with pytest.raises(ValueError, match="without noise"):
        NoiseSpectrum.white((1.0, 0.0, 1.0)).normalised()


@pytest.mark.parametrize(
    ("kernel", "says"),
    [
        (np.ones((2, 3)), "odd"),
        (np.ones((3, 3, 2)), "1 or 3 channels"),
        (np.ones(3), "odd"),
        (-np.ones((1, 1)), "negative"),
        (np.full((1, 1), np.inf), "finite"),
        (np.array([[0.0, 1.0, 0.5]]), "transpose"),
    ],
)
def test_no_covariance_of_anything_is_refused(kernel, says):
    with pytest.raises(ValueError, match=says):
        NoiseSpectrum.of_autocovariance(kernel)


def test_a_negative_power_is_refused():
    with pytest.raises(ValueError, match="at least 0"):
        NoiseSpectrum.of_power(-np.ones((3, 3)))
