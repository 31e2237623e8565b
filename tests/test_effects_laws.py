"""Promise: noise that effects draw follows the law of its physics: counts, tails, jumps, outliers.

Measured without dsis's own measures; tolerances are five standard errors.
"""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Exposure, ReadOut
from dsis.effects.poisson_shot_noise import PoissonShotNoise, exact_quantile, expanded_quantile
from dsis.grid import PixelGrid
from dsis.noise import Segments
from exposing import P_MIN, Z_MAX, apply, camera, effect, flat, recorded

MEANS = [0.02, 0.5, 3.0, 20.0, 63.9, 64.1, 300.0, 1e4]


@pytest.mark.parametrize("mean", MEANS)
def test_counts_are_poisson_quantiles(mean: float) -> None:
    """scipy's ppf is the oracle: equal below 64 electrons, at most one beside it above."""
    z = np.linspace(-6, 6, 2001)
    quantile = (
        (lambda d: exact_quantile(stats.norm.cdf(d), mean))
        if mean < 64
        else (lambda d: expanded_quantile(d, mean))
    )
    found = np.array([quantile(d) for d in z])
    oracle = stats.poisson.ppf(stats.norm.cdf(z), mean)
    assert np.abs(found - oracle).max() <= 1
    weight = stats.norm.pdf(z)
    wrong = float((weight * (found != oracle)).sum() / weight.sum())
    # Above: the error of the third-order expansion, 0.2 / mean, is the share of counts that differ.
    assert wrong <= (1e-6 if mean < 64 else 0.2 / np.sqrt(mean))


@pytest.mark.parametrize("mean", MEANS)
def test_a_count_hangs_on_its_own_pixel_alone(mean: float) -> None:
    """Fields of one light, of two by turns, of many: pixel by pixel what a pixel alone counts."""
    law = PoissonShotNoise()
    rng = np.random.default_rng(5)
    z = rng.standard_normal((16, 32)).astype(np.float32)
    one = np.full(z.shape, 2 * mean, np.float32)
    two, many = one.copy(), (one * rng.uniform(0.9, 1.1, z.shape)).astype(np.float32)
    two[:, ::2] *= np.float32(1.5)
    segments = Segments.of([(-np.inf, 2.0, 4.0), (4 * mean, 1.0, -0.01)])
    for light in (one, two, many):
        field = law.reshape(z, _exposed(light, segments))
        alone = [law.reshape(z[[i]][:, [j]], _exposed(light[[i]][:, [j]], segments))
                 for i, j in np.ndindex(z.shape)]  # fmt: skip
        np.testing.assert_array_equal(field.ravel(), np.concatenate(alone).ravel())


def _exposed(light: NDArray[np.float32], segments: Segments) -> Exposure:
    grid = PixelGrid(*light.shape, Cfa.MONO)
    read_out = ReadOut(Cfa.MONO, segments, 0.0, 4095.0)
    return Exposure(grid, 0, Draw(1), Draw(2), light, read_out, lambda _: light)


@pytest.mark.parametrize("electrons", [0.5, 5.0, 80.0, 2000.0])
def test_poisson_shot_noise_has_the_moments_of_its_electrons(electrons: float) -> None:
    m = 3.0
    grid = PixelGrid(512, 512, Cfa.MONO)
    level = m * electrons
    one = camera(effect("poisson_shot_noise"), slope=m).model_copy(update={"black_level": 5000.0})
    frame = one.expose(np.full(grid.shape, level, np.float32), Draw(1), Draw(2), 0, grid)
    counts = frame.astype(np.float64) / m
    assert np.abs(counts - np.rint(counts)).max() < 1e-6  # whole electrons: m is a whole number
    n = counts.size
    spread = np.sqrt((2 + 1 / electrons) / n)
    assert abs(counts.mean() - electrons) < Z_MAX * np.sqrt(electrons / n)
    assert abs(counts.var() / electrons - 1) < Z_MAX * spread
    error = np.sqrt((6 + 15 / electrons + 15 / electrons**2) / n)
    assert abs(stats.skew(counts, axis=None) - 1 / np.sqrt(electrons)) < Z_MAX * error


