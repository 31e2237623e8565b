"""A wave that stands still nearly along an axis is no offset or gain of lines."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.waved import waved

SHAPE, NOISE = (111, 173), 0.004


def _state(
    wave: float,
    lines: float,
    seed: int,
    *,
    axis: int = 0,
    left: str = "fixed_spectral_peak",
    across_too: float = 0.0035,
) -> Any:
    """Return a state with a map of the gain that has a wave and lines along an axis."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    along, across = (x, y) if axis == 0 else (y, x)
    image = wave * np.cos(2 * np.pi * (0.1973 * along + across_too * across) + rng.uniform(0, 6))
    own = lines * rng.normal(size=SHAPE[1 - axis])
    image = image + (own if axis == 0 else own[:, np.newaxis]) + rng.normal(0, NOISE, SHAPE)
    return SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=left)],
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "gain"): (image, NOISE)})),
    )


@pytest.mark.parametrize(("kind", "axis"), [("column_prnu", 0), ("row_prnu", 1)])
@pytest.mark.parametrize("seed", range(5))
def test_a_wave_is_no_gain_of_lines(kind: str, axis: int, seed: int) -> None:
    said = waved(_state(0.002, 0.0, seed, axis=axis), kind)
    assert said is not None
    assert said.share < 0.5


@pytest.mark.parametrize("seed", range(5))
def test_gains_of_lines_beside_a_wave_are_believed(seed: int) -> None:
    assert waved(_state(0.002, 0.001, seed), "column_prnu") is None
    assert waved(_state(0.0, 0.0005, seed), "column_prnu") is None


@pytest.mark.parametrize(("wave", "lines"), [(0.003, 0.0005), (0.01, 0.001)])
@pytest.mark.parametrize("seed", range(5))
def test_however_strong_a_wave_the_other_bins_say(wave: float, lines: float, seed: int) -> None:
    assert waved(_state(wave, lines, seed), "column_prnu") is None


@pytest.mark.parametrize("seed", range(20))
def test_a_wave_across_both_axes_says_nothing_of_lines(seed: int) -> None:
    assert waved(_state(0.003, 0.0003, seed, across_too=0.27), "column_prnu") is None


def test_nothing_is_said_of_other_kinds_or_departures() -> None:
    assert waved(_state(0.002, 0.0, 0), "prnu") is None
    assert waved(_state(0.002, 0.0, 0, left="fixed_column_variance"), "column_prnu") is None
