"""Promise: measures of streamed frames are what plain formulas give on the whole stack in memory,
and what closed forms say of known processes."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from dsis.cfa import Cfa
from dsis.measures import (
    MEASURES,
    Accumulator,
    Channel,
    Estimate,
    Measured,
    measure,
    measure_channels,
    measure_exposure,
    response,
)

Z_MAX = 5.0
SIGMA = 6.0
# Residuals are held as float32, lag products summed by 64 in it.
RTOL = 2e-5

PLANES = {
    Cfa.RGGB: {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)},
    Cfa.BGGR: {"B": (0, 0), "Gb": (0, 1), "Gr": (1, 0), "R": (1, 1)},
    Cfa.GRBG: {"Gr": (0, 0), "R": (0, 1), "B": (1, 0), "Gb": (1, 1)},
    Cfa.GBRG: {"Gb": (0, 0), "B": (0, 1), "R": (1, 0), "Gr": (1, 1)},
}


def noise(frames: int, rows: int, columns: int, seed: int = 0) -> np.ndarray:
    return SIGMA * np.random.default_rng(seed).normal(size=(frames, rows, columns))


def recorded(signal: np.ndarray | float) -> np.ndarray:
    return np.rint(np.asarray(signal)).astype(np.uint16)


def one(stack: np.ndarray, **options: object) -> Channel:
    return measure_exposure(stack, **options).channels["MONO"]


def near(found: Estimate, truth: float) -> bool:
    return abs(found.value - truth) < Z_MAX * found.standard_error


def residual(stack: np.ndarray) -> np.ndarray:
    """Frame, row, column and pixel means taken off, written plainly."""
    z = stack.astype(np.float64)
    z = z - z.mean(0)
    return z - z.mean(2, keepdims=True) - z.mean(1, keepdims=True) + z.mean((1, 2), keepdims=True)


class TestAgainstTheStackInMemory:
    @settings(max_examples=15, deadline=None)
    @given(
        frames=st.integers(2, 7),
        rows=st.integers(4, 80),
        columns=st.integers(4, 40),
        seed=st.integers(0, 99),
    )
    def test_moments_maps_and_lags(self, frames: int, rows: int, columns: int, seed: int) -> None:
        stack = recorded(900 + noise(frames, rows, columns, seed))
        channel = one(stack)
        e = residual(stack)
        dof = (frames - 1) * (rows - 1) * (columns - 1)
        found = channel.estimates
        np.testing.assert_allclose(channel.mean_frame, stack.mean(0), rtol=1e-7)
        np.testing.assert_allclose(found["level"].value, stack.mean(), rtol=1e-9)
        np.testing.assert_allclose(found["pixel_variance"].value, (e**2).sum() / dof, rtol=RTOL)
        shares = (1 - 1 / rows) * (1 - 1 / columns) * (frames - 1)
        np.testing.assert_allclose(
            channel.variance_map, (e**2).sum(0) / shares, rtol=1e-4, atol=1e-4
        )
        np.testing.assert_allclose(channel.row_means, stack.mean(2), rtol=1e-7)
        np.testing.assert_allclose(channel.column_means, stack.mean(1), rtol=1e-7)
        np.testing.assert_allclose(channel.frame_means, stack.mean((1, 2)), rtol=1e-9)
        # Lag (1, 2): products in one channel, the bias of removed means added back.
        variance = found["pixel_variance"].value
        product = (e[:, :-1, :-2] * e[:, 1:, 2:]).sum() / ((rows - 1) * (columns - 2))
        expected = product / (frames - 1) - variance / (rows * columns)
        np.testing.assert_allclose(
            channel.temporal_autocovariance[5, 6], expected, rtol=RTOL, atol=RTOL * variance
        )
        np.testing.assert_allclose(
            channel.temporal_autocovariance, channel.temporal_autocovariance[::-1, ::-1]
        )

    def test_spectra_are_mean_periodograms(self) -> None:
        stack = recorded(900 + noise(9, 34, 29))
        z = stack - stack.mean(0)
        z = z - z.mean((1, 2), keepdims=True)
        power = (np.abs(np.fft.rfft2(z)) ** 2).sum(0) / (8 * 34 * 29)
        channel = one(stack)
        np.testing.assert_allclose(channel.power_spectrum, power, rtol=1e-3, atol=1e-4)
        lines = z.mean(2)
        power = (np.abs(np.fft.rfft(lines, axis=1)) ** 2).sum(0) / (8 * 34) * 29
        np.testing.assert_allclose(channel.row_spectrum, power, rtol=1e-6, atol=1e-9)
        full = scipy.signal.periodogram(z.mean(1), axis=1, detrend=False, return_onesided=False)[1]
        np.testing.assert_allclose(
            channel.column_spectrum, full.sum(0)[:15] * 34 / 8, rtol=1e-6, atol=1e-9
        )

    def test_shape_of_the_noise_for_many_pixels(self) -> None:
        """scipy's moments of all residuals, finite-T factors of Cramer's theorem written out."""
        t = 12
        stack = recorded(200 + 10 * np.random.default_rng(1).gamma(9.0, size=(t, 128, 96)))
        e = residual(stack).ravel()
        skew = scipy.stats.skew(e) * (1 - 1 / t) ** 1.5 / (1 - 3 / t + 2 / t**2)
        factor = ((1 - 1 / t) ** 4 + (t - 1) / t**4) / (1 - 1 / t) ** 2
        found = one(stack).estimates
        # The means of 96 columns and 128 rows keep 3/96 + 3/128 of the cube, which scipy lacks.
        assert found["skewness"].value == pytest.approx(skew, rel=0.04)
        assert found["kurtosis"].value == pytest.approx(scipy.stats.kurtosis(e) / factor, rel=0.06)
        assert near(found["skewness"], 2 / 3)
        assert near(found["kurtosis"], 6 / 9)
        within = one(stack).kurtosis_within_pixels
        plain = scipy.stats.kstat(residual(stack), 4, axis=0).mean()
        for size in (128, 96):
            plain /= (1 - 1 / size) ** 4 + (size - 1) / size**4
        assert within.value == pytest.approx(plain / found["pixel_variance"].value ** 2, rel=RTOL)
        assert near(within, 6 / 9)

    def test_pairs_are_equation_1(self) -> None:
        """Seybold et al., equation (1), for each disjoint pair of consecutive frames."""
        stack = recorded(900 + noise(7, 40, 30) + np.arange(7)[:, None, None] ** 2)
        a, b = stack[0:6:2].astype(float), stack[1:7:2].astype(float)
        pair = one(stack).pair_variance
        assert pair.pairs == 3
        d = a - b
        assert pair.uncorrected.value == pytest.approx((d**2).mean() / 2, rel=1e-9)
        assert pair.removed.value == pytest.approx((d.mean((1, 2)) ** 2).mean() / 2, rel=1e-9)
        assert pair.variance.value == pytest.approx(d.var((1, 2)).mean() / 2, rel=1e-9)

    @pytest.mark.parametrize("cfa", PLANES)
    def test_channels_of_a_mosaic_are_its_planes(self, cfa: Cfa) -> None:
        stack = recorded(900 + noise(5, 41, 34))
        found = measure_channels(stack, cfa)
        assert list(found) == ["R", "Gr", "Gb", "B"]
        for name, (y, x) in PLANES[cfa].items():
            alone = measure(stack[:, y::2, x::2])
            for measure_name in MEASURES:
                if "correlation" in measure_name and "frame" not in measure_name:
                    continue  # lags count pixels of the mosaic
                np.testing.assert_allclose(
                    found[name][measure_name].value, alone[measure_name].value, rtol=1e-4, atol=1e-6
                )
            np.testing.assert_allclose(
                found[name]["correlation_0_2"].value,
                alone["correlation_0_1"].value,
                rtol=1e-3,
                atol=1e-5,
            )

    def test_neighbours_of_other_colours_are_normalised_by_their_own_noise(self) -> None:
        e = noise(30, 60, 64)
        mixed = e.copy()
        mixed[:, 0::2, 1::2] += 0.5 * e[:, 0::2, 0::2]  # Gr takes from the R at its left
        mixed[:, 0::2, 1::2] *= 3.0
        found = measure_channels(recorded(900 + mixed), Cfa.RGGB)
        assert near(found["R"]["correlation_0_1"], 0.5 / np.hypot(1, 0.5))
        for name in ("Gr", "Gb", "B"):
            assert near(found[name]["correlation_0_1"], 0.0)

    @pytest.mark.parametrize("first", [(0, 0), (1, 0), (2, 3), (5, 1)])
    def test_a_region_is_the_cropped_recording_and_keeps_its_colours(
        self, first: tuple[int, int]
    ) -> None:
        stack = recorded(900 + noise(4, 30, 32))
        region = (slice(first[0], 26), slice(first[1], 31))
        part = measure_exposure(stack, Cfa.RGGB, region=region)
        for name, (y, x) in PLANES[Cfa.RGGB].items():
            rows = slice(first[0] + (y - first[0]) % 2, 26, 2)
            columns = slice(first[1] + (x - first[1]) % 2, 31, 2)
            np.testing.assert_allclose(
                part.channels[name].mean_frame, stack[:, rows, columns].mean(0), rtol=1e-7
            )

    def test_threads_and_number_type_change_no_bit(self) -> None:
        stack = recorded(900 + noise(5, 200, 90))
        a = measure_exposure(stack, Cfa.GBRG)
        b = measure_exposure(iter(stack.astype(np.float32)), Cfa.GBRG, threads=3)
        for name, channel in a.channels.items():
            other = b.channels[name]
            assert channel.estimates == other.estimates
            np.testing.assert_array_equal(
                channel.temporal_autocovariance, other.temporal_autocovariance
            )
            np.testing.assert_array_equal(channel.power_spectrum, other.power_spectrum)

    def test_real_frames_stream_to_what_the_stack_gives(self, shared_data: Path) -> None:
        from dsis.imagefile import oiio

        folder = shared_data / "emva1288_ccd12" / "images"
        files = sorted(folder.glob("b_s_000_snap_*.png"))
        assert len(files) == 50
        stack = np.stack(
            [oiio.ImageInput.open(str(f)).read_image(format=oiio.UINT16)[..., 0] for f in files]
        )
        assert stack.shape == (50, 480, 640)
        assert len({frame.tobytes() for frame in stack}) == 50  # no frame is a copy
        channel = one(stack, white_level=4095.0)
        e = residual(stack)
        found = channel.estimates
        assert found["pixel_variance"].value == pytest.approx(
            (e**2).sum() / (49 * 479 * 639), rel=RTOL
        )
        lag = (e[:, :, :-1] * e[:, :, 1:]).sum() / (480 * 639 * 49)
        lag = lag / found["pixel_variance"].value + (1 - 1 / 480) / 640
        # Other lags take part in the removed means: 8 of the row, below 0.01 each, of 640 columns.
        assert found["correlation_0_1"].value == pytest.approx(lag, abs=8 * 0.01 / 640)
        assert found["level"].value == pytest.approx(stack.mean(dtype=float), rel=1e-9)
        assert found["code_spacing"].value == np.gcd.reduce(np.diff(np.unique(stack)))
        codes, counts = np.unique(stack, return_counts=True)
        assert channel.codes is not None
        np.testing.assert_array_equal(channel.codes.counts[codes - channel.codes.lowest], counts)
        assert channel.clipped_low == channel.clipped_high == 0.0
        assert all(value.known for value in found.values())


class TestKnownProcesses:
    def test_base_model_is_silent(self) -> None:
        found = measure(recorded(1000 + noise(20, 96, 80)))
        assert set(found) == set(MEASURES)
        for name, value in found.items():
            if np.isfinite(value.null_value):
                assert abs(value.departure) < Z_MAX, name
        assert near(found["pixel_variance"], SIGMA**2 + 1 / 12)
        assert near(found["level"], 1000.0)

    def test_components_of_rows_columns_and_frames(self) -> None:
        rng = np.random.default_rng(3)
        t, n, m = 40, 64, 80
        z = noise(t, n, m) + 3 * rng.normal(size=(t, n, 1)) + 2 * rng.normal(size=(t, 1, m))
        z += 1.5 * rng.normal(size=(t, 1, 1))
        found = measure(recorded(1000 + z))
        for name, truth in [
            ("pixel_variance", SIGMA**2 + 1 / 12),
            ("row_variance", 9.0),
            ("column_variance", 4.0),
            ("frame_variance", 2.25),
        ]:
            assert near(found[name], truth), name
            assert found[name].departure > Z_MAX or name == "pixel_variance"

    def test_autoregression_along_rows(self) -> None:
        rho = 0.4
        e = noise(30, 60, 400)
        z = scipy.signal.lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], e, axis=2)[:, :, 100:]
        found = measure(recorded(1000 + z))
        assert near(found["correlation_0_1"], rho)
        assert near(found["correlation_0_2"], rho**2)
        assert near(found["correlation_1_0"], 0.0)
        assert near(found["correlation_1_1"], 0.0)

    def test_correlation_in_time(self) -> None:
        """A moving average over two frames: rho / (1 + rho^2) with the next, nothing beyond."""
        e = noise(13, 100, 100)
        for last in (4, 13):
            found = measure(recorded(1000 + e[1:last] + 0.3 * e[: last - 1]))
            assert near(found["frame_correlation"], 0.3 / 1.09)

    def test_a_sinusoid_stands_in_one_bin(self) -> None:
        """Power of amplitude a on N pixels: 1 + N a^2 / (4 sigma^2)."""
        t, n, m, a = 24, 64, 96, 1.0
        y, x = np.mgrid[:n, :m]
        phase = np.random.default_rng(4).uniform(0, 2 * np.pi, (t, 1, 1))
        wave = a * np.cos(2 * np.pi * (5 * y / n + 11 * x / m) + phase)
        channel = one(recorded(1000 + noise(t, n, m) + wave))
        found = channel.estimates["spectral_peak"]
        assert near(found, 1 + n * m * a**2 / 4 / (SIGMA**2 + 1 / 12))
        assert found.departure > Z_MAX
        at = np.unravel_index(channel.power_spectrum.argmax(), channel.power_spectrum.shape)
        assert at == (5, 11)

    def test_line_flicker_stands_in_the_row_spectrum(self) -> None:
        t, n, m, a = 30, 96, 64, 1.5
        phase = np.random.default_rng(5).uniform(0, 2 * np.pi, (t, 1))
        bands = a * np.cos(2 * np.pi * 4 * np.arange(n) / n + phase)
        found = measure(recorded(1000 + noise(t, n, m) + bands[:, :, None]))
        assert near(found["row_spectrum_peak"], 1 + n * m * a**2 / 4 / (SIGMA**2 + 1 / 12))
        assert near(found["row_variance"], a**2 / 2)
        assert abs(found["spectral_peak"].departure) < Z_MAX  # its axis is left out

    def test_poisson_skew_and_kurtosis(self) -> None:
        mean = 40.0
        stack = np.random.default_rng(6).poisson(mean, (8, 128, 128)).astype(np.uint16)
        found = measure(stack)
        assert near(found["skewness"], mean**-0.5)
        assert near(found["kurtosis"], 1 / mean)

    def test_two_level_pixels_spread_the_variance(self) -> None:
        """A fifth of the pixels with variance v + a^2/4 (fair coin): relative spread by hand."""
        t, n, m, share, a = 50, 128, 128, 0.2, 12.0
        rng = np.random.default_rng(7)
        jumps = a * (rng.integers(0, 2, (t, n, m)) - 0.5) * (rng.uniform(size=(n, m)) < share)
        found = measure(recorded(1000 + noise(t, n, m) + jumps))
        v, extra = SIGMA**2 + 1 / 12, a**2 / 4
        mean = v + share * extra
        between = share * (1 - share) * extra**2
        # Within a pixel: Gaussian 2 v^2 / (T-1); a coin's kurtosis is -2.
        within = share * (2 * v * 2 * extra + 2 * extra**2 - 2 * extra**2 * (t - 1) / t)
        spread = (between + (2 * v**2 + within) / (t - 1)) / mean**2
        truth = (spread - 2 / (t - 1)) / (1 + 2 / (t - 1))
        assert near(found["variance_spread"], truth)
        assert found["variance_spread"].departure > 2 * Z_MAX

    def test_pixels_that_differ_in_noise_raise_kurtosis_but_not_within_pixels(self) -> None:
        scale = np.exp(0.3 * np.random.default_rng(8).normal(size=(128, 128)))
        channel = one(recorded(1000 + noise(12, 128, 128) * scale))
        spread = np.exp(4 * 0.3**2) - 1
        assert near(channel.estimates["variance_spread"], spread)
        assert near(channel.estimates["kurtosis"], 3 * spread)
        assert near(channel.kurtosis_within_pixels, 0.0)

    def test_fixed_pattern_is_told_apart_by_shape(self) -> None:
        rng = np.random.default_rng(9)
        n, m, t = 128, 160, 10
        y, x = np.linspace(-1, 1, n)[:, None], np.linspace(-1, 1, m)
        smooth = -20 * (x**2 + y**2) / 2
        pixels, rows, columns = (
            rng.normal(size=(n, m)),
            2 * rng.normal(size=(n, 1)),
            3 * rng.normal(size=(1, m)),
        )
        found = measure(recorded(1000 + noise(t, n, m) + pixels + rows + columns + smooth))
        for name, truth in [
            ("pixel", 1.0),
            ("row", 4.0),
            ("column", 9.0),
            ("smooth", smooth.var()),
        ]:
            assert near(found[f"fixed_{name}_variance"], truth), name
        for name in ("row_variance", "column_variance", "frame_variance", "skewness"):
            assert abs(found[name].departure) < Z_MAX
        assert near(found["fixed_correlation_0_1"], 0.0)

    def test_fixed_correlation_is_diluted_by_the_noise_that_the_mean_keeps(self) -> None:
        e = np.random.default_rng(10).normal(size=(128, 129)) * 3
        pattern = (e[:, 1:] + e[:, :-1]) / np.sqrt(2)
        channel = one(recorded(1000 + noise(10, 128, 128) + pattern))
        share = 9 / (9 + (SIGMA**2 + 1 / 12) / 10)
        assert near(channel.estimates["fixed_correlation_0_1"], 0.5 * share)
        assert near(channel.estimates["fixed_correlation_1_0"], 0.0)
        assert channel.fixed_autocovariance[4, 5] == pytest.approx(4.5, rel=0.15)

    def test_temporal_correlation_leaves_no_fixed_one(self) -> None:
        e = noise(5, 128, 129)
        found = measure(recorded(1000 + e[:, :, 1:] + 0.5 * e[:, :, :-1]))
        assert near(found["fixed_correlation_0_1"], 0.0)
        assert found["correlation_0_1"].departure > Z_MAX


class TestCodes:
    @given(step=st.integers(1, 64), offset=st.integers(0, 40))
    @settings(max_examples=20, deadline=None)
    def test_spacing_is_exact(self, step: int, offset: int) -> None:
        codes = step * recorded(300 + noise(3, 20, 20)) + offset
        assert measure(codes.astype(np.float32))["code_spacing"].value == step

    def test_random_code_widths(self) -> None:
        """Edges of codes moved so that widths scatter by 5 %: what the measure must return."""
        widths = 1 + 0.05 * np.random.default_rng(11).normal(size=400)
        edges = 500.0 + np.cumsum(widths)
        z = 700 + 3 * noise(30, 128, 128)
        found = measure((500 + np.searchsorted(edges, z)).astype(np.uint16))["code_imbalance"]
        used = widths[100:300]
        assert abs(found.value - used.std()) < Z_MAX * found.standard_error
        assert found.departure > Z_MAX

    def test_missing_resolution_is_no_imbalance(self) -> None:
        codes = 4 * np.rint((1000 + 3 * noise(10, 128, 128)) / 4)
        found = measure(codes.astype(np.uint16))
        assert found["code_spacing"].value == 4
        assert abs(found["code_imbalance"].departure) < Z_MAX

    @pytest.mark.parametrize("sigma", [0.3, 1.5])
    def test_too_little_noise_tells_no_code_width(self, sigma: float) -> None:
        found = measure(recorded(1000.3 + noise(6, 64, 64) * sigma / SIGMA))["code_imbalance"]
        assert not found.known
        assert found.standard_error == np.inf

    def test_values_that_are_no_codes(self) -> None:
        found = measure((1000 + noise(4, 32, 32)).astype(np.float32))
        assert not found["code_spacing"].known
        assert not found["code_imbalance"].known
        assert found["pixel_variance"].known

    def test_clipped_shares(self) -> None:
        stack = np.clip(recorded(1000 + noise(4, 32, 32)), 995, 1004)
        channel = one(stack, white_level=1004.0, lowest_code=995.0)
        assert channel.clipped_low == (stack <= 995).mean()
        assert channel.clipped_high == (stack >= 1004).mean()
        assert not channel.estimates["code_imbalance"].known
        assert np.isnan(one(stack).clipped_high)


class TestLimits:
    def test_identical_frames_say_what_they_cannot(self) -> None:
        found = measure(np.repeat(recorded(1000 + noise(1, 32, 32)), 5, axis=0))
        assert found["pixel_variance"].value == 0.0
        assert found["level"].known
        for name in ("skewness", "kurtosis", "correlation_0_1", "spectral_peak", "variance_spread"):
            assert not found[name].known, name

    def test_two_frames_have_no_skew_and_no_correlation_in_time(self) -> None:
        found = measure(recorded(1000 + noise(2, 32, 32)))
        assert not found["skewness"].known
        assert not found["frame_correlation"].known
        assert found["kurtosis"].known

    def test_refusals(self) -> None:
        frame = recorded(1000 + noise(1, 8, 8))[0]
        with pytest.raises(ValueError, match=r"1 frame\(s\), must have at least 2"):
            measure(frame[None])
        with pytest.raises(ValueError, match="has no frames"):
            measure_exposure([])
        sums = Accumulator(8, 8)
        with pytest.raises(ValueError, match=r"frame 0 is \(7, 8\), must be \(8, 8\)"):
            sums.add(frame[1:])
        bad = frame.astype(np.float32)
        bad[3, 3] = np.nan
        with pytest.raises(ValueError, match="not finite"):
            sums.add(bad)
        with pytest.raises(ValueError, match="region"):
            Accumulator(8, 8, region=(slice(5, 5), slice(None)))
        with pytest.raises(ValueError, match="at least 2 x 2"):
            Accumulator(3, 8, Cfa.RGGB)
        with pytest.raises(ValueError, match="measure_channels"):
            measure(np.zeros((2, 8, 8), np.float32), Cfa.RGGB)


class TestResponse:
    def exposures(self, flicker: float, frames: int = 6) -> tuple[list[Measured], list[float]]:
        rng = np.random.default_rng(12)
        levels = [0.0, *np.geomspace(50, 5000, 14)]
        made = []
        for level in levels:
            light = level * (1 + flicker * rng.normal(size=(frames, 1, 1)))
            stack = recorded(500 + light + SIGMA * rng.normal(size=(frames, 24, 24)))
            made.append(measure_exposure(stack, black_level=500.0))
        return made, levels

    def test_flicker_is_found_and_enters_the_errors(self) -> None:
        made, levels = self.exposures(0.01)
        found = response(made, levels, levels)["MONO"]
        # 15 exposures of 5 degrees of freedom each give the flicker to 1/sqrt(150).
        assert found.flicker == pytest.approx(0.01, rel=Z_MAX / np.sqrt(150))
        z = (found.level_dn - found.light) / found.standard_error_dn
        assert abs((z**2).mean() - 1) < Z_MAX * np.sqrt(2 / 15)

    def test_still_light_leaves_pixel_noise(self) -> None:
        made, levels = self.exposures(0.0)
        found = response(made, levels)["MONO"]
        assert np.isnan(found.light).all()
        np.testing.assert_array_equal(found.exposure_time_s, levels)
        z = (found.level_dn - levels) / found.standard_error_dn
        assert abs((z**2).mean() - 1) < Z_MAX * np.sqrt(2 / 15)

    def test_unequal_lengths_are_refused(self) -> None:
        made, levels = self.exposures(0.0, 2)
        with pytest.raises(ValueError, match="as many of each"):
            response(made, levels[1:])
