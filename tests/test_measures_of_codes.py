"""Promise: measures of codes are exact, and what frames cannot tell is said to be unknown."""

from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dsis.cfa import Cfa
from dsis.measures import Accumulator, Codes, Lattice, measure, measure_exposure
from stacks import SIGMA, Z_MAX, noise, one, recorded


class TestCodes:
    @given(step=st.integers(1, 64), offset=st.integers(0, 40))
    @settings(max_examples=20, deadline=None)
    def test_spacing_is_exact(self, step: int, offset: int) -> None:
        codes = step * recorded(300 + noise(3, 20, 20)) + offset
        assert measure(codes.astype(np.float32))["code_spacing"].value == step

    @given(step=st.integers(2, 64), offset=st.integers(0, 40))
    @settings(max_examples=20, deadline=None)
    def test_all_codes_lie_on_the_lattice(self, step: int, offset: int) -> None:
        """Of few codes the step may be a multiple; that of several places together is exact."""
        codes = step * recorded(300 + noise(3, 20, 20)) + offset
        few = [Codes.of(int(c), np.array([1])) for c in np.unique(codes)]
        few.append(Codes.of(offset, np.bincount([0, 0, 4 * step])))
        places = [own.lattice for own in few]
        assert all(own is not None for own in places)
        lattice = reduce(Lattice.joined, places)
        assert (lattice.step, lattice.phase(step)) == (step, offset % step)
        assert (codes % step == lattice.phase(step)).all()

    @pytest.mark.parametrize(("step", "phase"), [(1, 0), (6, 5), (7, 0), (8, 3)])
    def test_coarse_codes_are_clipped_at_the_steps_next_to_the_ends(
        self, step: int, phase: int
    ) -> None:
        draws = np.random.default_rng(step).normal(0, 3 * step, (4, 32, 32))
        for level in (0.0, 255.0):
            steps = np.rint((level + draws - phase) / step)
            codes = phase + step * np.clip(steps, 0, (255 - phase) // step)
            channel = one(codes, white_level=255.0, lowest_code=0.0)
            low, high = (codes == phase).mean(), (codes == codes.max()).mean()
            assert (channel.clipped_low, channel.clipped_high) == ((0, high) if level else (low, 0))

    @pytest.mark.parametrize("step", [1, 3, 8])
    def test_the_gap_of_alike_steps_is_the_step(self, step: int) -> None:
        codes = step * np.rint((1000 + 3 * step * noise(10, 64, 64) / SIGMA) / step)
        found = one(codes.astype(np.uint16)).codes
        assert found is not None
        assert found.gap == pytest.approx(step, rel=2e-3)  # a few codes far out are missed

    def test_the_gap_of_unlike_steps_is_that_around_most_samples(self) -> None:
        """Squares of whole numbers: from one to the next there are 2 n + 1 codes."""
        roots = np.rint(30 + 2 * np.random.default_rng(3).normal(size=(10, 64, 64)))
        found = one((roots**2).astype(np.uint16)).codes
        assert found is not None
        assert found.gap == pytest.approx(2 * roots.mean(), rel=0.02)

    def test_of_few_samples_a_code_no_gap_is_known(self) -> None:
        rng = np.random.default_rng(4)
        found = one(rng.normal(20000, 1500, (4, 32, 32)).round().astype(np.uint16)).codes
        assert found is not None
        assert np.isnan(found.gap)
        assert np.isnan(Codes.of(5, np.array([7])).gap)

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


def test_spikes_beside_one_code_tell_no_step() -> None:
    """A converter of steps of 8 whose noise has two codes, of which the lower may be clipped."""
    counts = np.zeros(800, np.int64)
    counts[[0, 8, 248, 760]] = [12_000, 6_500, 1, 1]
    assert np.isnan(Codes.of(112, counts).spacing().value)
    counts[[16, 24]] = [900, 3]
    assert Codes.of(112, counts).spacing().value == 8
