"""Columns that vary alike at all frequencies are no 1/f noise; those that fall with it are."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.linemeans import line_means
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.flatcolumns import flat_columns
from analysis.mismatch.rowlaw import pink_lines
from analysis.mismatch.rowpower import Size
from dsis.cfa import Cfa
from dsis.effects import registry
from dsis.effects.pink_noise import PinkNoise
from dsis.measures import Accumulator
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES, EXPOSURES = 96, 128, 8, 4
EFFECTS = registry()


def _pink(rng: np.random.Generator, sigma: float) -> Any:
    """Return numpy's own 1/f noise in the order of columns: (frame, row, column)."""
    length = 2 * ROWS * COLUMNS
    falls = np.append(0.0, np.arange(1.0, length // 2 + 1) ** -0.5)
    parts = rng.normal(size=(2, FRAMES, falls.size))
    power = (falls[1:-1] ** 2).sum() * 2 * 2 / length**2  # of both parts, at both frequencies
    series = np.fft.irfft((parts[0] + 1j * parts[1]) * falls, length)[:, : ROWS * COLUMNS]
    return sigma * series.reshape(FRAMES, COLUMNS, ROWS).transpose(0, 2, 1) / power**0.5


def _state(seed: int, columns: float, pink: float, shape: tuple[int, int] = (ROWS, COLUMNS)) -> Any:
    rng = np.random.default_rng(seed)
    lines = {}
    for i in range(EXPOSURES):
        stack = 100 + 4.0 * rng.standard_normal((FRAMES, *shape))
        stack += columns * rng.standard_normal((FRAMES, 1, shape[1]))
        if pink:
            stack += _pink(rng, pink)
        sums = Accumulator(*shape, Cfa.MONO)
        for frame in stack:
            sums.add(np.rint(frame).astype(np.uint16))
        means = line_means(sums.result().channels, {"MONO": (0, 0)}, shape, FRAMES, "column")
        lines[f"flat-{i}", "column"] = means
    uniform = [SimpleNamespace(name=f"flat-{i}") for i in range(EXPOSURES)]
    layout = SimpleNamespace(uniform=uniform, rows=shape[0], columns=shape[1])
    return SimpleNamespace(
        setting=SimpleNamespace(layout=layout, seen=SimpleNamespace(lines=lines))
    )


def _named(sigma: float, along: str = "columns") -> PinkNoise:
    return PinkNoise(sigma_dn=sigma, along=along)  # type: ignore[arg-type] # a parameter


@pytest.mark.parametrize("sigma", [0.2, 0.4, 1.0])
def test_white_columns_deny_it(sigma: float) -> None:
    said = flat_columns(_state(1, sigma, 0.0), _named(sigma))
    assert said is not None
    assert said.share > 0.05  # no likelihood prefers what has a parameter less by much


@pytest.mark.parametrize("columns", [0.0, 0.4])
@pytest.mark.parametrize("said_of", [0.5, 1.0, 2.0])
def test_columns_that_fall_do_not_whatever_size_was_fitted(columns: float, said_of: float) -> None:
    assert flat_columns(_state(2, columns, 0.8), _named(0.8 * said_of)) is None


def test_of_rows_or_another_effect_columns_say_nothing() -> None:
    state = _state(1, 0.4, 0.0)
    assert flat_columns(state, _named(0.4, "rows")) is None
    assert flat_columns(state, EFFECTS["column_noise"](sigma_dn=0.4)) is None


def test_of_few_columns_nothing_is_said() -> None:
    assert flat_columns(_state(1, 0.4, 0.0, (96, 20)), _named(0.4)) is None


def test_covariance_of_lines_is_that_of_drawn_ones() -> None:
    rng = np.random.default_rng(4)
    means = np.concatenate([_pink(rng, 1.0).mean(1) for _ in range(400)])  # (frame, column)
    expected = pink_lines(Size(COLUMNS, ROWS))
    for apart in (0, 1, 5, 40):
        products = (means[:, apart:] * means[:, : COLUMNS - apart]).mean(1)
        error = products.std() / products.size**0.5
        assert products.mean() == pytest.approx(expected[apart], abs=5 * error)


@pytest.mark.parametrize("cfa", ["MONO", pytest.param("RGGB", marks=pytest.mark.long)])
def test_white_columns_without_their_word_stay_unexplained(cfa: str) -> None:
    hidden = EFFECTS["column_noise"](sigma_dn=0.42)
    found = find_mismatch(
        camera(cfa=cfa),
        recorded(camera(hidden, cfa=cfa), 40, rows=48, levels=(250.0, 900.0)),
        vocabulary=VOCABULARY - {"column_noise"},
    )
    assert not found.omitted_physics
    assert "column_variance" in {m.statistic for m in found.unexplained}
