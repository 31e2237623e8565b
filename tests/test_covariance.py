"""Promise: equation (5) predicts the covariance of demosaicked noise, exactly where it can."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from dsis.cfa import Cfa, mosaic, pattern
from dsis.covariance import (
    LagCovariance,
    averaged,
    linearised_covariance,
    linearised_noise,
    measured_covariance,
    predicted_covariance,
)
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid

BAYER = [cfa for cfa in Cfa if cfa is not Cfa.MONO]
RED_BLUE = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]]) / 4
GREEN = np.array([[0, 1, 0], [1, 4, 1], [0, 1, 0]]) / 4


def bilinear_matrix(shape, cfa):
    """Return B (3, pixel, site) of bilinear demosaicking, from its kernels on sparse samples."""
    tiles = (shape[0] // 2 + 1, shape[1] // 2 + 1)
    colours = np.tile(pattern(cfa), tiles)[: shape[0], : shape[1]]
    sites = np.eye(shape[0] * shape[1]).reshape(-1, *shape)
    return np.stack(
        [
            np.stack([ndimage.convolve(s * (colours == c), kernel).ravel() for s in sites], axis=1)
            for c, kernel in enumerate((RED_BLUE, GREEN, RED_BLUE))
        ]
    )


@pytest.mark.parametrize("cfa", BAYER)
def test_white_noise_has_the_closed_form(cfa):
    found = predicted_covariance(np.full((24, 30), 4.0, np.float32), cfa)
    np.testing.assert_allclose(found.variance, 4 * np.array([9 / 16, 5 / 8, 9 / 16]), rtol=1e-12)
    exact = [[1, 4 / 7, 1 / 8], [4 / 7, 9 / 28, 1 / 14], [1 / 8, 1 / 14, 1 / 56]]
    np.testing.assert_allclose(found.pooled(), exact, rtol=1e-12)
    assert abs(found.between_channels()[0, 1]) < 1  # one pixel, two colours: other sites, not none


@settings(max_examples=12)
@given(
    cfa=st.sampled_from(BAYER),
    rows=st.integers(12, 17),
    columns=st.integers(12, 17),
    seed=st.integers(0, 99),
    masked=st.booleans(),
    lags=st.integers(1, 3),
)
def test_any_variances_as_the_matrix_product_has_them(cfa, rows, columns, seed, masked, lags):
    """B Sigma_d B^T with dense matrices, averaged over the pixels of a region."""
    generator = np.random.default_rng(seed)
    variance = generator.uniform(0.1, 9.0, (rows, columns)).astype(np.float32)
    region = generator.random((rows, columns)) < 0.5 if masked else None
    b = bilinear_matrix((rows, columns), cfa)
    full = np.einsum("aps,s,bqs->apbq", b, variance.ravel(), b, optimize=True)
    full = full.reshape(3, rows, columns, 3, rows, columns)
    inside = [
        (i, j)
        for i in range(lags + 1, rows - lags - 1)
        for j in range(lags + 1, columns - lags - 1)
        if region is None or region[i, j]
    ]
    found = predicted_covariance(variance, cfa, lags=lags, region=region)
    assert found.pixels == len(inside)
    for k, m in ((0, 0), (0, 1), (1, 0), (-lags, 1), (lags, lags), (1, -1)):
        wanted = np.mean([full[:, i, j, :, i + k, j + m] for i, j in inside], axis=0)
        np.testing.assert_allclose(found.values[lags + k, lags + m], wanted, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("columns", [24, 25, 26, 27])
def test_what_is_measured_is_a_mean_of_products(columns):
    noise = np.random.default_rng(3).normal(1.0, 2.0, (20, columns, 2)).astype(np.float32)
    region = np.zeros((20, columns), bool)
    region[5:9, 4 : columns - 2 : 3] = True
    region[9, columns - 5 : columns - 2] = True  # to the last column that counts
    found = measured_covariance(noise, lags=1, region=region)
    products = [noise[i, j, 0] * noise[i + 1, j - 1, 1] for i, j in np.argwhere(region)]
    assert found.values[2, 0, 0, 1] == pytest.approx(np.mean(products), rel=1e-6)
    assert found.pixels == region.sum()
    with pytest.raises(ValueError, match="no pixel of the region"):
        measured_covariance(noise, region=np.zeros((20, columns), bool))


def test_correlations_are_of_their_lag_and_their_channels():
    """Values of their own at each lag and pair: nothing may be transposed or mixed up."""
    values = np.arange(5 * 5 * 3 * 3, dtype=np.float64).reshape(5, 5, 3, 3) - 100
    np.fill_diagonal(values[2, 2], (4.0, 9.0, 25.0))
    found = LagCovariance(values, 1)
    assert found.lags == 2
    assert found.pooled()[1, 2] == np.trace(values[3, 4]) / 38
    assert found.pooled()[2, 1] == np.trace(values[4, 3]) / 38
    assert found.of_channel(1)[1, 2] == values[3, 4, 1, 1] / 9
    assert found.correlations()[3, 1, 0, 2] == values[3, 1, 0, 2] / (2 * 5)
    assert found.between_channels()[2, 1] == values[2, 2, 2, 1] / (5 * 3)


def test_parts_taken_together_count_by_their_pixels():
    noise = np.random.default_rng(3).normal(0, 2, (20, 24, 3)).astype(np.float32)
    left = np.broadcast_to(np.arange(24) < 8, (20, 24))
    parts = [measured_covariance(noise, region=part) for part in (left, ~left)]
    assert parts[0].pixels != parts[1].pixels
    whole = measured_covariance(noise)
    np.testing.assert_allclose(averaged(parts).values, whole.values, rtol=1e-9)


def test_what_denoisers_get_is_symmetric():
    noise = np.random.default_rng(4).normal(0, 2, (20, 24, 3)).astype(np.float32)
    found = measured_covariance(noise).stationary()
    np.testing.assert_array_equal(found, found[::-1, ::-1].swapaxes(2, 3))
    one_up = np.roll(noise[..., :1], 1, axis=0)  # channel 1 is channel 0 one row further down
    pair = np.concatenate([noise[..., :1], one_up], axis=2)
    lag = measured_covariance(pair, lags=1).stationary()[:, 1]
    assert lag[2, 1, 0] == pytest.approx(lag[1, 0, 0], rel=0.2)
    assert abs(lag[0, 1, 0]) < 0.3 * lag[1, 0, 0]


def test_a_linear_method_is_its_own_linearisation():
    generator = np.random.default_rng(5)
    clean, noise = (generator.uniform(0, 255, (30, 30)).astype(np.float32) for _ in range(2))
    found = linearised_noise(lambda x: demosaic(x, Cfa.RGGB, "bilinear"), clean, noise)
    # Two roundings of values up to 511 at a step of 1/64: 2 * 32 * 511 * 2^-24.
    np.testing.assert_allclose(found, demosaic(noise, Cfa.RGGB, "bilinear"), atol=2e-3)


def test_a_curve_passes_noise_by_its_derivative():
    clean = np.linspace(1, 10, 50, dtype=np.float32).reshape(5, 10)
    noise = np.random.default_rng(6).normal(size=(5, 10)).astype(np.float32)
    found = linearised_noise(np.square, clean, noise)
    np.testing.assert_allclose(found, 2 * clean * noise, atol=2e-3)


@pytest.mark.parametrize("method", ["dlmmse", "lu_tan"])
def test_small_noise_is_predicted_by_the_jacobian_at_the_clean_mosaic(method):
    """Noise of 0.04 codes on a smooth picture, where the edge-directed methods are nearly linear.

    The same fields on both sides: what is left are second derivatives and rounding, 4 % of the
    largest (the Jacobian of the flat picture, all weights equal, is 10 % off).
    """
    y, x = np.mgrid[:160, :160].astype(np.float32)
    red, green = 40 + 0.8 * x + 7 * np.sin(y / 3), 90 + x / 3 + 9 * np.sin(x / 4)
    clean = mosaic(np.stack([red, green, 60 + y / 2 + 8 * np.cos(x / 5)], axis=2), Cfa.GRBG)
    variance = np.full(clean.shape, 0.04**2, np.float32)
    grid = PixelGrid(*clean.shape, Cfa.GRBG)

    def full(samples):
        return demosaic(samples, Cfa.GRBG, method, full_scale=255.0)

    def linear(at):
        return linearised_covariance(
            at, variance, Cfa.GRBG, method, Draw(10), full_scale=255.0, draws=2
        )

    fields = [clean + 0.04 * Draw(10).normal("probe", grid, number) for number in (0, 1)]
    found = averaged([measured_covariance(full(noisy) - full(clean)) for noisy in fields])
    largest = found.variance.max()
    np.testing.assert_allclose(linear(clean).values, found.values, rtol=0, atol=0.04 * largest)
    flat = linear(np.full_like(clean, 128))
    assert np.abs(flat.values - found.values).max() > 0.05 * largest


def test_draws_are_independent_of_one_another_and_of_where_the_jacobian_is_taken():
    """The stated recipe, step by step: probes of all draws, at noise of a purpose of its own."""
    clean = np.random.default_rng(2).uniform(0, 255, (40, 44)).astype(np.float32)
    variance = np.full_like(clean, 9.0)
    options = {"full_scale": 255.0, "draws": 3}
    draw, grid = Draw(1), PixelGrid(40, 44, Cfa.RGGB)

    def full(samples):
        return demosaic(samples, Cfa.RGGB, "lu_tan", full_scale=255.0)

    for around, sd in (("clean", 0.0), ("noisy", 3.0)):
        parts = []
        for number in range(3):
            at = clean + np.float32(sd) * draw.normal("point of linearisation", grid, number)
            probe = np.float32(3) * draw.normal("probe", grid, number)
            parts.append(measured_covariance(linearised_noise(full, at, probe)))
        found = linearised_covariance(
            clean, variance, Cfa.RGGB, "lu_tan", draw, around=around, **options
        )
        np.testing.assert_allclose(found.values, averaged(parts).values, rtol=1e-5, atol=1e-6)


def test_threads_and_draws_leave_the_bytes_as_they_are():
    clean = np.random.default_rng(2).uniform(0, 255, (140, 60)).astype(np.float32)
    options = {"full_scale": 255.0, "draws": 2, "around": "noisy"}
    one, two = (
        linearised_covariance(
            clean, np.ones_like(clean), Cfa.RGGB, "dlmmse", Draw(1), threads=threads, **options
        )
        for threads in (1, 2)
    )
    np.testing.assert_array_equal(one.values, two.values)
