"""Halves of a frame that move are no bands of rows, however long."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.linemeans import PARTS, LineMeans
from analysis.mismatch.halves import halved
from dsis.effects import registry

ROWS, FRAMES, NOISE_DN2 = 96, 12, 0.02  # of the mean of a row
HALF = np.where(np.arange(ROWS) < ROWS / 2, 1.0, -1.0)
BANDS = registry()["row_banding"](sigma_dn=1.0, length_rows=20.0)
Array = NDArray[np.float64]


def _state(moving: Any, seed: int) -> Any:
    """Return the state of three exposures whose rows move by `moving(rng)`: (row,), DN."""
    rng, lines = np.random.default_rng(seed), {}
    names = ("dark", "flat-0", "flat-1")
    for name in names:
        rows = np.stack([moving(rng) for _ in range(FRAMES)])
        rows += rng.normal(0, NOISE_DN2**0.5, rows.shape)
        parts = rows.reshape(FRAMES, PARTS, -1).mean(2)
        fixed = rows.mean(0)
        lines[name, "row"] = LineMeans(FRAMES, fixed, fixed, rows.var(0, ddof=1), NOISE_DN2, parts)
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(uniform=[SimpleNamespace(name=name) for name in names]),
            seen=SimpleNamespace(lines=lines),
        )
    )


def _halves(rng: np.random.Generator) -> Array:
    return np.asarray(HALF * rng.choice([-0.6, 0.6]) + 0.2 * rng.normal())


def _bands(length: float) -> Any:
    """Return what draws offsets whose correlation falls as exp(-d / length)."""
    stay = np.exp(-1 / length)

    def drawn(rng: np.random.Generator) -> Array:
        made = np.empty(ROWS)
        made[0] = rng.normal()
        for row in range(1, ROWS):
            made[row] = stay * made[row - 1] + (1 - stay**2) ** 0.5 * rng.normal()
        return 0.6 * made

    return drawn


@pytest.mark.parametrize("seed", range(5))
def test_halves_that_move_are_no_bands(seed: int) -> None:
    said = halved(_state(_halves, seed), BANDS)
    assert said is not None
    assert said.share < 0.05


@pytest.mark.parametrize("grows", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_frames_that_lean_have_no_bands(seed: int, *, grows: bool) -> None:
    """By more in each frame, as a sensor that warms at one side, or by chance."""
    frames = iter(np.tile(np.linspace(0, 1, FRAMES), 3))

    def leaning(rng: np.random.Generator) -> Array:
        size = next(frames) if grows else 0.5 * rng.normal()
        return np.asarray(size * np.linspace(-1, 1, ROWS) + 0.2 * rng.normal())

    said = halved(_state(leaning, seed), BANDS)
    assert said is not None
    assert "lean" in said.why


@pytest.mark.parametrize("length", [2.0, 8.0, 24.0, 48.0])
@pytest.mark.parametrize("seed", range(5))
def test_bands_are_believed_however_long(length: float, seed: int) -> None:
    assert halved(_state(_bands(length), seed), BANDS) is None


@pytest.mark.parametrize("seed", range(3))
def test_bands_are_believed_beside_frames_that_move_far(seed: int) -> None:
    bands = _bands(20.0)
    assert halved(_state(lambda rng: bands(rng) + 300.0 * rng.normal(), seed), BANDS) is None


def test_other_effects_are_not_asked() -> None:
    assert halved(_state(_halves, 0), registry()["row_noise"](sigma_dn=1.0)) is None
