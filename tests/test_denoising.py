"""Both denoisers reach what was published, and keep their promises on any image."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.denoising import NoiseSpectrum, bls_gsm, bm3d
from dsis.imagefile import read

DENOISERS = pytest.mark.parametrize("denoiser", [bm3d, bls_gsm])
SIGMA = 25 / 255
FILES = {"Cameraman": "01", "House": "02", "Lena": "08", "Barbara": "09", "Boat": "10"}


@pytest.fixture(scope="module")
def picture(shared_data):
    def load(name):
        samples = read(shared_data / "set12" / f"{FILES[name]}.png")
        return np.ascontiguousarray(samples[..., 0] if samples.ndim == 3 else samples)

    return load


def noisy(image, sigma=SIGMA, seed=0):
    noise = np.random.default_rng(seed).normal(0, sigma, image.shape)
    return (image + noise).astype(np.float32)


def psnr(image, reference):
    error = image.astype(np.float64) - reference
    return -10 * np.log10(np.mean(error**2))


def mean_psnr(denoiser, clean, seeds):
    found = [psnr(denoiser(noisy(clean, seed=s), SIGMA, threads=2), clean) for s in range(seeds)]
    return np.mean(found)


def pattern(shape, seed=0):
    """Return edges and a texture, 0..1."""
    rows, columns = np.indices(shape[:2])
    grey = 0.5 + 0.3 * np.sign(rows - columns) + 0.1 * np.sin(columns * 0.9 + seed)
    if len(shape) == 2:
        return grey.astype(np.float32)
    return (grey[..., None] * np.array([1.0, 0.7, 0.4])).astype(np.float32)


# Dabov et al. (2007), table of grey-scale results. From one noise to the next the result changes by
# 0.05 dB (256 x 256) and 0.02 dB (512 x 512).
@pytest.mark.parametrize(
    ("name", "published_db", "seeds"),
    [("Cameraman", 29.45, 3), ("House", 32.86, 3), ("Lena", 32.08, 1), ("Barbara", 30.72, 1)],
)
def test_bm3d_reaches_the_published_psnr(picture, name, published_db, seeds):
    assert abs(mean_psnr(bm3d, picture(name), seeds) - published_db) < 0.1


# Portilla et al. (2003), table of results.
@pytest.mark.parametrize(
    ("name", "published_db"),
    [("Lena", 31.69), ("Barbara", 29.13), ("House", 31.40), ("Boat", 29.37)],
)
def test_bls_gsm_reaches_the_published_psnr(picture, name, published_db):
    assert abs(mean_psnr(bls_gsm, picture(name), 1) - published_db) < 0.25


def test_color_gains_from_grouping_by_luminance(shared_data):
    clean = read(shared_data / "kodak" / "kodim01.png")[200:328, 200:328]
    given = noisy(clean)
    together = psnr(bm3d(given, SIGMA), clean)
    apart = np.stack([bm3d(np.ascontiguousarray(given[..., c]), SIGMA) for c in range(3)], -1)
    # 1.5 to 2 dB in the authors' tables; this crop is small.
    assert together > psnr(apart, clean) + 1.0


@DENOISERS
@pytest.mark.parametrize("shape", [(150, 70), (140, 66, 3)])
def test_threads_change_no_byte(denoiser, shape):
    given = noisy(pattern(shape))
    alone = denoiser(given, SIGMA)
    assert alone.dtype == np.float32
    assert alone.shape == shape
    for threads in (2, 3):
        assert denoiser(given, SIGMA, threads=threads).tobytes() == alone.tobytes()


@DENOISERS
@pytest.mark.parametrize("shape", [(50, 70), (50, 66, 3)])
def test_a_white_spectrum_is_the_standard_deviation(denoiser, shape):
    given = noisy(pattern(shape))
    wanted = denoiser(given, SIGMA).tobytes()
    kernel = np.zeros((5, 7))
    kernel[2, 3] = SIGMA**2
    for spectrum in (NoiseSpectrum.white(SIGMA), NoiseSpectrum.of_autocovariance(kernel)):
        assert denoiser(given, spectrum).tobytes() == wanted


@DENOISERS
def test_three_equal_standard_deviations_are_one(denoiser):
    given = noisy(pattern((40, 48, 3)))
    three = denoiser(given, (SIGMA, SIGMA, SIGMA))
    np.testing.assert_allclose(three, denoiser(given, SIGMA), atol=1e-5)


@DENOISERS
@given(level=st.floats(-1000, 1000), sigma=st.floats(1e-3, 100))
@settings(max_examples=10)
def test_a_constant_stays(denoiser, level, sigma):
    image = np.full((33, 40), level, np.float32)
    rounding = 2 * np.finfo(np.float32).eps * abs(level)  # the mean comes off, and on again
    np.testing.assert_allclose(denoiser(image, sigma), image, rtol=0, atol=rounding)


@DENOISERS
@pytest.mark.parametrize("shape", [(40, 48), (40, 48, 3)])
def test_without_noise_nothing_changes(denoiser, shape):
    image = pattern(shape)
    rounding = 1e-6  # there and back through the opponent colours
    np.testing.assert_allclose(denoiser(image, 0.0), image, rtol=0, atol=rounding)


@DENOISERS
@given(power=st.integers(-12, 12))
@settings(max_examples=5)
def test_a_change_of_unit_changes_the_unit(denoiser, power):
    given = noisy(pattern((40, 48)))
    unit = np.float32(2.0**power)
    scaled = denoiser(given * unit, SIGMA * float(unit))
    np.testing.assert_allclose(scaled / unit, denoiser(given, SIGMA), rtol=0, atol=1e-4 * SIGMA)


@DENOISERS
def test_a_shift_of_the_image_shifts_the_result(denoiser):
    given = noisy(pattern((64, 64)))
    difference = denoiser(given + np.float32(3), SIGMA) - 3 - denoiser(given, SIGMA)
    # Rounding may change which of two equally similar blocks is taken: rarely, and by little.
    assert np.sqrt(np.mean(difference**2)) < 0.02 * SIGMA


@DENOISERS
@pytest.mark.parametrize("shape", [(33, 257), (41, 34, 3)])
def test_odd_sizes_lose_noise(denoiser, shape):
    clean = pattern(shape)
    given = noisy(clean)
    found = denoiser(given, SIGMA)
    assert found.shape == shape
    assert psnr(found, clean) > psnr(given, clean) + 3


def test_bm3d_takes_a_single_block():
    clean = np.full((8, 8), 0.5, np.float32)
    given = noisy(clean)
    assert psnr(bm3d(given, SIGMA), clean) > psnr(given, clean)


@DENOISERS
@pytest.mark.parametrize(
    ("image", "noise", "says"),
    [
        (np.zeros((40, 40, 2)), 1.0, r"\(row, column, 3\)"),
        (np.zeros((40, 7)), 1.0, "at least"),
        (np.full((40, 40), np.nan), 1.0, "finite"),
        (np.zeros((40, 40)), -1.0, "at least 0"),
        (np.zeros((40, 40)), np.nan, "at least 0"),
        (np.zeros((40, 40)), (1.0, 1.0), "one number or three"),
        (np.zeros((40, 40)), (1.0, 1.0, 1.0), "does not fit"),
    ],
)
def test_what_cannot_be_used_is_refused(denoiser, image, noise, says):
    with pytest.raises(ValueError, match=says):
        denoiser(image.astype(np.float32), noise)
