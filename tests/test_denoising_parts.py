"""What the denoisers are made of, each part against a closed form or a plain reckoning."""

from itertools import product

import numpy as np
import pytest
import scipy.fft
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz
from scipy.stats import multivariate_normal

from analysis.denoising.bls_gsm import LOG_Z, mixture_of, neighbourhood_covariance
from analysis.denoising.bls_gsm_estimate import estimate_rows
from analysis.denoising.bm3d import GAMMA, REACH, _reach, _Stage
from analysis.denoising.bm3d_filtering import filter_groups
from analysis.denoising.bm3d_groups import MOST, Groups, Sums, bit_reversed
from analysis.denoising.bm3d_matching import match_blocks
from analysis.denoising.bm3d_shrinkage import (
    Shrinkage,
    combine_covariances,
    fill_covariances,
)
from analysis.denoising.bm3d_transforms import BLOCK, bior15, coefficient_covariances, dct
from analysis.denoising.opponent import image_of, planes_of
from analysis.denoising.pyramid import Grid, Pyramid, good_odd_size
from analysis.denoising.spectrum import NoiseSpectrum


def nearest_blocks(plane, y, x, bias, limit, most):
    """Return the corners of the nearest blocks, one block compared at a time."""
    reach = len(bias) // 2
    here = plane[y : y + 8, x : x + 8]
    found = []
    for dy, dx in product(range(-reach, reach + 1), repeat=2):
        v, u = y + dy, x + dx
        if (dy or dx) and 0 <= v <= plane.shape[0] - 8 and 0 <= u <= plane.shape[1] - 8:
            distance = ((plane[v : v + 8, u : u + 8] - here) ** 2).sum()
            found.append((distance - bias[dy + reach, dx + reach], dy, dx, v, u))
    similar = sorted(f for f in found if f[0] < limit)[: most - 1]
    count = 1 << ((1 + len(similar)).bit_length() - 1)
    return [(y, x), *(f[3:] for f in similar[: count - 1])]


