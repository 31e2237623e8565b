"""1/f noise of a sensor that is read column by column, made here by numpy, and what is like it."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from dsis.cfa import Cfa
from mismatch_recordings import TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS = 48, 64
VOCABULARY = frozenset({"pink_noise", "column_noise", "row_noise", "black_level_drift"})
Moves = Callable[[np.random.Generator, int], NDArray[np.float64]]
"""(rng, frames) -> (frame, row, column), DN."""


def _pink(sigma: float, exponent: float) -> Moves:
    """Return noise along columns of power f^-exponent, with a gap between columns."""

    def moves(rng: np.random.Generator, frames: int) -> NDArray[np.float64]:
        gap, length = 20, 4 * (ROWS + 20) * COLUMNS
        falls = np.append(0.0, np.arange(1.0, length // 2 + 1) ** (-exponent / 2))
        parts = rng.normal(size=(2, frames, falls.size))
        series = np.fft.irfft((parts[0] + 1j * parts[1]) * falls, length)
        series = series[:, : (ROWS + gap) * COLUMNS].reshape(frames, COLUMNS, ROWS + gap)
        return sigma * series[..., :ROWS].transpose(0, 2, 1) / series.std()

    return moves


def _white(sigma: float) -> Moves:
    return lambda rng, frames: rng.normal(0, sigma, (frames, 1, COLUMNS)) * np.ones((ROWS, 1))


# Each diagnosis simulates dozens of recordings: three of them are the fewest that tell both ways.
@pytest.mark.parametrize(
    ("moves", "cfa", "expected"),
    [
        pytest.param(_pink(1.5, 1.0), Cfa.MONO, {"pink_noise": "columns"}, marks=pytest.mark.long),
        pytest.param(_pink(1.5, 0.95), Cfa.RGGB, {"pink_noise": "columns"}, marks=pytest.mark.long),
        (_white(1.0), Cfa.MONO, {"column_noise": ""}),
    ],
)
def test_noise_of_columns_is_named_by_how_it_falls(
    moves: Moves, cfa: Cfa, expected: dict[str, str]
) -> None:
    bare = camera(cfa=cfa.value)
    recording = recorded(bare, 6, rows=ROWS, columns=COLUMNS, levels=TWO_LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(2)
    for name, frames in recording.stacks.items():
        moved = frames + moves(rng, len(frames))
        recording.stacks[name] = np.clip(np.rint(moved), 0, 4095).astype(np.uint16)
    found = find_mismatch(bare, recording, vocabulary=VOCABULARY)
    named = {one.effect: one.choices.get("along", "") for one in found.omitted_physics}
    assert named == expected