def test_poisson_as_base_model_is_the_same_as_the_effect() -> None:
    one = camera(effect("poisson_shot_noise"), slope=2.0, intercept=9.0)
    noise = one.noise.model_copy(update={"shot": "poisson"})
    other = one.model_copy(update={"effect": (), "noise": noise})
    np.testing.assert_array_equal(recorded(one, 50.0, 2), recorded(other, 50.0, 2))


@pytest.mark.parametrize("tail_df", [3.0, 5.0, 12.0])
def test_heavy_tails_are_students(tail_df: float) -> None:
    sigma = 50.0
    stack = recorded(
        camera(effect("heavy_tailed_read_noise", tail_df=tail_df), intercept=2500), 4000, 8
    )
    t = (stack.ravel() - 4000) / (sigma * np.sqrt((tail_df - 2) / tail_df))
    dither = np.random.default_rng(0).uniform(-0.5, 0.5, t.size) / sigma  # undo the rounding
    assert stats.kstest(t + dither, stats.t(tail_df).cdf).pvalue > P_MIN


def test_read_noise_spread_is_lognormal_and_keeps_the_mean_variance() -> None:
    frames, s = 400, 0.3
    stack = recorded(
        camera(effect("read_noise_spread", log_sigma=s), intercept=900.0), 2000, frames, (32, 32)
    )
    log_sd = np.log(stack.var(0, ddof=1) / 900.0) / 2 + s * s
    scatter = np.sqrt(s**2 + 1 / (2 * frames))
    assert abs(log_sd.mean()) < Z_MAX * scatter / 32 + 1 / frames
    assert abs(log_sd.std() / scatter - 1) < Z_MAX / np.sqrt(2 * 1024)
    relative = np.sqrt((np.expm1(4 * s * s) + 2 / frames) / 1024)
    assert abs(stack.var(0, ddof=1).mean() / 900 - 1) < Z_MAX * relative


def test_rts_pixels_jump_between_two_levels() -> None:
    q, a, w, frames = 0.1, 40.0, 0.15, 300
    one = effect("rts", pixel_fraction=q, amplitude_dn=a, switch_probability=w)
    stack = np.stack([apply(one, flat(0, 64), t) for t in range(frames)])
    hit = np.ptp(stack, 0) > 0
    n = hit.size
    assert abs(hit.mean() - q) < Z_MAX * np.sqrt(q / n)
    pixels = stack[:, hit]
    assert max(len(np.unique(series)) for series in pixels.T) == 2
    heights = np.ptp(pixels, 0)
    np.testing.assert_allclose(pixels, np.sign(pixels) * heights / 2, rtol=1e-5)
    assert stats.kstest(heights, stats.expon(scale=a).cdf).pvalue > P_MIN
    switches = (np.diff(np.sign(pixels), axis=0) != 0).mean()
    assert abs(switches - w) < Z_MAX * np.sqrt(w * (1 - w) / pixels[1:].size)
    filled = (pixels > 0).mean()
    assert abs(filled - 0.5) < Z_MAX * 0.5 / np.sqrt(pixels.size * w)  # runs of 1 / w frames


@pytest.mark.parametrize(("levels", "below"), [("above", 0.0), ("either", 0.5)])
def test_rts_pixels_at_rest_are_as_any_other(levels: str, below: float) -> None:
    """Of the same jumps, height for height: those of `about`, from the signal on."""
    own = {"pixel_fraction": 0.2, "amplitude_dn": 40.0}
    about, one = effect("rts", **own), effect("rts", **own, levels=levels)
    stacks = [np.stack([apply(e, flat(0, 64), t) for t in range(60)]) for e in (about, one)]
    hit = np.ptp(stacks[0], 0) > 0
    heights = np.ptp(stacks[0], 0)[hit]
    np.testing.assert_allclose(np.ptp(stacks[1], 0)[hit], heights, rtol=1e-5)
    assert not stacks[1][:, ~hit].any()
    middle = (stacks[1].max(0) + stacks[1].min(0))[hit] / 2
    np.testing.assert_allclose(np.abs(middle), heights / 2, rtol=1e-5)
    n = middle.size
    assert abs((middle < 0).mean() - below) <= Z_MAX * np.sqrt(below * (1 - below) / n)


