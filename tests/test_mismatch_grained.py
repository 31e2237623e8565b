"""Grain moves lines: where neighbours along both axes share noise, lines need not move."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.grainedlines import grained, patterned

NAMES = (
    "row_variance",
    "column_variance",
    "correlation_0_1",
    "correlation_1_0",
    "correlation_0_2",
    "correlation_2_0",
)
ROWS, COLUMNS, FRAMES = 80, 100, 40
SD = 0.004


def _state(noise: Any, claimed: float, located: tuple[str, ...] = NAMES[2:]) -> Any:
    """Return a state whose numbers are those of frames, measured here; rows, say, are named."""
    mean = noise.mean(0)
    rest = noise - mean
    square = float((rest**2).mean())
    rows = rest.mean(2).var() * COLUMNS / square
    columns = rest.mean(1).var() * ROWS / square
    values = [np.cbrt(rows), np.cbrt(columns)]
    for y, x in ((0, 1), (1, 0), (0, 2), (2, 0)):
        ahead = rest[:, y:, x:] * rest[:, : ROWS - y, : COLUMNS - x]
        values.append(float(ahead.mean()) / square)
    keys = tuple(Key(name, "exposure", "flat", "MONO", "") for name in NAMES)
    expected = np.array([np.cbrt(1 + claimed), np.cbrt(1 + claimed), 0.0, 0.0, 0.0, 0.0])
    return SimpleNamespace(
        vector=SimpleNamespace(keys=keys, values=np.array(values)),
        null=SimpleNamespace(mean=expected, sd=np.full(6, SD), known=np.ones(6, bool)),
        mismatches=[SimpleNamespace(statistic=name) for name in located],
    )


WITHOUT = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])


def _grain(strength: float, seed: int) -> Any:
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((FRAMES, ROWS, COLUMNS))
    near = sum(np.roll(white, (y, x), (1, 2)) for y in (-1, 0, 1) for x in (-1, 0, 1))
    return white + strength * near


@pytest.mark.parametrize("kind", ["row_noise", "line_flicker", "row_banding", "column_noise"])
def test_grain_is_no_line_that_moves(kind: str) -> None:
    state = _state(_grain(0.1, 3), claimed=0.45)
    assert state.vector.values[0] ** 3 > 1.3  # rows do scatter more than white noise would have
    denial = grained(state, kind, WITHOUT)
    assert denial is not None
    assert "share" in denial.why


def test_lines_that_move_beyond_what_grain_does_are_believed() -> None:
    noise = _grain(0.1, 3)
    noise = noise + np.random.default_rng(4).normal(0, 0.4, (FRAMES, ROWS, 1))
    state = _state(noise, claimed=14.0)
    assert grained(state, "row_noise", WITHOUT) is None


def test_rows_that_move_alone_or_neighbours_that_are_explained_deny_nothing() -> None:
    rng = np.random.default_rng(5)
    rows = rng.standard_normal((FRAMES, ROWS, COLUMNS)) + rng.normal(0, 0.3, (FRAMES, ROWS, 1))
    assert grained(_state(rows, 9.0), "row_noise", WITHOUT) is None
    assert grained(_state(_grain(0.1, 3), 0.45, located=()), "row_noise", WITHOUT) is None
    assert grained(_state(_grain(0.1, 3), 0.45), "crosstalk", WITHOUT) is None


@pytest.mark.parametrize(
    ("along_row", "along_column", "claimed", "denied"),
    [
        (30.0, 37.0, 14.0, True),  # bars that fade in a dark
        (30.0, 37.0, 60.0, False),  # lines differ more surely than neighbours are alike
        (30.0, 2.0, 14.0, False),  # what a line has in common its pixels have
    ],
)
def test_a_pattern_of_two_dimensions_is_none_of_lines(
    along_row: float, along_column: float, claimed: float, denied: bool
) -> None:
    names = ("fixed_correlation_0_1", "fixed_correlation_1_0", "fixed_row_variance")
    keys = tuple(Key(name, "exposure", "dark", "MONO", "") for name in names)
    state: Any = SimpleNamespace(
        vector=SimpleNamespace(keys=keys, values=SD * np.array([along_row, along_column, 0.0])),
        null=SimpleNamespace(mean=np.zeros(3), sd=np.full(3, SD), known=np.ones(3, bool)),
        mismatches=[SimpleNamespace(statistic=name) for name in names[:2]],
    )
    without = np.array([0.0, 0.0, -claimed * SD])
    assert (patterned(state, "row_fpn", without) is not None) == denied
    assert patterned(state, "dsnu", without) is None
