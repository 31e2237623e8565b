"""Noise that patches of pixels share: slow waves off the axes, summed up."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import PATCHES, SpectrumSums
from dsis.cfa import Cfa
from dsis.measures import Accumulator

Array = NDArray[np.float64]
ROWS, COLUMNS, FRAMES = 90, 117, 6
NAMES = [f"patch_variance of {size} pixels" for size in PATCHES]


def _numbers(frames: Array) -> Array:
    sums = Accumulator(ROWS, COLUMNS, Cfa.MONO, 0.0, 4095.0)
    for frame in np.rint(2000 + 20 * frames).astype(np.uint16):
        sums.add(frame)
    found = sums.result().channels["MONO"]
    whole = SpectrumSums((ROWS, COLUMNS))
    whole.add(found, FRAMES, 400.0, 1000.0)
    numbers = whole.numbers()
    values, errors = np.array([numbers[name] for name in NAMES]).T
    return np.asarray((values - 1) / errors)


def test_of_white_noise_they_scatter_as_they_say() -> None:
    rng = np.random.default_rng(1)
    scores = np.array([_numbers(rng.normal(0, 1, (FRAMES, ROWS, COLUMNS))) for _ in range(80)])
    assert (np.abs(scores.mean(0)) < 4 / 80**0.5).all()
    assert ((scores.std(0) > 0.7) & (scores.std(0) < 1.3)).all()


@pytest.mark.parametrize("block", [4, 8, 16])
def test_offsets_of_blocks_show_where_neighbours_hardly_do(block: int) -> None:
    """Offsets of 0.15 in noise of 1: neighbours correlate by 0.02."""
    rng = np.random.default_rng(block)
    cells = rng.normal(0, 0.15, (FRAMES, -(-ROWS // block), -(-COLUMNS // block)))
    offsets = cells.repeat(block, 1).repeat(block, 2)[:, :ROWS, :COLUMNS]
    scores = _numbers(rng.normal(0, 1, (FRAMES, ROWS, COLUMNS)) + offsets)
    assert scores.max() > 7


def test_lines_and_frames_that_move_are_no_patches() -> None:
    rng = np.random.default_rng(3)
    frames = rng.normal(0, 1, (FRAMES, ROWS, COLUMNS)) + rng.normal(0, 1, (FRAMES, ROWS, 1))
    frames += rng.normal(0, 1, (FRAMES, 1, COLUMNS)) + rng.normal(0, 1, (FRAMES, 1, 1))
    assert (np.abs(_numbers(frames)) < 4).all()
