"""Lines at multiples of an eighth of a cycle per pixel: few, and known whatever a sensor's size."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.periods import Periods, PeriodSums
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import TWO_LEVELS, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
FRAMES = 9
AT = (0.125, 0.5)


def _sums(frames: Array, step: int = 1, variance: float = 1.0) -> PeriodSums:
    seen = Periods()
    list(seen.watching(iter(frames)))
    sums = PeriodSums(frames[0].shape, step)
    sums.add(seen, variance, variance)
    return sums


def _white(rng: np.random.Generator, shape: tuple[int, int]) -> Array:
    return rng.normal(0, 1, (FRAMES, *shape))


def test_cells_have_the_power_of_frames_at_their_frequencies() -> None:
    """Of whole cells, by a sum over all pixels."""
    frames = np.random.default_rng(1).uniform(-1, 1, (FRAMES, 43, 50))  # none is far out
    seen = Periods()
    list(seen.watching(iter(frames)))
    inner = frames[:, :40, :48] - frames[:, :40, :48].mean(0)
    y, x = np.mgrid[:40, :48]
    for v, u in ((1, 3), (4, 1), (5, 6)):
        wave = np.exp(-2j * np.pi * (v * y + u * x) / 8)
        expected = (np.abs((inner * wave).sum((1, 2))) ** 2).sum() / 30**2  # of means over 30 cells
        assert seen.power()[v, u] == pytest.approx(expected)


@pytest.mark.parametrize(("shape", "step"), [((64, 72), 1), ((67, 77), 1), ((64, 72), 2)])
def test_scores_of_white_noise_are_those_of_a_normal_variate(
    shape: tuple[int, int], step: int
) -> None:
    rng = np.random.default_rng([*shape, step])
    scores = [_sums(_white(rng, shape), step).number()[0] for _ in range(400)]
    assert kstest(scores, "norm").pvalue > 1e-3


@pytest.mark.parametrize("shape", [(64, 72), (67, 77)])
def test_a_pattern_of_eight_pixels_is_found_where_it_is(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]]
    wave = np.cos(2 * np.pi * (AT[0] * x + AT[1] * y) + 0.4)
    powers = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        signs = 0.07 * np.repeat([-1.0, 1.0, -1.0], 3)[:, np.newaxis, np.newaxis]
        sums = _sums(_white(rng, shape) + signs * wave)
        assert sums.number()[0] > 3
        peak = sums.peak()
        assert peak is not None
        assert (abs(peak.fx), abs(peak.fy)) == AT
        powers.append(peak.power - 1)
    # A cosine of amplitude a has a^2 N / 4 beside noise of 1; signs of a mean of -1/3 lose a ninth,
    # and 9 / 8 is gained by the mean that is off.
    whole = (shape[0] // 8 * 8) * (shape[1] // 8 * 8)
    assert np.mean(powers) == pytest.approx(0.07**2 * whole / 4, rel=0.15)


def test_what_rows_and_columns_have_in_common_is_no_pattern_of_pixels() -> None:
    rng = np.random.default_rng(4)
    frames = _white(rng, (67, 77)) + rng.normal(0, 1, (FRAMES, 67, 1))
    frames += rng.normal(0, 1, (FRAMES, 1, 77))
    assert abs(_sums(frames).number()[0]) < 3.5


def _striped(amplitude: float) -> Camera:
    return camera(registry()["bistable_pattern"](amplitude_dn=amplitude, frequency=AT))


def _state(seed: int) -> State:
    return state_of(recorded(_striped(0.14), seed, rows=97), camera())


def test_it_is_located_where_no_bin_of_a_spectrum_is() -> None:
    """Of 97 rows half a cycle per pixel lies between bins, and one of so many stands out less."""
    scores: list[tuple[float, float]] = []
    for seed in (1, 2, 3):
        (pooled,) = _state(seed).setting.seen.pooled.values()
        names = ("spectral_peak of few pixels", "spectral_peak")
        few, all_of_them = (pooled[name][0] for name in names)
        scores.append((few, all_of_them))
    assert np.median([few for few, _ in scores]) > 4
    assert np.mean([few - other for few, other in scores]) > 1


@pytest.mark.long
def test_a_weak_pattern_of_eight_pixels_is_named_with_its_size() -> None:
    found = find_mismatch(
        camera(), recorded(_striped(0.21), 12, rows=97, levels=TWO_LEVELS), seed=1
    )
    (named,) = found.omitted_physics
    assert named.effect == "bistable_pattern"
    frequency = named.parameters["frequency"].value
    assert isinstance(frequency, tuple)
    assert tuple(map(abs, frequency)) == AT
    fitted = named.parameters["amplitude_dn"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - 0.21) < 4 * fitted.standard_error < 0.17


def test_few_pixels_that_jump_far_hide_no_pattern() -> None:
    """Of 0.2 %, by 100 standard deviations: their squares are twenty times those of all others."""
    rng = np.random.default_rng(6)
    y, x = np.mgrid[:67, :77]
    wave = 0.07 * np.cos(2 * np.pi * (AT[0] * x + AT[1] * y))
    frames = _white(rng, (67, 77)) + rng.choice([-1.0, 1.0], (FRAMES, 1, 1)) * wave
    frames[:, rng.random((67, 77)) < 0.002] *= 100
    assert _sums(frames, variance=float(frames.var())).number()[0] > 3
