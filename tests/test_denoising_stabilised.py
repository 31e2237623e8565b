"""Signal-dependent noise: variance 1 after the transform, no bias after its inverse, and a gain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.denoising import NoiseSpectrum, VarianceStabiliser, bls_gsm, bm3d, stabilised
from dsis.imagefile import read

SAMPLES = 200_000
DUAL_GAIN = ([-np.inf, 1000.0], [2.18, 8.7], [22.9, 383.0])  # a camera of assumed numbers
SINGLE = ([-np.inf], [2.18], [22.9])


def stabiliser(segments, shot):
    return VarianceStabiliser(*(np.array(column) for column in segments), shot)


def drawn(segments, shot, signal, seed=0):
    """Return noisy observations of one clean signal."""
    lower, slope, intercept = segments
    i = int(np.searchsorted(lower[1:], signal, side="right"))
    m, t = slope[i], intercept[i]
    rng = np.random.default_rng(seed)
    read_noise = np.sqrt(t) * rng.normal(size=SAMPLES)
    if shot == "gaussian":
        return signal + np.sqrt(m * signal) * rng.normal(size=SAMPLES) + read_noise
    return m * rng.poisson(signal / m, SAMPLES) + read_noise


@pytest.mark.parametrize("shot", ["gaussian", "poisson"])
@pytest.mark.parametrize(
    ("segments", "signal"),
    [*((SINGLE, x) for x in (20, 50, 200, 900, 5000)), (DUAL_GAIN, 500), (DUAL_GAIN, 3000)],
)
def test_noise_has_variance_one_and_the_inverse_no_bias(segments, signal, shot):
    law = stabiliser(segments, shot)
    z = drawn(segments, shot, signal)
    f = law.forward(z)
    # What is left is of second order in 1/electrons: 2 % at ten. Sampling error comes on top.
    assert abs(f.var() - 1) < 0.02 * (20 / signal) ** 2 + 5 * np.sqrt(2 / SAMPLES)
    back = law.inverse(f.mean(keepdims=True), 6000.0)[0]
    assert abs(back - signal) < 5 * z.std() / np.sqrt(SAMPLES)


@pytest.mark.parametrize("signal", [900.0, 1100.0])
def test_the_inverse_has_no_bias_beside_a_switch(signal):
    law = stabiliser(DUAL_GAIN, "gaussian")
    z = drawn(DUAL_GAIN, "gaussian", signal)
    back = law.inverse(law.forward(z).mean(keepdims=True), 6000.0)[0]
    assert abs(back - signal) < 5 * z.std() / np.sqrt(SAMPLES)


@given(m=st.floats(0.01, 100), t=st.floats(0, 1000), x=st.floats(0, 1e4))
def test_one_segment_is_the_generalised_anscombe_transform(m, t, x):
    law = stabiliser(([-np.inf], [m], [t]), "poisson")
    f = law.forward(np.array([x, 0.0]))
    anscombe = 2 / m * np.sqrt(m * np.array([x, 0.0]) + 3 / 8 * m**2 + t)
    np.testing.assert_allclose(f[0] - f[1], anscombe[0] - anscombe[1], rtol=1e-6, atol=1e-6)


@given(st.floats(0.01, 100), st.floats(-1e4, 1e4))
def test_without_shot_noise_it_is_a_division(sigma, x):
    law = stabiliser(([-np.inf], [0.0], [sigma**2]), "gaussian")
    found = law.forward(np.array([x]))
    np.testing.assert_allclose(found, x / sigma, rtol=1e-9)
    np.testing.assert_allclose(law.inverse(found, 1e4), x, rtol=1e-6, atol=1e-6 * sigma)


@given(
    slope=st.lists(st.floats(0.01, 20), min_size=2, max_size=2),
    intercept=st.lists(st.floats(-50, 400), min_size=2, max_size=2),
    switch=st.floats(1, 5000),
)
@settings(max_examples=50)
def test_the_transform_rises_without_a_step(slope, intercept, switch):
    law = stabiliser(([-np.inf, switch], slope, intercept), "gaussian")
    x = np.sort(np.append(np.linspace(-100, 6000, 5001), [switch, np.nextafter(switch, 0), 0]))
    f = law.forward(x)
    step = np.diff(f)
    assert (step >= -4 * np.spacing(np.abs(f[1:]))).all()  # rounding, between neighbouring floats
    least = min(np.sqrt(max(t, 0) + 7 / 8 * m**2) for m, t in zip(slope, intercept, strict=True))
    assert (step <= np.diff(x) / least * (1 + 1e-6) + 1e-9).all()


@pytest.fixture(scope="module")
def scene(shared_data):
    """Return a linear crop with deep shadows, 10 to 4000 DN."""
    display = read(shared_data / "kodak" / "kodim23.png")[150:278, 300:428]
    return (10 + 3990 * display**2.2).astype(np.float32)


def camera_noise(clean, slope, intercept, seed=0):
    sigma = np.sqrt(slope * clean + intercept)
    return (clean + sigma * np.random.default_rng(seed).normal(size=clean.shape)).astype(np.float32)


def weighted_error(found, clean, slope, intercept):
    """Return the error in standard deviations of each pixel's noise: shadows count as lights do."""
    return np.sqrt(np.mean((found - clean) ** 2 / (slope * clean + intercept)))


