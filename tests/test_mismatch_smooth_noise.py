"""Noise that varies over the sensor, smoothly or by line: located, nobody's until it has a word."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest, norm

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.persistent import BY_LINE, SURFACE, VarianceSums
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 48, 64, (12, 4, 4, 6)
Y, X = np.mgrid[-1 : 1 : ROWS * 1j, -1 : 1 : COLUMNS * 1j]
CORNERS = (Y**2 + X**2) / 2
KINDS = {  # surfaces that lean or bow; lines beyond polynomials of fourth degree
    SURFACE: 5,
    "row_variance_spread": ROWS - 5,
    "column_variance_spread": COLUMNS - 5,
}
RNG = np.random.default_rng


def _score(
    rng: np.random.Generator, variance: Array, spikes: int = 0, name: str = SURFACE
) -> float:
    """Return by how many standard deviations the variances depart from white."""
    sums = VarianceSums((ROWS, COLUMNS))
    noisy = rng.integers(0, (ROWS, COLUMNS), (spikes, 2))
    for frames in FRAMES:
        own = variance * rng.chisquare(frames - 1, (ROWS, COLUMNS)) / (frames - 1)
        own[noisy[:, 0], noisy[:, 1]] *= 300
        sums.add(own, frames - 1)
    value, sd = sums.numbers()[name]
    return (value - (1 - 2 / (9 * KINDS[name]))) / sd  # Wilson & Hilferty (1931)


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("spikes", [0, 3])
def test_white_variances_have_no_surface_and_no_lines(spikes: int, name: str) -> None:
    """Few pixels that are far noisier make none, wherever they lie."""
    scores = [_score(RNG(seed), np.ones((ROWS, COLUMNS)), spikes, name) for seed in range(400)]
    assert kstest(scores, norm.cdf).pvalue > 1e-3
    assert max(scores) < 4.5


@pytest.mark.parametrize("shape", [CORNERS, Y, X * Y])
def test_variances_that_bow_or_lean_have_one(shape: Array) -> None:
    assert all(_score(RNG(seed), 1 + 0.3 * shape) > 6 for seed in range(5))


@pytest.mark.parametrize("along", [0, 1])
def test_lines_whose_noise_differs_are_seen_and_told_from_surfaces(along: int) -> None:
    """Amplifiers of columns whose noise scatters by 5 %; of smooth ones nothing is said."""
    for seed in range(5):
        spread = 1 + 0.1 * RNG(seed + 100).standard_normal((ROWS, COLUMNS)).take([0], 1 - along)
        uneven = np.broadcast_to(spread, (ROWS, COLUMNS))
        assert _score(RNG(seed), uneven, name=BY_LINE[along]) > 8
        assert abs(_score(RNG(seed), uneven, name=BY_LINE[1 - along])) < 4
        assert abs(_score(RNG(seed), 1 + 0.3 * CORNERS, name=BY_LINE[along])) < 4


def test_of_few_lines_nothing_is_known() -> None:
    sums = VarianceSums((4, 5))
    sums.add(RNG(1).chisquare(7, (4, 5)), 7.0)
    assert not any(np.isfinite(sums.numbers()[name][0]) for name in BY_LINE)


def _risen(share: float) -> InMemory:
    """Return numpy's own recording whose read noise rises by a share to the corners."""
    made = recorded(camera(), 3, rows=64, columns=96, levels=FEW_LEVELS)
    assert made.stacks is not None
    rng = np.random.default_rng(7)
    signals = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": s for i, s in enumerate(FEW_LEVELS)}
    for name, frames in made.stacks.items():
        rows, columns = frames.shape[1:]
        y, x = np.mgrid[-1 : 1 : rows * 1j, -1 : 1 : columns * 1j]
        read = 20**0.5 * (1 + share * (y**2 + x**2) / 2)
        sd = np.sqrt(read**2 + 0.5 * signals[name])
        codes = np.rint(64 + signals[name] + sd * rng.standard_normal(frames.shape))
        made.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return made


def test_read_noise_that_rises_to_the_corners_is_located_and_has_no_name() -> None:
    found = find_mismatch(camera(), _risen(0.17))
    assert found.verdict == "unexplained"
    assert SURFACE in {m.statistic for m in found.unexplained}
    even = find_mismatch(camera(), _risen(0.0))
    assert SURFACE not in {m.statistic for m in even.unexplained}


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_shot_noise_of_uneven_light_is_explained_by_it(cfa: str) -> None:
    """At levels whose shot noise is as large as that of reading."""
    shading = registry()["shading"](falloff_percent=60.0)
    recording = recorded(camera(shading, cfa=cfa), 4, levels=(30.0, 60.0))
    without, beside = (
        {m.statistic for m in state_of(recording, camera(*own, cfa=cfa)).mismatches}
        for own in ((), (shading,))
    )
    assert SURFACE in without
    assert SURFACE not in beside
