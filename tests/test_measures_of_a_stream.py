"""Promise: measures of streamed frames are what plain formulas give on the stack in memory."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from dsis.cfa import Cfa
from dsis.measures import MEASURES, measure, measure_channels, measure_exposure
from stacks import near, noise, one, recorded

# Residuals are held as float32, lag products summed by 64 in it.
RTOL = 2e-5

PLANES = {
    Cfa.RGGB: {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)},
    Cfa.BGGR: {"B": (0, 0), "Gb": (0, 1), "Gr": (1, 0), "R": (1, 1)},
    Cfa.GRBG: {"Gr": (0, 0), "R": (0, 1), "B": (1, 0), "Gb": (1, 1)},
    Cfa.GBRG: {"Gb": (0, 0), "B": (0, 1), "R": (1, 0), "Gr": (1, 1)},
}


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
        correlation = channel.temporal_autocovariance / variance
        correlation[4, 4] = 0.0
        pairs = np.outer(*(n - np.abs(np.arange(-4, 5)) for n in (rows, columns)))
        chance = np.abs(correlation) * np.sqrt(np.maximum(pairs, 0) * (frames - 1))
        # A lag beyond three errors, if by chance, has its share in what the means took: not here.
        if np.nanmax(chance) < 2.5:
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