@pytest.mark.parametrize("denoiser", [bm3d, bls_gsm])
@pytest.mark.parametrize("channels", [1, 3])
def test_knowing_the_law_gains(scene, denoiser, channels):
    clean = scene if channels == 3 else np.ascontiguousarray(scene[..., 1])
    slope, intercept = 8.0, 30.0
    given = camera_noise(clean, slope, intercept)
    even = float(np.sqrt(np.mean(slope * clean + intercept)))
    told = stabilised(denoiser, given, slope, intercept)
    assert told.dtype == np.float32
    plain = weighted_error(denoiser(given, even), clean, slope, intercept)
    assert weighted_error(told, clean, slope, intercept) < 0.95 * plain
    assert abs((told - clean).mean()) < 5 * even / np.sqrt(clean.size)


def test_each_channel_has_its_own_law(scene):
    gains = np.array([2.0, 1.0, 1.6])
    slope, intercept = 8.0 * gains, 30.0 * gains**2
    given = camera_noise(scene, slope, intercept)
    each = stabilised(bm3d, given, slope[None], intercept[None], lower=np.full((1, 3), -np.inf))
    same = stabilised(bm3d, given, slope.mean(), intercept.mean())
    told, untold = (weighted_error(x, scene, slope, intercept) for x in (each, same))
    assert told < untold


def test_correlation_counts_and_its_size_does_not(scene):
    clean = np.ascontiguousarray(scene[..., 1])
    kernel = np.outer([0.5, 1, 0.5], [0.5, 1, 0.5])
    white = np.random.default_rng(5).normal(size=(129, 129))
    noise = (white[1:, 1:] + white[:-1, 1:] + white[1:, :-1] + white[:-1, :-1]) / 2
    given = (clean + np.sqrt(8 * clean + 30) * noise).astype(np.float32)
    unit, large = (NoiseSpectrum.of_autocovariance(kernel * s) for s in (1.0, 64.0))
    told = stabilised(bm3d, given, 8.0, 30.0, correlation=unit)
    assert told.tobytes() == stabilised(bm3d, given, 8.0, 30.0, correlation=large).tobytes()
    plain = stabilised(bm3d, given, 8.0, 30.0)
    errors = [weighted_error(x, clean, 8.0, 30.0) for x in (told, plain)]
    assert errors[0] < 0.9 * errors[1]


def test_threads_change_no_byte(scene):
    alone = stabilised(bm3d, scene, *SINGLE[1:])
    assert stabilised(bm3d, scene, *SINGLE[1:], threads=2).tobytes() == alone.tobytes()


@pytest.mark.parametrize("shot", ["gaussian", "poisson"])
@pytest.mark.parametrize("segments", [SINGLE, DUAL_GAIN, ([-np.inf], [2.0], [-9.0])])
@given(x=st.floats(-50, 5000), highest=st.sampled_from([-5.0, 0.0, 1.0, 1000.5, 4000.0]))
@settings(max_examples=20)
def test_the_inverse_is_finite_and_undoes_the_expectation(segments, shot, x, highest):
    law = stabiliser(segments, shot)
    expected = law.expected(np.array([x]))
    back = law.inverse(expected, highest)
    assert np.isfinite(back).all()
    switch = np.abs(x - 1000) < 300  # E[f] steps back there
    if 0 <= x <= highest and not switch:
        assert abs(back[0] - x) < 0.01 * np.sqrt(law.variance(np.array([x]))[0]) + 0.01


@pytest.mark.parametrize("intercept", [-9.0, 0.0])
def test_a_black_frame_without_noise_stays_black(intercept):
    black = np.zeros((40, 40), np.float32)
    assert np.abs(stabilised(bm3d, black, 2.0, intercept)).max() < 1e-3


@pytest.mark.parametrize(
    ("segments", "shot", "says"),
    [
        (([0.0], [1.0], [1.0]), "gaussian", "-inf"),
        (([-np.inf, 9.0, 5.0], [1.0] * 3, [1.0] * 3), "gaussian", "ascend"),
        (([-np.inf], [1.0, 2.0], [1.0]), "gaussian", "a segment"),
        (([-np.inf], [0.0], [0.0]), "gaussian", "> 0"),
        (([-np.inf], [-1.0], [5.0]), "gaussian", ">= 0"),
        (([-np.inf], [np.nan], [5.0]), "gaussian", "finite"),
        (([-np.inf], [1.0], [1.0]), "binomial", "gaussian, poisson"),
    ],
)
def test_what_is_no_law_is_refused(segments, shot, says):
    with pytest.raises(ValueError, match=says):
        stabiliser(segments, shot)