@given(
    seed=st.integers(0, 1000),
    rows=st.integers(8, 30),
    columns=st.integers(8, 30),
    reach=st.integers(0, 7),
    limit=st.sampled_from([1, 300, 420, 10**6]),
)
def test_matching_finds_the_nearest_blocks(seed, rows, columns, reach, limit):
    rng = np.random.default_rng(seed)
    # Whole numbers: sums are exact, and equal distances occur (then the first offset wins).
    plane = rng.integers(0, 5, (rows, columns)).astype(np.float32)
    bias = rng.integers(-9, 9, (2 * reach + 1, 2 * reach + 1)).astype(np.float32)
    corners = [np.arange(0, size - 7, 3) for size in (rows, columns)]
    places = np.zeros((*map(len, corners), 16), np.int32)
    counts = np.zeros(places.shape[:2], np.int32)
    match_blocks(plane, *corners, bias, np.float32(limit), places, counts)
    for (r, y), (c, x) in product(*map(enumerate, corners)):
        wanted = nearest_blocks(plane, y, x, bias, limit, 16)
        got = places[r, c, : counts[r, c]]
        assert [(p // columns, p % columns) for p in got] == wanted


def test_the_cosine_transform_is_scipys():
    np.testing.assert_allclose(dct(), scipy.fft.dct(np.eye(8), axis=0, norm="ortho"), atol=1e-15)


def test_the_wavelet_analyses_with_haars_differences_and_unit_norms():
    rows = bior15()
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1)
    np.testing.assert_allclose(rows[0], np.sqrt(1 / 8))
    np.testing.assert_allclose(rows[4, :2], [np.sqrt(1 / 2), -np.sqrt(1 / 2)])
    assert np.count_nonzero(rows[4]) == 2
    # Synthesis from the coarse coefficients is piecewise constant, as Haar's low-pass is.
    coarse = np.linalg.inv(rows)[:, :4]
    np.testing.assert_allclose(coarse[::2], coarse[1::2], atol=1e-12)


@pytest.mark.parametrize("transform", [dct, bior15])
@given(a=st.floats(-0.9, 0.9), b=st.floats(-0.9, 0.9))
def test_variances_of_coefficients_under_separable_noise(transform, a, b):
    rows = transform()
    lags = np.abs(np.arange(-7, 8))
    found = coefficient_covariances(rows, np.outer(a**lags, b**lags))
    assert found.shape == (1, 1, 8, 8)
    along = [np.diag(rows @ toeplitz(r ** np.arange(8)) @ rows.T) for r in (a, b)]
    np.testing.assert_allclose(found[0, 0], np.outer(*along), atol=1e-12)


def haar(size):
    """Return Haar's orthonormal matrix: the mean first, then differences from coarse to fine."""
    if size == 1:
        return np.ones((1, 1))
    half = size // 2
    sums = np.kron(haar(half), [1, 1]) / np.sqrt(2)
    return np.vstack([sums, np.kron(np.eye(half), [1, -1]) / np.sqrt(2)])


@pytest.mark.parametrize("transform", [dct, bior15])
@given(order=st.integers(0, 3), seed=st.integers(0, 99))
@settings(max_examples=10)
def test_variances_of_a_groups_coefficients(transform, order, seed):
    """Beside the covariance matrix of all pixels of the group, transformed in one piece."""
    rng = np.random.default_rng(seed)
    count, width = 1 << order, 40
    corners = rng.integers(0, 12, (count, 2))  # overlapping, some at the same place
    kernel = np.correlate(taps := rng.normal(size=4), taps, "full")
    kernel = np.outer(kernel, kernel / kernel[3])  # any autocovariance, of moving averages
    y, x = (
        (c[:, None, None] + g).ravel() for c, g in zip(corners.T, np.indices((8, 8)), strict=True)
    )
    lags = np.zeros((2 * 19 + 1,) * 2)
    lags[16:23, 16:23] = kernel
    pixels = lags[y[:, None] - y + 19, x[:, None] - x + 19]
    whole = np.kron(haar(count), np.kron(transform(), transform()))
    wanted = ((whole @ pixels) * whole).sum(1).reshape(count, 8, 8)
    spectrum = NoiseSpectrum.of_autocovariance(kernel)
    table = coefficient_covariances(transform(), spectrum.autocovariance(0, 11 + 7))
    table = table.swapaxes(2, 3).reshape(23, 23, 64).astype(np.float32)
    between = np.zeros((MOST, MOST, 64), np.float32)
    found = np.zeros((8, MOST * 8), np.float32)
    slots = bit_reversed()[order]
    fill_covariances(table, corners @ np.int32([width, 1]), slots, count, width, between)
    combine_covariances(between, np.float32(0), found, count)
    # Slots: the mean, then differences from coarse to fine, each in bit-reversed order.
    placed = found[:, : count * 8].reshape(8, count, 8).transpose(1, 2, 0)
    sorted_slots = [0] + [
        h + int(s) for k in range(order) for h in [1 << k] for s in bit_reversed()[k, :h]
    ]
    assert np.abs(placed[sorted_slots] - wanted).max() < 1e-5 * wanted.max()


def test_what_noise_makes_alike_is_taken_off_the_likeness_of_blocks():
    """The bias is GAMMA times how much nearer than independent ones blocks of noise are."""
    white = np.random.default_rng(1).normal(size=(1, 700, 700))
    noise = (white + np.roll(white, 1, axis=2)).astype(np.float32)  # its neighbours correlate
    spectrum = NoiseSpectrum.of_autocovariance([[1.0, 2.0, 1.0]])
    bias = _Stage.first(noise, spectrum).bias
    independent = 2 * BLOCK**2 * 2.0
    for dy, dx in ((0, 1), (0, -1), (1, 0), (3, 5)):
        moved = np.roll(noise, (-dy, -dx), axis=(1, 2))
        nearer = BLOCK**2 * float(np.square(noise - moved).mean()) - independent
        # Of 490 000 squares with some neighbours alike: 64 x 4 x 2.5 / 700 for one deviation.
        assert bias[REACH + dy, REACH + dx] / GAMMA == pytest.approx(nearer, abs=5)


def test_blocks_are_independent_from_where_no_two_of_their_pixels_correlate():
    spectrum = NoiseSpectrum.of_autocovariance([[0.5, 1, 2, 1, 0.5]])
    for offset in (BLOCK, BLOCK + 1, BLOCK + 2):  # along the row: gaps of 0, 1 and 2 pixels
        nearest = offset - (BLOCK - 1)
        assert (offset <= _reach(spectrum)) == (nearest <= 2)
    assert _reach(NoiseSpectrum.white(1.0)) == 0


def test_power_is_never_negative():
    """A covariance cut off at some lag: 1 + 2 x 0.9 cos f falls below 0, where no noise is."""
    power = NoiseSpectrum.of_autocovariance([[0.9, 1.0, 0.9]]).power(0, 1, 16)[0]
    expected = 1 + 1.8 * np.cos(2 * np.pi * np.arange(16) / 16)
    np.testing.assert_allclose(power, np.maximum(expected, 0), atol=1e-12)


@pytest.mark.parametrize("wiener", [True, False])
@pytest.mark.parametrize("members", [1, 2])
def test_a_group_is_shrunk_and_weighted_as_published(wiener, members):
    """Dabov et al. (2007), equations (5), (6), (10) and (11), with another's cosine transform."""
    generator = np.random.default_rng(3)
    width = BLOCK * members  # blocks side by side, so that what each adds is seen
    noisy, basic = (generator.normal(0, 2, (1, BLOCK, width)).astype(np.float32) for _ in range(2))
    variance = generator.uniform(0.2, 3, (BLOCK, BLOCK))  # vertical, horizontal frequency
    window = generator.uniform(0.5, 1, (BLOCK, BLOCK))
    by_hand = variance.T.reshape(1, 1, 1, -1), window
    covariance, weights = (a.astype(np.float32) for a in by_hand)
    forward = dct().astype(np.float32)
    numbers = np.float32(1e-6), np.float32(1.5)
    rule = Shrinkage(forward, np.ascontiguousarray(forward.T), covariance, *numbers, weights)
    places = (BLOCK * np.arange(members, dtype=np.int32)).reshape(1, 1, -1)
    groups = Groups(places, np.full((1, 1), members, np.int32), bit_reversed())
    sums = Sums(0, np.zeros_like(noisy), np.zeros_like(noisy))
    filter_groups(noisy, basic if wiener else basic[:0], groups, rule, sums)
    _, total, weight = sums

    def coefficients(image):
        split = image[0].astype(np.float64).reshape(BLOCK, members, BLOCK).swapaxes(0, 1)
        turned = scipy.fft.dctn(split, axes=(1, 2), norm="ortho")
        return turned if members == 1 else np.stack([turned[0] + turned[1], turned[0] - turned[1]])

    scale = members**-0.5  # of Haar's orthonormal pair
    seen, guide = scale * coefficients(noisy), scale * coefficients(basic)
    gain = guide**2 / (guide**2 + variance) if wiener else np.abs(seen) > 1.5 * np.sqrt(variance)
    gain = gain.astype(np.float64)
    gain[0, 0, 0] = 1  # the mean of the group stays
    kept = gain * seen
    parts = kept if members == 1 else scale * np.stack([kept[0] + kept[1], kept[0] - kept[1]])
    estimate = np.hstack(list(scipy.fft.idctn(parts, axes=(1, 2), norm="ortho")))
    certain = np.tile(window, (1, members)) / (gain**2 * variance).sum()
    np.testing.assert_allclose(weight[0], certain, rtol=1e-5)
    np.testing.assert_allclose(total[0] / weight[0], estimate, atol=1e-5)


@given(st.integers(1, 4000))
def test_good_sizes_are_odd_and_split_into_small_primes(least):
    size = good_odd_size(least)
    assert size >= least
    assert size % 2 == 1
    assert scipy.fft.next_fast_len(size) == size  # of factors up to 11


def bands(pyramid, image):
    spectrum = pyramid.grid.forward(image)
    for level in pyramid.levels:
        here = level.grid.crop(spectrum) * np.complex64(1j)
        for angular in level.angular:
            yield level, level.radial * angular, level.grid.inverse(here * level.radial * angular)


@given(
    rows=st.sampled_from([33, 45, 105]),
    columns=st.sampled_from([35, 49, 135]),
    octaves=st.integers(1, 3),
    seed=st.integers(0, 99),
)
@settings(max_examples=12)
def test_the_pyramid_reconstructs(rows, columns, octaves, seed):
    image = np.random.default_rng(seed).normal(size=(rows, columns)).astype(np.float32)
    pyramid = Pyramid.of(rows, columns, octaves)
    total = pyramid.grid.forward(image) * pyramid.low_pass**2
    for level, own, band in bands(pyramid, image):
        assert band.dtype == np.float32
        level.grid.add_to(total, level.grid.forward(band) * own * np.complex64(-1j))
    np.testing.assert_allclose(pyramid.grid.inverse(total), image, rtol=0, atol=1e-5)


def test_a_band_answers_to_its_orientation_and_octave():
    size = 135
    wave = np.cos(2 * np.pi * 12 / size * np.arange(size))  # 0.56 radians: octaves 2 and 3
    rows = np.repeat(wave[:, None], size, 1).astype(np.float32)  # varies from row to row
    energy = [np.mean(band**2) for _, _, band in bands(Pyramid.of(size, size, 3), rows)]
    strongest = int(np.argmax(energy))
    assert strongest % 8 == 4  # pi/2: frequencies along the rows' axis
    assert strongest // 8 in (2, 3)
    assert max(energy[:8]) < 1e-9
    np.testing.assert_allclose(np.asarray(energy)[strongest // 8 * 8], 0, atol=1e-9)


@pytest.mark.parametrize("octave", [0, 1, 2])
def test_covariance_of_a_neighbourhood_is_that_of_filtered_noise(octave):
    rng = np.random.default_rng(1)
    pyramid = Pyramid.of(63, 75, 2)
    kernel = np.outer([0.25, 0.5, 0.25], [0.5, 1, 0.5])  # triangle: (1, 1) averaged, twice
    power = NoiseSpectrum.of_autocovariance(kernel).power(0, 63, 75)
    level = pyramid.levels[octave]
    angular = level.angular[3]
    own = level.radial * angular
    parent = None if level.parent is None else level.parent * angular
    part = level.grid.crop(power[:, :38]) / power.size
    stated = neighbourhood_covariance(part, own, parent, level)
    samples = []
    for _ in range(60):
        noise = np.fft.ifft2(np.fft.fft2(rng.normal(size=(63, 75))) * np.sqrt(power)).real
        here = level.grid.crop(pyramid.grid.forward(noise.astype(np.float32))) * 1j
        band = level.grid.inverse(here * own)
        planes = [np.roll(band, (1 - k // 3, 1 - k % 3), (0, 1)) for k in range(9)]
        if parent is not None:
            planes.append(level.grid.inverse(here * parent))
        flat = np.reshape(planes, (len(planes), -1)).astype(float)
        samples.append(flat @ flat.T / flat.shape[1])
    error = np.std(samples, axis=0, ddof=1) / np.sqrt(len(samples))
    z = (np.mean(samples, axis=0) - stated) / np.maximum(error, 1e-9)
    assert np.abs(z).max() < 5


@pytest.mark.parametrize("size", [9, 10])
def test_the_estimate_is_bayes_rule(size):
    rng = np.random.default_rng(2)
    root = rng.normal(size=(2, size, size))
    c_w, c_u = (r @ r.T / size + 0.1 * np.eye(size) for r in root)
    band = (3 * rng.normal(size=(3, 8))).astype(np.float32)
    parent = rng.normal(size=(size - 9, 6)).astype(np.float32)
    out = np.empty((1, 6), np.float32)
    estimate_rows(band, parent, mixture_of(c_w, c_w + c_u), 0, 1, out)
    z = np.exp(LOG_Z)
    for x in range(6):
        y = np.append(band[:, x : x + 3].ravel(), parent[:, x]).astype(float)
        density = [multivariate_normal(np.zeros(size), s * c_u + c_w).pdf(y) for s in z]
        means = [s * c_u[4] @ np.linalg.solve(s * c_u + c_w, y) for s in z]
        wanted = np.average(means, weights=density)
        assert abs(out[0, x] - wanted) < 1e-4 * np.abs(y).max()  # float32 through 30 sums


def test_opponent_colours_come_back():
    image = np.random.default_rng(3).random((9, 11, 3)).astype(np.float32)
    planes, _ = planes_of(image, NoiseSpectrum.white(1.0))
    np.testing.assert_allclose(image_of(planes), image, atol=1e-6)


def test_opponent_noise_is_that_of_the_weights():
    _, noise = planes_of(np.zeros((9, 9, 3), np.float32), NoiseSpectrum.white((3.0, 2.0, 1.0)))
    sums = [(9 + 4 + 1) / 9, (9 + 1) / 4, (9 + 4 * 4 + 1) / 16]
    np.testing.assert_allclose(np.diagonal(noise.at_lag_zero), sums)
    assert noise.at_lag_zero[0, 1] == pytest.approx((9 - 1) / 6)


def test_a_grid_crops_and_adds_back():
    spectrum = Grid(9, 15).forward(np.random.default_rng(4).random((9, 15)).astype(np.float32))
    part = Grid(5, 7)
    back = np.zeros_like(spectrum)
    part.add_to(back, part.crop(spectrum))
    kept = np.abs(back) > 0
    assert kept.sum() == 5 * 4
    np.testing.assert_array_equal(back[kept], spectrum[kept])


def test_the_lags_of_a_band_are_those_of_the_whole_transform():
    """Five lags by sums over the frequencies, against all lags by another's inverse FFT."""
    grid, generator = Grid(45, 63), np.random.default_rng(5)
    power = np.abs(scipy.fft.rfft2(generator.normal(size=(45, 63)))) ** 2
    a, b = (
        np.abs(scipy.fft.rfft2(generator.normal(size=(45, 63)))).astype(np.float32)
        for _ in range(2)
    )
    whole = scipy.fft.irfft2(power * a * b, (45, 63), norm="forward")
    lag = np.arange(-2, 3)
    found = grid.autocovariance(power, a, b)
    np.testing.assert_allclose(found, whole[lag[:, None], lag], atol=1e-12 * whole[0, 0])
