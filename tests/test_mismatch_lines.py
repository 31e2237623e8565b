"""Lines of a spectrum: which bins are separate sinusoids, and what is left without them."""

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import SpectrumSums
from analysis.mismatch.bank.lines import (
    clearest_bin,
    log_chance,
    of_colour,
    separate,
    without_lines,
)
from analysis.mismatch.bank.scalars import score_of_log
from analysis.mismatch.instance import same_line
from dsis.cfa import Cfa
from dsis.measures import Accumulator

ROWS, COLUMNS, FRAMES = 60, 80, 24
SURE, CHANCE = 5.0, 4.0
Array = NDArray[np.float64]


def frames(*waves: tuple[float, float, float], seed: int = 1) -> Array:
    """Return frames of white noise of 3 DN with waves (fx, fy, amplitude) of free phase."""
    rng = np.random.default_rng(seed)
    y, x = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    made = 100 + 3 * rng.standard_normal((FRAMES, ROWS, COLUMNS))
    for fx, fy, amplitude in waves:
        phases = 2 * np.pi * rng.random((FRAMES, 1, 1))
        made += amplitude * np.cos(2 * np.pi * (fx * x + fy * y) + phases)
    return made


def sums_of(stack: Array) -> SpectrumSums:
    accumulator = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, None)
    for frame in stack:
        accumulator.add(frame.astype(np.float32))
    channel = accumulator.result().channels["MONO"]
    sums = SpectrumSums((ROWS, COLUMNS))
    sums.add(channel, FRAMES, 9.0, 100.0)
    return sums


def ranks(stack: Array) -> list[float]:
    found = sums_of(stack).numbers()
    return [found[f"spectral_peak of rank {rank}"][0] for rank in (2, 3, 4)]


def test_each_line_is_found_strongest_first() -> None:
    waves = ((0.25, 0.25, 1.2), (0.5, 0.25, 0.6), (0.1, -0.35, 0.8))
    lines = sums_of(frames(*waves)).lines()[:3]
    for line, (fx, fy, _) in zip(lines, (waves[0], waves[2], waves[1]), strict=True):
        assert same_line((line.fx, line.fy), (fx, fy), ROWS, COLUMNS)


def test_so_many_ranks_stand_out_as_there_are_lines() -> None:
    two = ranks(frames((0.25, 0.25, 1.2), (0.1, -0.35, 0.8)))
    assert two[0] > SURE
    assert max(two[1:]) < CHANCE
    assert max(ranks(frames())) < CHANCE


def test_a_strong_line_between_bins_is_one_line() -> None:
    for seed in range(4):
        between = (10.5 / COLUMNS, 7.5 / ROWS, 12.0)
        assert max(ranks(frames(between, seed=seed))) < CHANCE


def test_the_chance_of_a_rank_is_that_of_the_binomial_law() -> None:
    bins, degrees, power = 900, 20, 1.5
    single = scipy.stats.gamma.sf(power, degrees, scale=1 / degrees)
    for rank in (1, 2, 4):
        expected = scipy.stats.binom.logsf(rank - 1, bins, single)
        assert np.isclose(log_chance(power, rank, bins, degrees), expected, rtol=1e-9)


def test_the_chance_of_what_no_float_holds_goes_on() -> None:
    for degrees in (8, 300, 20000):
        at = [1.0 + step * 8 / degrees**0.5 for step in np.arange(1, 12, 0.25)]
        found = np.array([log_chance(power, 1, 900, degrees) for power in at])
        assert np.all(np.diff(found) < 0)
        # Gamma's density falls by (d - 1) / x - 1; its tail, far out, by nearly as much.
        slopes = np.diff(found) / np.diff(at)
        middle = (np.array(at[1:]) + at[:-1]) / 2
        far = found[1:] < -100
        assert np.allclose(slopes[far], ((degrees - 1) / middle - degrees)[far], rtol=0.12)


def test_ranks_of_white_noise_are_normal_scores() -> None:
    rng = np.random.default_rng(5)
    degrees, scores = 20, []
    for _ in range(300):
        power = rng.gamma(degrees, 1 / degrees, (ROWS, COLUMNS // 2 + 1))
        bins = separate(power, COLUMNS, 1.0, 2)
        chance = log_chance(bins[1][2], 2, power[1:, 1:].size, degrees)
        scores.append(score_of_log(chance))
    assert abs(np.mean(scores)) < 4 / 300**0.5
    assert abs(np.std(scores) - 1) < 0.2


def test_lines_do_not_correlate_pixels() -> None:
    quarter = sums_of(frames((0.25, 0.25, 1.5), (0.5, 0.5, 1.5))).numbers()
    for lag in range(1, 9):
        value, sd = quarter[f"line_correlation along rows {lag}"]
        assert abs(value) < SURE * sd


def test_columns_that_move_as_a_whole_do_not_correlate_their_pixels() -> None:
    stack = frames()
    moves = np.random.default_rng(8).standard_normal((*stack.shape[:-2], 1, COLUMNS))
    found = sums_of(stack + 0.3 * stack.std() * moves).numbers()
    for lag in range(1, 9):
        value, error = found[f"line_correlation along columns {lag}"]
        assert abs(value) < SURE * error < 0.02  # columns have 0.08 of the variance


def test_a_memory_stays_in_the_correlations() -> None:
    stack = frames()
    memory = stack - 100
    for x in range(4, COLUMNS):
        memory[..., x] += 0.1 * memory[..., x - 4]
    value, sd = sums_of(memory).numbers()["line_correlation along rows 4"]
    plain = float((memory[..., 4:] * memory[..., :-4]).mean() / memory.var())
    assert value > 10 * sd
    assert abs(value - plain) < 0.02  # row means are taken off, ends are joined


def test_a_smooth_spectrum_stays_as_it_is() -> None:
    rng = np.random.default_rng(2)
    across = 1 + 0.6 * np.cos(2 * np.pi * 2 * np.arange(COLUMNS // 2 + 1) / COLUMNS)
    power = rng.gamma(FRAMES, 1 / FRAMES, (ROWS, COLUMNS // 2 + 1)) * across
    kept = without_lines(power, FRAMES)
    assert np.mean(kept == power) > 0.999
    power[12, 9] *= 8
    assert without_lines(power, FRAMES)[12, 9] < 0.3 * power[12, 9]


def test_a_line_in_coloured_noise_is_seen_and_colour_is_none() -> None:
    """Powers of 60 frames, by 1 / f and a Lorentzian; a line twice as large as what is there."""
    rng = np.random.default_rng(4)
    bins = np.arange(1, 108)
    for shape in (1 / bins, 1 / (1 + (bins / 20) ** 2), np.ones(107)):
        scores, seen = [], []
        for _ in range(60):
            power = (0.3 + shape) * rng.gamma(60, 1 / 60, 107)
            scores.append(of_colour(power, 60.0)[0])
            power[70] *= 3
            seen.append(of_colour(power, 60.0)[0])
            assert clearest_bin(power, 60.0) == 70
        assert np.mean(scores) < 0.6
        assert np.std(scores) < 1.3
        assert max(scores) < 4
        assert min(seen) > 2
        assert np.median(seen) > 4


def test_the_largest_is_clearest_where_none_stands_out() -> None:
    power = 1 / np.arange(1.0, 60.0)
    assert clearest_bin(power, 40.0) == 0
    assert clearest_bin(np.ones(5), 40.0) == 0  # too few to have neighbours
    assert not np.isfinite(of_colour(np.ones(5), 40.0)[0])
