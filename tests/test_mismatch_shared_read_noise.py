"""Noise of the read-out that neighbours share is no filter, which smooths shot noise as well."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.sharing import shared_otherwise
from dsis.effects.spatial_filtering import SpatialFiltering
from mismatch_recordings import TWO_LEVELS, InMemory, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

FILTER = SpatialFiltering(fraction=0.01)
SIGMA_DN = 1.0


def _blocks(recording: InMemory, block: int) -> InMemory:
    """Return a recording to which each square of so many pixels adds its own offset, per frame."""
    rng, stacks = np.random.default_rng(5), dict[str, NDArray[np.uint16]]()
    for name, frames in (recording.stacks or {}).items():
        count, rows, columns = frames.shape
        offsets = SIGMA_DN * rng.standard_normal((count, -(-rows // block), -(-columns // block)))
        wide = np.repeat(np.repeat(offsets, block, 1), block, 2)[:, :rows, :columns]
        dithered = np.floor(frames + wide + rng.random(frames.shape))
        stacks[name] = dithered.clip(0, 4095).astype(np.uint16)
    return replace(recording, stacks=stacks)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_blocks_that_move_are_no_filter(cfa: str) -> None:
    recording = _blocks(recorded(camera(cfa=cfa), 2, levels=TWO_LEVELS), 4)
    without = state_of(recording, camera(cfa=cfa)).null.mean
    denial = shared_otherwise(state_of(recording, camera(FILTER, cfa=cfa)), FILTER.kind, without)
    assert denial is not None
    assert "noise of the read-out alone" in denial.why


@pytest.mark.parametrize(("cfa", "fraction"), [("MONO", 0.003), ("RGGB", 0.01)])
def test_a_filter_is_not_taken_for_them(cfa: str, fraction: float) -> None:
    true = camera(SpatialFiltering(fraction=fraction), cfa=cfa)
    recording = recorded(true, 1, levels=TWO_LEVELS)
    without = state_of(recording, camera(cfa=cfa)).null.mean
    assert shared_otherwise(state_of(recording, true), FILTER.kind, without) is None
