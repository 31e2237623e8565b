"""Promise: EMVA 1288's figures lie within two of their standard errors as often as that says.

Oracle: what recordings made anew by plain numpy scatter by, of sensors made anew. There are few
levels, whose scatter about a line tells next to nothing of its error.
"""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from analysis.photon_transfer.black import dark_line, dark_shares
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.sampled import first_coefficient
from analysis.photon_transfer.statistics import LevelStatistics, expose_statistics
from dsis.cfa import Cfa
from planted_camera import Exposure, Recording, Sensor

GAIN, READ_DN, OFFSETS_DN, GAINS = 0.8, 3.0, 1.0, 0.005
LIGHTS = (100.0, 300.0, 700.0, 1400.0, 2200.0, 3000.0)  # DN, as R is 1; four below 70 %
TWO_LIGHTS = (250.0, 1000.0)  # one below 70 %: nothing scatters about a line
SIDE, FRAMES, RUNS = 64, 8, 80
TRUTH = {
    ("K", "DN/e-"): GAIN,
    ("1/K", "e-/DN"): 1 / GAIN,
    ("R", "DN/light"): 1.0,
    ("QE", "e-/light"): 1 / GAIN,
    ("sigma_y.dark", "DN"): np.hypot(READ_DN, np.sqrt(1 / 12)),
    ("sigma_d", "e-"): READ_DN / GAIN,
    ("mu_e.min", "e-"): np.hypot(READ_DN, np.sqrt(1 / 12)) / GAIN + 0.5,
    ("mu_e.sat", "e-"): LIGHTS[-1] / GAIN,
    ("SNR_max", "1"): np.sqrt(LIGHTS[-1] / GAIN),
    ("DSNU1288", "e-"): OFFSETS_DN / GAIN,
    ("PRNU1288", "%"): 100 * GAINS,
}


Found = dict[tuple[str, str], np.ndarray]


def statistics_of(
    seed: int, lights: Sequence[float], dark_times_s: Sequence[float] = (0.02,), wander: float = 0.0
) -> list[LevelStatistics]:
    """Return what a new sensor shows; the light of each exposure is off by a share `wander`."""
    draw = np.random.default_rng(seed)
    size = (FRAMES, SIDE, SIDE)
    gains = 1 + GAINS * draw.normal(size=size[1:])
    offsets = 100 + OFFSETS_DN * draw.normal(size=size[1:])
    wanted = [("dark", 0.0, s) for s in dark_times_s] + [("flat", light, 0.02) for light in lights]
    exposures = []
    for number, (kind, light, seconds) in enumerate(wanted):
        electrons = draw.poisson(light * (1 + wander * draw.normal()) / GAIN * gains, size)
        codes = np.rint(GAIN * electrons + offsets + READ_DN * draw.normal(size=size))
        stack = codes.astype(np.uint16)
        exposures.append(Exposure(f"{kind}-{number}", kind, seconds, light or None, stack))
    recording = Recording(Sensor("planted", Cfa.MONO, 100.0, 4095.0, 12), tuple(exposures))
    return [s for exposure in exposures for s in expose_statistics(recording, exposure)]


def found_in(lights: Sequence[float], **more: object) -> Found:
    """Return values and standard errors of every figure, (run, 2)."""
    rows = [
        figures_of_merit(statistics_of(seed, lights, **more))  # type: ignore[arg-type]
        for seed in range(RUNS)
    ]
    return {
        (q.name, q.unit): np.array([(row[i].value, row[i].standard_error) for row in rows], float)
        for i, q in enumerate(rows[0])
    }


def assert_covered(found: np.ndarray, truth: float) -> None:
    """The truth lies within two standard errors as often as a Gaussian does, but for chance."""
    inside = int((np.abs(found[:, 0] - truth) < 2 * found[:, 1]).sum())
    share = float(stats.chi2.cdf(4, 1))
    assert stats.binomtest(inside, len(found), share).pvalue > 1e-3, (inside, len(found))


@pytest.fixture(scope="module")
def four_levels() -> Found:
    return found_in(LIGHTS)


@pytest.mark.parametrize("key", TRUTH, ids=" ".join)
def test_four_levels_on_a_line(four_levels: Found, key: tuple[str, str]) -> None:
    found = four_levels[key]
    assert_covered(found, TRUTH[key])
    # As large as the scatter of the figure in half of recordings, where chance adds nothing to
    # sampling, and never by chance much smaller.
    spread = found[:, 0].std(ddof=1)
    sd = 1 / np.sqrt(2 * (RUNS - 1))  # of the spread, relative
    assert abs(np.quantile(found[:, 1], 0.3) / spread - 1) < 4 * sd
    assert found[:, 1].min() > (1 - 4 * sd) * spread


def test_one_level_has_the_error_of_its_samples() -> None:
    found = found_in(TWO_LIGHTS)
    for key in (("K", "DN/e-"), ("R", "DN/light"), ("QE", "e-/light"), ("sigma_d", "e-")):
        assert_covered(found[key], TRUTH[key])


