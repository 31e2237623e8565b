"""A strong box filter in the camera is found with its diagonals; the noise is numpy's."""

import numpy as np
import pytest
from scipy.ndimage import convolve

from analysis.mismatch import find_mismatch
from mismatch_recordings import TWO_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

SHARE, FRAMES, ROWS, COLUMNS = 0.028, 8, 80, 96


def test_a_strong_kernel_of_eight_neighbours_has_diagonals() -> None:
    """Of which each gives 0.028: the pixel keeps 0.78, so that its noise is 0.8 of what it was."""
    like = recorded(camera(), 1, rows=ROWS, columns=COLUMNS, levels=TWO_LEVELS)
    rng = np.random.default_rng(4)
    kernel = np.full((3, 3), SHARE)
    kernel[1, 1] = 1 - 8 * SHARE
    stacks = {}
    for exposure in like.exposures:
        signal = exposure.light or 0.0
        noise = rng.standard_normal((FRAMES, ROWS, COLUMNS)) * np.sqrt(0.5 * signal + 20)
        seen = np.stack([convolve(one, kernel, mode="reflect") for one in noise])
        stacks[exposure.name] = np.rint(64 + signal + seen).astype(np.uint16)
    recording = InMemory(like.sensor, like.exposures, ROWS, COLUMNS, like.folder, stacks)
    words = frozenset({"spatial_filtering", "crosstalk", "readout_memory"})
    found = find_mismatch(camera(), recording, seed=1, vocabulary=words)
    (one,) = found.omitted_physics
    assert one.effect == "spatial_filtering"
    for name, expected in (("fraction", SHARE), ("diagonal", 1.0)):
        fitted = one.parameters[name]
        value, error = float(fitted.value), float(fitted.standard_error)
        assert value == pytest.approx(expected, abs=3 * error)
        assert error < 0.1 * expected
    assert not found.unexplained
