"""Even and odd columns, or rows, read by two chains with noise of their own in each line."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.coherent import ALTERNATING, SpectrumSums
from dsis.cfa import Cfa
from dsis.measures import Accumulator
from mismatch_recordings import FEW_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES, SD = 64, 80, 8, 5.0
SURE = 5.0  # standard errors
Array = NDArray[np.float64]


def _signs(axis: str) -> Array:
    """Return what alternates along the lines of an axis: rows alternate from column to column."""
    return np.where(np.arange(COLUMNS if axis == "rows" else ROWS) % 2, -1.0, 1.0)


def _of_lines(rng: np.random.Generator, axis: str, size: float, frames: int = FRAMES) -> Array:
    """Return noise of each line of each frame that alternates along it: (frame, row, column)."""
    if axis == "rows":
        return size * rng.standard_normal((frames, ROWS, 1)) * _signs(axis)
    return size * rng.standard_normal((frames, 1, COLUMNS)) * _signs(axis)[:, np.newaxis]


@pytest.mark.parametrize("axis", ["rows", "columns"])
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_the_power_of_lines_that_alternate(axis: str, size: float) -> None:
    """1 of white noise, and of n samples a line, 1 + n (size / sd)^2: a cube root of it."""
    rng = np.random.default_rng(2)
    stack = 500 + SD * rng.standard_normal((FRAMES, ROWS, COLUMNS))
    stack += _of_lines(rng, axis, size)
    sums = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, 65535.0)
    for frame in stack:
        sums.add(np.rint(16 * frame).astype(np.uint16))
    (channel,) = sums.result().channels.values()
    found = SpectrumSums((ROWS, COLUMNS))
    found.add(channel, FRAMES, (16 * SD) ** 2, 8000.0)
    numbers = found.numbers()
    samples, lines = (COLUMNS, ROWS) if axis == "rows" else (ROWS, COLUMNS)
    # The mean square of all pixels has a share of it as well.
    expected = ((1 + samples * (size / SD) ** 2) / (1 + (size / SD) ** 2)) ** (1 / 3)
    error = (2 / ((FRAMES - 1) * (lines - 2))) ** 0.5 / 3 * expected
    assert numbers[f"{ALTERNATING} of {axis}"][0] == pytest.approx(expected, abs=SURE * error)
    other = "columns" if axis == "rows" else "rows"
    assert numbers[f"{ALTERNATING} of {other}"][0] == pytest.approx(1, abs=SURE * error / expected)


@pytest.mark.long
def test_two_chains_are_located_and_have_no_word() -> None:
    rng = np.random.default_rng(3)
    recording = recorded(camera(), 7, rows=ROWS, columns=COLUMNS, levels=FEW_LEVELS)
    assert recording.stacks is not None
    stacks = {
        name: np.clip(np.rint(frames + _of_lines(rng, "rows", 0.8, len(frames))), 0, 4095).astype(
            np.uint16
        )
        for name, frames in recording.stacks.items()
    }
    found = find_mismatch(camera(), replace(recording, stacks=stacks), seed=1)
    assert not found.omitted_physics
    assert ALTERNATING in {left.statistic for left in found.unexplained}
