"""Frames that a camera averages are no lag of charge: darks are alike, too."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

BASE = camera()
KEPT = 0.085
Array = NDArray[np.float64]


def _averaged(*, charge_alone: bool) -> InMemory:
    """Return numpy's own recording whose frames keep some of the one before, or of its charge."""
    made = recorded(BASE, 3, rows=64, columns=96, levels=FEW_LEVELS)
    rng = np.random.default_rng(4)
    stacks = {}
    for e in made.exposures:
        signal = e.light or 0.0
        shape = (len(e.frames) + 6, made.rows, made.columns)
        charge = signal + np.sqrt(0.5 * signal) * rng.standard_normal(shape)
        read = np.sqrt(20.0) * rng.standard_normal(shape)
        frames = charge if charge_alone else charge + read
        for k in range(1, shape[0]):
            frames[k] = (1 - KEPT) * frames[k] + KEPT * frames[k - 1]
        frames = frames + read if charge_alone else frames
        stacks[e.name] = np.clip(np.rint(64 + frames[6:]), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, made.rows, made.columns, made.folder, stacks)


@pytest.mark.parametrize("charge_alone", [True, pytest.param(False, marks=pytest.mark.long)])
def test_lag_is_named_where_charge_alone_stays(*, charge_alone: bool) -> None:
    found = find_mismatch(BASE, _averaged(charge_alone=charge_alone), seed=1)
    named = {one.effect for one in found.omitted_physics}
    assert ("image_lag" in named) is charge_alone
    assert ("frame_correlation" in {one.statistic for one in found.unexplained}) is not charge_alone
