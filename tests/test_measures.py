"""Promise: measures return the numbers of processes whose truth is known in closed form."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from dsis.measures import MEASURES, Measured, measure, measure_exposure, response
from stacks import SIGMA, Z_MAX, near, noise, one, recorded


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