@pytest.mark.parametrize("heights", ["exponential", "equal"])
def test_rts_pixels_of_a_large_field_are_drawn_as_those_of_a_small_one(
    heights: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Traps are kept from frame to frame where a field is small, and found anew where it is not."""
    one = effect("rts", pixel_fraction=0.1, amplitude_dn=9.0, levels="either", heights=heights)
    kept = [apply(one, flat(0, 48), t) for t in range(3)]
    monkeypatch.setattr("dsis.effects.rts._MOST_KEPT", 0)
    for t, frame in enumerate(kept):
        np.testing.assert_array_equal(apply(one, flat(0, 48), t), frame)


def test_flicker_and_drift_move_whole_frames() -> None:
    light = np.array(
        [apply(effect("flicker", sigma_percent=2.0), flat(500, 2), t)[0, 0] for t in range(2000)]
    )
    assert abs(light.std() / 10 - 1) < Z_MAX / np.sqrt(2 * 2000)
    rho = 0.7
    drift = effect("black_level_drift", sigma_dn=3.0, persistence=rho)
    series = np.array([apply(drift, flat(0, 2), t)[0, 0] for t in range(2000)])
    runs = (1 + rho) / (1 - rho)  # correlated frames count for fewer
    assert abs(series.std() / 3 - 1) < Z_MAX * np.sqrt(runs / (2 * 2000))
    lag = (series[1:] * series[:-1]).mean() / (series**2).mean()
    assert abs(lag - rho) < Z_MAX * np.sqrt((1 - rho**2) / 2000)


def test_dark_charge_grows_with_time_and_has_shot_noise() -> None:
    one = camera(effect("dark_current", dn_per_s=300.0), slope=2.0, intercept=50.0)
    for time_s in (0.0, 1.0, 4.0):
        stack = recorded(one, 0.0, 40, time_s=time_s)
        mean, variance, n = 300 * time_s, 50 + 600 * time_s + 1 / 12, stack.size
        assert abs(stack.mean() - mean) < Z_MAX * np.sqrt(variance / n)
        assert abs(stack.var() / variance - 1) < Z_MAX * np.sqrt(2 / n)


@pytest.mark.parametrize("fraction", [1e-4, 0.01])
def test_hot_pixels_have_their_share_and_law(fraction: float) -> None:
    one = effect("hot_pixels", pixel_fraction=fraction, mean_dn_per_s=50.0)
    image = apply(one, flat(0.0, 1024), time_s=1.0)
    hot = image > 0
    assert abs(hot.sum() - fraction * 2**20) < Z_MAX * np.sqrt(fraction * 2**20)
    assert stats.kstest(image[hot], stats.expon(scale=50).cdf).pvalue > P_MIN
    np.testing.assert_allclose(apply(one, flat(0.0, 1024), time_s=3.0), 3 * image, rtol=1e-5)


def test_impulses_are_rare_and_one_off() -> None:
    one = effect("impulse", per_megapixel_frame=300.0, mean_dn=80.0)
    frames = [apply(one, flat(0.0, 1024), t) for t in (0, 1)]
    hits = [frame > 0 for frame in frames]
    for frame, hit in zip(frames, hits, strict=True):
        expected = 300 * 2**20 / 1e6
        assert abs(hit.sum() - expected) < Z_MAX * np.sqrt(expected)
        assert stats.kstest(frame[hit], stats.expon(scale=80).cdf).pvalue > P_MIN
    assert (hits[0] & hits[1]).sum() <= Z_MAX
