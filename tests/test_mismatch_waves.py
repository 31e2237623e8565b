"""Waves over the whole sensor, on bins and between them: found, placed, as rare as they say."""

import itertools
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm

from analysis.mismatch.bank.waves import Waves, WaveSums, _by_place
from dsis.cfa import Cfa
from dsis.measures import measure_exposure

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 48, 64, 8
SURE = 5.0  # standard errors
HALFWAY = 8 / np.pi**2  # of its power a wave keeps that lies halfway between bins
ALL = ("MONO", "R", "Gr", "Gb", "B")


def summed(
    stacks: list[Array],
    cfa: Cfa,
    shape: tuple[int, int] = (ROWS, COLUMNS),
    variances: tuple[float, ...] = (1.0,),
    *,
    keep: bool = False,
) -> WaveSums:
    step = 1 if cfa is Cfa.MONO else 2
    sums = WaveSums(shape, step)
    for stack, variance in zip(stacks, itertools.cycle(variances)):
        waves = Waves(shape, keep=keep)
        measured = measure_exposure(waves.watching(stack), cfa, 0.0, 65535.0)
        sums.add(waves, measured.channels, dict.fromkeys(ALL, variance))
    return sums


def noise(rng: np.random.Generator, shape: tuple[int, int] = (ROWS, COLUMNS)) -> Array:
    return 1000 + rng.normal(0, 1, (FRAMES, *shape))


