"""Kernels that stand in for calls of numpy give the same bytes."""

import numpy as np
import pytest

from analysis.mismatch.bank.patches import SIZES, _squares
from analysis.mismatch.bank.periods import _farthest, _folded


@pytest.mark.parametrize("shape", [(24, 32), (51, 70), (17, 200), (96, 128)])
def test_patches_are_sums_of_blocks(shape: tuple[int, int]) -> None:
    pixels = np.random.default_rng(2).normal(size=shape)
    for size in SIZES:
        rows, columns = shape[0] // size, shape[1] // size
        own = pixels[: rows * size, : columns * size].reshape(rows, size, columns, size)
        assert np.isclose(_squares(pixels, size), (own.sum((1, 3)) ** 2).sum(), rtol=1e-12)


@pytest.mark.parametrize("sd", [0.1, 1.0, 30.0])
def test_few_pixels_count_as_moving_as_far_as_most(sd: float) -> None:
    rng = np.random.default_rng(3)
    for shape in ((9, 11), (48, 64), (97, 130)):
        moved = np.rint(sd * rng.normal(size=shape)).astype(np.float32)
        flat = np.abs(moved.reshape(-1)[:: max(moved.size // 4096, 1) | 1])
        far = 2.2 * float(np.quantile(flat, 0.98))
        assert _farthest(moved) == (far or np.inf)
        limit = np.float32(far / 2 or np.inf)
        clipped = np.clip(moved, -limit, limit)
        changed = not np.array_equal(moved, clipped)
        rows, columns = (size // 8 for size in shape)
        whole = clipped[: rows * 8, : columns * 8].astype(np.float64)
        cells, drawn_in = _folded(moved, limit)
        assert np.array_equal(
            cells, whole.reshape(rows, 8, columns, 8).sum((0, 2)) / (rows * columns)
        )
        assert np.array_equal(moved, clipped)
        assert drawn_in == changed