def test_darks_of_three_times_leave_one_degree_of_freedom() -> None:
    """The flats' own darks lie on the line through the three, and take its errors along."""
    found = found_in(LIGHTS, dark_times_s=(0.01, 0.03, 0.05))
    for key in (("sigma_y.dark", "DN"), ("sigma_d", "e-"), ("K", "DN/e-"), ("R", "DN/light")):
        assert_covered(found[key], TRUTH[key])


def test_light_that_is_off_by_two_percent_counts_by_how_few_levels_show_it() -> None:
    found = found_in(LIGHTS, wander=0.02)
    for key in (("R", "DN/light"), ("QE", "e-/light"), ("K", "DN/e-"), ("mu_e.sat", "e-")):
        assert_covered(found[key], TRUTH[key])


def test_light_that_is_off_by_thrice_its_sampling_is_not_lost() -> None:
    found = found_in(LIGHTS, wander=0.0005)
    for key in (("R", "DN/light"), ("QE", "e-/light"), ("K", "DN/e-"), ("mu_e.sat", "e-")):
        inside = int((np.abs(found[key][:, 0] - TRUTH[key]) < 2 * found[key][:, 1]).sum())
        assert stats.binomtest(inside, RUNS, 0.89, alternative="less").pvalue > 1e-3, (key, inside)


def spread_levels(count: int) -> np.ndarray:
    return 1400 * np.arange(1, count + 1) / count


LEVELS = {
    "two": (spread_levels(2), 0.88),
    "three": (spread_levels(3), 0.90),
    "four": (spread_levels(4), 0.90),
    "four, wide": (np.array([100.0, 300.0, 700.0, 1400.0]), 0.89),
    "ten": (spread_levels(10), 0.90),
}


@pytest.mark.parametrize("like_light", [False, True], ids=["as sampling", "as light"])
@pytest.mark.parametrize("ratio", [0, 0.5, 1, 1.5, 2, 3, 5, 20])
@pytest.mark.parametrize("levels", LEVELS)
def test_scatter_of_any_size_is_covered(levels: str, ratio: float, like_light: bool) -> None:
    """No sizes of scatter fall between sampling's and what is plainly more."""
    x, least = LEVELS[levels]
    draw = np.random.default_rng(7)
    sampled = 0.01 * np.sqrt(x)
    scatter = ratio * (sampled[-1] * x / x[-1] if like_light else sampled)
    inside, runs = 0, 400
    for _ in range(runs):
        y = x + np.hypot(sampled, scatter) * draw.normal(size=x.size)
        found = first_coefficient(x[:, None], y, np.diag(sampled**2))
        inside += abs(found.value - 1) < 2 * found.standard_error
    assert stats.binomtest(inside, runs, least, alternative="less").pvalue > 1e-3, inside / runs
    assert stats.binomtest(inside, runs, 0.99, alternative="greater").pvalue > 1e-3, inside / runs


def test_errors_of_a_mean_are_those_of_textbooks() -> None:
    """Sampling alone where it explains the scatter; else Student's t of the scatter."""
    y = np.random.default_rng(5).normal(10, 3, 6)
    design = np.ones((6, 1))
    known = first_coefficient(design, y, 2 * y.var(ddof=1) * np.eye(6))
    assert known.standard_error == pytest.approx(np.sqrt(2) * stats.sem(y))
    unknown = first_coefficient(design, y, 1e-8 * np.eye(6))
    low, high = stats.t.interval(stats.chi2.cdf(4, 1), 5, y.mean(), stats.sem(y))
    assert unknown.value == pytest.approx(y.mean())
    assert 4 * unknown.standard_error == pytest.approx(high - low)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("unit", [1e-300, 1e300])
def test_units_of_light_do_not_matter(unit: float) -> None:
    x, y = np.array([1.0, 2.0, 3.0]), np.array([1.1, 1.8, 3.3])
    plain = first_coefficient(x[:, None], y, 0.01 * np.eye(3))
    found = first_coefficient(unit * x[:, None], y, 0.01 * np.eye(3))
    assert unit * found.value == pytest.approx(plain.value)
    assert unit * found.standard_error == pytest.approx(plain.standard_error)
    assert unit * found.shares == pytest.approx(plain.shares)


def test_what_each_dark_counts_is_what_it_does_to_the_line() -> None:
    draw = np.random.default_rng(6)
    for times in ((0.1, 0.2, 0.2, 0.4), (0.1, 0.2, 0.2), (0.3,)):
        levels, errors = draw.normal(100, 1, len(times)), draw.uniform(0.5, 2, len(times))
        at = [0.0, 0.15, 0.5]
        line = dark_line(times, levels.tolist(), errors.tolist())
        found = dark_shares(times, errors, at) @ levels
        assert found == pytest.approx([line.at(t) for t in at], rel=1e-12)


@pytest.mark.filterwarnings("error")
def test_a_level_that_decides_the_line_alone_has_the_error_of_its_samples() -> None:
    """Whatever a level at nought beside it shows, it does not move the slope."""
    found = first_coefficient(np.array([[0.0], [100.0]]), np.array([3.0, 50.0]), 4 * np.eye(2))
    assert (found.value, found.standard_error) == pytest.approx((0.5, 0.02))