def wave(rng: np.random.Generator, fx: float, fy: float, power: float) -> Array:
    """Return a wave of a power in a bin, white noise at 1, its phase free."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    phases = rng.uniform(0, 2 * np.pi, (FRAMES, 1, 1))
    amplitude = 2 * sqrt(power / (ROWS * COLUMNS))
    return amplitude * np.sin(2 * np.pi * (fx * x + fy * y) + phases)


def temporal(waves: Waves) -> Array:
    power = np.zeros((2, 2, ROWS, COLUMNS // 2 + 1))
    waves.add_to(power, 1.0)
    return power


def direct(stack: Array, down: float, right: float, cfa: Cfa) -> float:
    """Return the power over time at a frequency in bins, by its definition."""
    image = stack.copy()
    step = 1 if cfa is Cfa.MONO else 2
    for y in range(step):
        for x in range(step):
            image[:, y::step, x::step] -= image[:, y::step, x::step].mean((1, 2), keepdims=True)
    image -= image.mean(0)
    y, x = np.mgrid[:ROWS, :COLUMNS]
    carrier = np.exp(-2j * np.pi * (down * y / ROWS + right * x / COLUMNS))
    return float((np.abs((image * carrier).sum((1, 2))) ** 2).sum()) / (image[1:].size)


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GRBG])
@pytest.mark.parametrize("frames", [2, 3, FRAMES])
def test_power_on_bins_is_that_of_the_definition(cfa: Cfa, frames: int) -> None:
    stack = np.round(noise(np.random.default_rng(1)) * 4)[:frames]
    waves = Waves((ROWS, COLUMNS))
    list(waves.watching(stack))
    power = temporal(waves)
    for down, right in ((3, 5), (40, 17), (24, 31), (7, 32)):
        assert power[0, 0, down, right] == pytest.approx(direct(stack, down, right, cfa), rel=1e-4)


@pytest.mark.parametrize(("down", "right"), [(0, 0), (1, 0), (0, 1), (1, 1)])
def test_a_wave_halfway_between_bins_keeps_most_of_its_power(down: int, right: int) -> None:
    rng = np.random.default_rng(2)
    place = (9 + down / 2, 11 + right / 2)
    own = 1e4 * wave(rng, place[1] / COLUMNS, place[0] / ROWS, 1.0)
    waves = Waves((ROWS, COLUMNS))
    list(waves.watching(own))
    kept = temporal(waves)[down, right, 9, 11] / direct(own, *place, Cfa.MONO)
    assert kept == pytest.approx(HALFWAY ** (down + right), rel=0.01)


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_white_noise_has_one_everywhere_and_rare_peaks_rarely(cfa: Cfa, *, keep: bool) -> None:
    rng = np.random.default_rng(3)
    many = [summed([noise(rng), noise(rng)], cfa, keep=keep) for _ in range(60)]
    for down in (0, 1):
        for right in (0, 1):
            parts = [one.power[down, right, 3:-3, 3:-3] / one.weight for one in many]
            assert np.mean(parts) == pytest.approx(1, abs=0.01)
    scores = np.array([one.number()[0] for one in many])
    for score in (1.0, 1.5, 2.0, 2.5):  # of bins and three kinds of places between them together
        rare = norm.sf(score)
        assert (scores > score).mean() < rare + SURE * sqrt(rare * (1 - rare) / 60)
    assert abs(scores.mean()) < SURE / sqrt(60)  # and none of them is empty


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize(("lag", "fraction"), [(3, 0.05), (5, -0.08)])
def test_a_memory_from_one_colour_to_another_is_seen_at_its_lag(
    axis: int, lag: int, fraction: float
) -> None:
    """Noise of rows, columns, frames and alternate lines beside it is no memory."""
    rng = np.random.default_rng(11)
    stack = noise(rng)
    stack += fraction * np.roll(stack - 1000, lag, axis)
    stack += rng.normal(0, 0.5, (FRAMES, ROWS, 1)) + rng.normal(0, 0.5, (FRAMES, 1, COLUMNS))
    numbers = summed([stack], Cfa.GRBG).odd_lags()
    along = "columns" if axis == 1 else "rows"
    value, sd = numbers.pop(f"line_correlation along {along} {lag / 2:g}")
    assert value == pytest.approx(fraction, abs=SURE * sd)
    assert value / sd == pytest.approx(fraction * sqrt(stack[1:].size), rel=0.3)
    assert max(abs(rest / error) for rest, error in numbers.values()) < SURE


@pytest.mark.parametrize("frames", [2, FRAMES])
def test_all_exposures_show_a_memory_between_colours(frames: int) -> None:
    """In proportion to the noise it is alike in all: loud ones say as much as the dark."""
    rng = np.random.default_rng(14)
    fraction, stacks = 0.05, []
    for loud in (1.0, 4.0, 12.0, 30.0):
        own = loud * (noise(rng)[:frames] - 1000)
        stacks.append(2000 + own + fraction * np.roll(own, 3, 2))
    numbers = summed(stacks, Cfa.GRBG, variances=(1.0, 16.0, 144.0, 900.0)).odd_lags()
    value, sd = numbers["line_correlation along rows 1.5"]
    assert value == pytest.approx(fraction, abs=SURE * sd)
    assert sd == pytest.approx(1 / sqrt(len(stacks) * stacks[0][1:].size), rel=0.05)


def test_lags_between_colours_have_the_errors_that_they_say() -> None:
    """Colours of different noise: products of a loud and a quiet one count less."""
    rng = np.random.default_rng(12)
    loud = np.where(np.arange(ROWS)[:, np.newaxis] % 2 == 0, 2.0, 1.0) * np.where(
        np.arange(COLUMNS) % 2 == 0, 3.0, 1.0
    )
    many = [summed([1000 + loud * (noise(rng) - 1000)], Cfa.GRBG).odd_lags() for _ in range(40)]
    z = np.array([[value / sd for value, sd in one.values()] for one in many])
    for name, own in zip(many[0], z.T, strict=True):
        assert abs(own.mean()) < SURE / sqrt(len(many)), name
    assert np.mean(z**2) == pytest.approx(1, abs=SURE * sqrt(2 / z.size))


def test_a_mono_sensor_has_no_lags_between_colours() -> None:
    assert summed([noise(np.random.default_rng(1))], Cfa.MONO).odd_lags() == {}


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("uneven", ["pixel", "vignette", "middle"])
def test_noise_that_is_uneven_over_the_sensor_is_no_wave(uneven: str, *, keep: bool) -> None:
    """Between bins the middle of the sensor counts more than its edges."""
    rng = np.random.default_rng(9)
    y, x = (np.linspace(-1, 1, size) for size in (ROWS, COLUMNS))
    square = y[:, np.newaxis] ** 2 + x**2
    sd = {
        "pixel": np.ones((ROWS, COLUMNS)),
        "vignette": np.sqrt(1 - 0.45 * square),
        "middle": np.sqrt(1 + 2 * np.exp(-4 * square)),
    }[uneven]
    if uneven == "pixel":
        sd[ROWS // 2, COLUMNS // 2] = 50.0
    stacks = [1000 + sd * rng.normal(0, 1, (FRAMES, ROWS, COLUMNS)) for _ in range(6)]
    assert summed(stacks, Cfa.MONO, keep=keep).number()[0] < 4.0


@settings(max_examples=12, deadline=None)
@given(
    across=st.floats(4, 27),
    down=st.floats(4, 19),
    sign=st.sampled_from([1, -1]),
    mosaic=st.booleans(),
    keep=st.booleans(),
    seed=st.integers(0, 2**16),
)
def test_a_wave_is_found_where_it_is(
    across: float, down: float, sign: int, mosaic: bool, keep: bool, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    own = wave(rng, across / COLUMNS, sign * down / ROWS, 12.0)
    sums = summed([noise(rng) + own], Cfa.RGGB if mosaic else Cfa.MONO, keep=keep)
    assert sums.number()[0] > SURE
    peak = sums.peak()
    assert peak is not None
    found = np.array([peak.fx * COLUMNS, peak.fy * ROWS]) / sums.step
    assert found[0] == pytest.approx(across, abs=0.25 if keep else 0.4)
    # Of a mosaic a plane's frequencies go beyond half a cycle per pixel, and are not folded.
    assert found[1] == pytest.approx(sign * down, abs=0.25 if keep else 0.4)


@pytest.mark.parametrize("keep", [False, True])
def test_a_mosaic_sees_a_wave_as_clearly_as_a_mono_sensor(*, keep: bool) -> None:
    """Its channels add by amplitude: each alone has a quarter of the power."""
    rng = np.random.default_rng(4)
    own = noise(rng) + wave(rng, 0.21, 0.13, 8.0)
    mono, mosaic = (summed([own], cfa, keep=keep).number()[0] for cfa in (Cfa.MONO, Cfa.GBRG))
    assert mosaic == pytest.approx(mono, abs=0.5)


@pytest.mark.parametrize("keep", [False, True])
def test_what_rows_columns_colours_and_frames_share_is_no_wave(*, keep: bool) -> None:
    rng = np.random.default_rng(5)
    stack = noise(rng)
    stack += rng.normal(0, 1, (FRAMES, ROWS, 1)) + rng.normal(0, 1, (FRAMES, 1, COLUMNS))
    stack[:, ::2, ::2] += rng.normal(0, 3, (FRAMES, 1, 1))  # one colour's light
    stack[:, ::2] += rng.normal(0, 1, (FRAMES, 1, COLUMNS))  # columns of two colours
    assert summed([stack], Cfa.RGGB, keep=keep).number()[0] < SURE


@pytest.mark.parametrize("keep", [False, True])
def test_a_checkerboard_has_a_number_of_its_own(*, keep: bool) -> None:
    rng = np.random.default_rng(6)
    board = (-1.0) ** np.add.outer(np.arange(ROWS), np.arange(COLUMNS))
    stack = noise(rng) + 0.3 * rng.choice([-1, 1], (FRAMES, 1, 1)) * board
    sums = summed([stack], Cfa.MONO, keep=keep)
    assert sums.number()[0] < SURE
    peak = sums.peak()
    assert peak is not None
    assert (peak.fx, abs(peak.fy)) == (0.5, 0.5)


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("shape", [(15, 21), (16, 21), (15, 20), (16, 20)])
def test_odd_sensors_look_at_places_that_are_measured(
    shape: tuple[int, int], *, keep: bool
) -> None:
    rng = np.random.default_rng(7)
    sums = [summed([noise(rng, shape)], Cfa.MONO, shape, keep=keep) for _ in range(20)]
    for parts in zip(*(_by_place(one.power, one._told()) for one in sums), strict=True):
        assert np.min(parts) > 0
        assert np.mean(parts) / sums[0].weight == pytest.approx(1, abs=0.1)
    assert all(one.number()[0] < SURE for one in sums)


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("shape", [(2, 2), (4, 4), (6, 6)])
@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_the_smallest_sensors_are_no_error(shape: tuple[int, int], cfa: Cfa, *, keep: bool) -> None:
    if cfa is not Cfa.MONO and min(shape) < 4:
        return
    sums = summed([noise(np.random.default_rng(7), shape)], cfa, shape, keep=keep)
    value, _ = sums.number()
    assert np.isnan(value) or value < SURE
    sums.peak()


@pytest.mark.parametrize("keep", [False, True])
def test_frames_without_noise_say_nothing(*, keep: bool) -> None:
    sums = summed([np.full((3, ROWS, COLUMNS), 7.0)], Cfa.MONO, keep=keep)
    assert np.isnan(sums.number()[0])
    assert sums.peak() is None


@pytest.mark.parametrize("keep", [False, True])
@pytest.mark.parametrize("fy", [0.25, 0.13])
def test_a_wave_that_alternates_along_a_row_does_so_exactly(fy: float, *, keep: bool) -> None:
    rng = np.random.default_rng(8)
    peak = summed([noise(rng) + wave(rng, 0.5, fy, 12.0)], Cfa.MONO, keep=keep).peak()
    assert peak is not None
    assert peak.fx == 0.5
    assert abs(peak.fy) * ROWS == pytest.approx(fy * ROWS, abs=0.4)
