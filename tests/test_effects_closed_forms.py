"""Promise: effects obey the closed forms of their physics, measured without dsis's own measures.

Statistics are written out here in numpy and scipy; tolerances are five standard errors.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, ReadOut, registry
from dsis.effects.adc_dnl import code_edges
from dsis.effects.poisson_shot_noise import exact_quantile, expanded_quantile
from dsis.grid import PixelGrid
from dsis.noise import Segments

Z_MAX = 5.0
P_MIN = 1e-6  # of a Kolmogorov-Smirnov test: about five standard errors
BLACK_DN, WHITE_DN = 200.0, 16383.0
SIDE = 256
SAME_NOISE = (
    0.03  # of a change seen in one and the same noise: 2^18 pixels, correlation's own error
)


def effect(kind: str, **parameters: object) -> Effect:
    return registry()[kind](**parameters)


def camera(
    *effects: Effect,
    slope: float = 0.0,
    intercept: float = 0.0,
    cfa: Cfa = Cfa.MONO,
    switch: float | None = None,
) -> Camera:
    last = Segment(slope=slope, intercept=intercept)
    first = (Segment(upper_dn=switch, slope=slope, intercept=intercept),) if switch else ()
    return Camera(
        name="test",
        cfa=cfa,
        black_level=BLACK_DN,
        white_level=WHITE_DN,
        bit_depth=14,
        noise=BaseNoise(segment=(*first, last)),
        effect=effects,
    )


def apply(
    one: Effect,
    image: np.ndarray,
    frame: int = 0,
    *,
    grid: PixelGrid | None = None,
    expected: float | None = None,
    time_s: float = 0.0,
) -> np.ndarray:
    """Return what the effect alone makes of an image, in float64."""
    image = image.astype(np.float32)
    grid = grid or PixelGrid(*image.shape, Cfa.MONO)
    clean = image if expected is None else np.full_like(image, expected)
    segments = Segments.of([(-np.inf, 1.0, 4.0), (1000.0, 1.0, 16.0)])
    read_out = ReadOut(grid.cfa or Cfa.MONO, segments, BLACK_DN, WHITE_DN)
    exposure = Exposure(grid, frame, Draw(3), Draw(4), clean, read_out, lambda _: image, time_s)
    return one.apply(image, exposure).astype(np.float64)


def recorded(
    one: Camera, level: float, frames: int, shape: tuple[int, int] = (64, 64), time_s: float = 0.0
) -> np.ndarray:
    grid = PixelGrid(*shape, one.cfa)
    clean = np.full(shape, level, np.float32)
    return np.stack(
        [one.expose(clean, Draw(5), Draw(6), t, grid, exposure_time_s=time_s)
         for t in range(frames)]
    ).astype(np.float64)  # fmt: skip


def white(sigma: float = 10.0, side: int = SIDE, mean: float = 0.0) -> np.ndarray:
    return np.random.default_rng(0).normal(mean, sigma, (side, side))


def flat(level: float, side: int = SIDE) -> np.ndarray:
    return np.full((side, side), level)


def correlation(image: np.ndarray, dy: int, dx: int) -> float:
    z = image - image.mean()
    rows, columns = z.shape
    pairs = z[: rows - dy, : columns - dx] * z[dy:, dx:]
    return float(pairs.mean() / z.var())


CORRELATION_ERROR = 1.5 / SIDE  # 1 / sqrt(n), with room for Bartlett's factor


@pytest.mark.parametrize("fraction", [0.01, 0.05, 0.15])
@pytest.mark.parametrize("along", ["both", "rows", "columns"])
def test_crosstalk_correlates_by_its_kernel(fraction: float, along: str) -> None:
    made = apply(effect("crosstalk", fraction=fraction, along=along), white(mean=500))
    neighbours = 4 if along == "both" else 2
    own = 1 - neighbours * fraction
    norm = own**2 + neighbours * fraction**2
    expected = 2 * own * fraction / norm
    for lag, axis in (((0, 1), "rows"), ((1, 0), "columns")):
        rho = expected if along in ("both", axis) else 0.0
        assert abs(correlation(made, *lag) - rho) < Z_MAX * CORRELATION_ERROR
    assert abs(made.var() / white().var() - norm) < Z_MAX * np.sqrt(2) / SIDE
    assert made.mean() == pytest.approx(white(mean=500).mean(), abs=1e-4)  # charge is kept


@pytest.mark.parametrize("kind", ["crosstalk", "spatial_filtering"])
def test_a_single_charge_is_shared_with_its_neighbours(kind: str) -> None:
    point = np.zeros((9, 9))
    point[4, 4] = 1000.0
    expected = np.zeros((9, 9))
    expected[4, 4] = 880.0
    expected[[3, 5, 4, 4], [4, 4, 3, 5]] = 30.0
    made = apply(effect(kind, fraction=0.03), point)
    np.testing.assert_allclose(made, expected, atol=1e-3)


def test_brighter_fatter_grows_with_the_square_of_the_signal() -> None:
    per_dn = 2e-6
    deficits, covariances = [], []
    levels = np.array([1000.0, 2000.0, 4000.0, 8000.0])
    for s in levels:
        before = white(np.sqrt(s), 512, s)
        after = apply(effect("brighter_fatter", per_dn=per_dn), before)
        assert after.mean() == pytest.approx(before.mean(), rel=1e-6)  # a flat keeps its mean
        # The same noise before and after: the change is far more certain than each variance.
        deficits.append((before.var() - after.var()) / s)
        covariances.append((correlation(after, 0, 1) - correlation(before, 0, 1)) * after.var() / s)
    f = per_dn * levels
    np.testing.assert_allclose(deficits, 8 * f - 20 * f**2, rtol=SAME_NOISE)
    np.testing.assert_allclose(covariances, 2 * f - 8 * f**2, rtol=SAME_NOISE)


@pytest.mark.parametrize("cfa", [Cfa.RGGB, Cfa.MONO])
def test_spatial_filtering_couples_sites_of_one_colour(cfa: Cfa) -> None:
    step = 1 if cfa is Cfa.MONO else 2
    made = apply(
        effect("spatial_filtering", fraction=0.05),
        white(mean=500),
        grid=PixelGrid(SIDE, SIDE, cfa),
    )
    assert made.mean() == pytest.approx(white(mean=500).mean(), abs=1e-4)
    expected = 2 * 0.8 * 0.05 / (0.8**2 + 4 * 0.05**2)
    for dy, dx in ((0, step), (step, 0)):
        assert abs(correlation(made, dy, dx) - expected) < Z_MAX * CORRELATION_ERROR
    if step == 2:
        assert abs(correlation(made, 0, 1)) < Z_MAX * CORRELATION_ERROR


@pytest.mark.parametrize(("along", "lag"), [("rows", (0, 4)), ("columns", (4, 0))])
@pytest.mark.parametrize("fraction", [0.3, -0.3])
def test_readout_memory_correlates_at_its_lag_only(
    along: str, lag: tuple[int, int], fraction: float
) -> None:
    one = effect("readout_memory", fraction=fraction, lag_pixels=4, along=along)
    made = apply(one, white(mean=700.0), expected=700.0)
    assert abs(made.mean() - 700) < Z_MAX * 13 / SIDE
    for other in [(0, k) for k in range(1, 6)] + [(k, 0) for k in range(1, 6)]:
        rho = fraction / (1 + fraction**2) if other == lag else 0.0
        assert abs(correlation(made, *other) - rho) < Z_MAX * CORRELATION_ERROR, other


def test_image_lag_correlates_shot_noise_in_time_and_leaves_a_trail() -> None:
    f = 0.1
    one = camera(effect("image_lag", fraction=f), slope=4.0)
    stack = recorded(one, 2000.0, 24)
    z = stack - 2000
    rho = f * (1 - f) / ((1 - f) ** 2 + f**2)
    n = z[1:].size
    assert abs((z[1:] * z[:-1]).mean() / (z**2).mean() - rho) < Z_MAX / np.sqrt(n)
    variance = 4.0 * 2000 * ((1 - f) ** 2 + f**2) + 1 / 12
    assert abs((z**2).mean() / variance - 1) < Z_MAX * np.sqrt(2 * (1 + 2 * rho**2) / n)
    still = camera(effect("image_lag", fraction=f))
    grid = PixelGrid(4, 4, Cfa.MONO)
    dark = np.zeros((4, 4), np.float32)
    trail = still.expose(dark, Draw(1), Draw(1), 5, grid, earlier_clean=lambda k: dark + 1000 * k)
    np.testing.assert_array_equal(trail, 100.0)


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


def test_line_flicker_is_a_sinusoid_of_its_depth() -> None:
    s, depth, cycles = 3000.0, 1.0, 5.0
    one = effect("line_flicker", depth_percent=depth, cycles_per_frame=cycles)
    phases = []
    for t in range(40):
        image = apply(one, flat(s), t)
        assert np.ptp(image, axis=1).max() == 0
        power = np.fft.rfft(image[:, 0] - s)
        assert np.abs(power).argmax() == cycles
        np.testing.assert_allclose(2 * np.abs(power[5]) / SIDE, depth / 100 * s, rtol=1e-4)
        assert image[:, 0].var() == pytest.approx((depth / 100 * s) ** 2 / 2, rel=1e-4)
        phases.append(np.angle(power[5]))
    assert stats.kstest(phases, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > P_MIN


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


@given(percent=st.floats(-15, 15))
def test_nonlinearity_is_the_largest_deviation_from_the_line(percent: float) -> None:
    full_scale = WHITE_DN - BLACK_DN
    signal = np.linspace(0, full_scale, 2001)[np.newaxis]
    made = apply(effect("nonlinearity", percent_full_scale=percent), signal)[0]
    assert np.diff(made).min() > 0
    at_85 = np.interp(0.85 * full_scale, signal[0], made)
    deviation = made - signal[0] * at_85 / (0.85 * full_scale)
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


def test_readout_memory_remembers_a_shifted_mean() -> None:
    """Charge cut 100 DN below what the light gives: a tenth of it is missing once more."""
    memory = effect("readout_memory", fraction=0.1, lag_pixels=2)
    full = camera(memory, slope=0.0, intercept=4.0).model_copy(update={"saturation_dn": 900.0})
    stack = recorded(full, 1000.0, 20)
    rest = stack[:, :, 2:]
    assert abs(rest.mean() - 890) < Z_MAX * 2.1 * 1.1 / np.sqrt(rest.size)
    assert abs(stack[:, :, :2].mean() - 900) < Z_MAX * 2.1 / np.sqrt(stack[:, :, :2].size)


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


def test_pink_noise_falls_as_one_over_f_along_the_read_out() -> None:
    sigma, shape = 5.0, (128, 128)
    one = effect("pink_noise", sigma_dn=sigma)
    series = np.stack([apply(one, np.zeros(shape), t).ravel() for t in range(60)])
    power = (np.abs(np.fft.rfft(series * np.hanning(series.shape[1]))) ** 2).mean(0)
    k = np.arange(power.size)
    octaves = [(2**j, 2 ** (j + 1)) for j in range(2, 12)]
    mean_power = [power[a:b].mean() for a, b in octaves]
    centre = [1 / np.mean(1 / k[a:b]) for a, b in octaves]
    slope = np.polyfit(np.log(centre), np.log(mean_power), 1)[0]
    assert abs(slope + 1) < 0.05  # the lowest octave averages 4 bins x 60 frames: 6 %
    assert abs((series**2).mean() / sigma**2 - 1) < 0.1  # each frame mean: a tenth of the variance
    crop = apply(one, np.zeros((30, 40)), 7, grid=PixelGrid(30, 40, Cfa.MONO, 50, 60, *shape))
    np.testing.assert_array_equal(crop, series[7].reshape(shape)[50:80, 60:100])


@pytest.mark.parametrize(("u", "w"), [(17, 40), (128, 3), (0, 9)])
def test_periodic_noise_is_one_bin_of_free_phase(u: int, w: int) -> None:
    a = 3.0
    one = effect("periodic_noise", amplitude_dn=a, frequency=(u / SIDE, w / SIDE))
    phases = []
    for t in range(30):
        image = apply(one, flat(0.0), t)
        power = np.fft.fft2(image)
        assert np.unravel_index(np.abs(power).argmax(), power.shape) in {
            (w, u),
            (-w % SIDE, -u % SIDE),
        }
        phases.append(np.angle(power[w, u]))
        assert image.var() == pytest.approx(a**2 / 2, rel=1e-4)
    assert stats.kstest(phases, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > P_MIN


def test_a_bistable_pattern_has_two_states() -> None:
    one = effect("bistable_pattern", amplitude_dn=2.0, frequency=(0.5, 0.5))
    board = 2.0 * (-1.0) ** np.add.outer(np.arange(16), np.arange(16))
    signs = []
    for t in range(200):
        image = apply(one, flat(0.0, 16), t)
        sign = image[0, 0] / 2
        np.testing.assert_allclose(image, sign * board, atol=1e-5)
        signs.append(sign)
    assert abs(np.sum(signs)) < Z_MAX * np.sqrt(200)
    assert abs(np.sum(np.multiply(signs[1:], signs[:-1]))) < Z_MAX * np.sqrt(200)


@pytest.mark.parametrize(
    ("kind", "axis"), [("row_fpn", 1), ("column_fpn", 0), ("row_noise", 1), ("column_noise", 0)]
)
def test_line_patterns_are_constant_along_their_lines(kind: str, axis: int) -> None:
    image = apply(effect(kind, sigma_dn=5.0), flat(0.0, 1024))
    assert np.ptp(image, axis=axis).max() == 0
    assert stats.kstest(image.mean(axis), stats.norm(0, 5).cdf).pvalue > P_MIN


def test_dsnu_is_an_offset_and_prnu_a_gain() -> None:
    offsets = apply(effect("dsnu", sigma_dn=4.0), flat(0.0))
    np.testing.assert_allclose(
        apply(effect("dsnu", sigma_dn=4.0), flat(3000)) - 3000, offsets, atol=1e-3
    )
    assert stats.kstest(offsets.ravel(), stats.norm(0, 4).cdf).pvalue > P_MIN
    gains = apply(effect("prnu", sigma_percent=2.0), flat(1.0)) - 1
    np.testing.assert_allclose(
        apply(effect("prnu", sigma_percent=2.0), flat(3000)) / 3000 - 1, gains, atol=1e-6
    )
    assert stats.kstest(gains.ravel(), stats.norm(0, 0.02).cdf).pvalue > P_MIN


def test_shading_falls_off_towards_the_corners() -> None:
    image = apply(effect("shading", falloff_percent=20.0), np.ones((301, 401)))
    assert image[150, 200] == 1
    np.testing.assert_allclose(image[[0, 0, -1, -1], [0, -1, 0, -1]], 0.8, atol=2e-3)
    np.testing.assert_allclose(image[150, 0], 1 - 0.2 * 0.64, atol=2e-3)  # 200^2 / 250^2
    np.testing.assert_allclose(image, image[::-1, ::-1], atol=1e-6)


@pytest.mark.parametrize("place", ["top", "bottom", "left", "right", "top_left", "bottom_right"])
def test_glow_falls_off_exponentially_from_its_place(place: str) -> None:
    one = effect("amp_glow", dn_per_s=100.0, place=place, extent=0.2)
    image = apply(one, flat(0.0), time_s=2.0)
    lines = {
        "top": image[:, 7],
        "bottom": image[::-1, 7],
        "left": image[7],
        "right": image[7, ::-1],
        "top_left": image.diagonal(),
        "bottom_right": image.diagonal()[::-1],
    }
    step = np.sqrt(2) if "_" in place else 1.0
    distance = (np.arange(SIDE) + 0.5) * step
    np.testing.assert_allclose(lines[place], 200 * np.exp(-distance / (0.2 * SIDE)), rtol=1e-5)


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
