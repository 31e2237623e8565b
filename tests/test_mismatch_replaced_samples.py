"""Samples that a camera replaces by their neighbours' make these alike: that is no filter."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from analysis.mismatch.displaced import displaced
from mismatch_recordings import Array, InMemory, camera, recorded, state_of

SIZE, FRAMES, LEVELS = 64, 8, (300.0, 1200.0)
BLACK, SLOPE, READ = 64.0, 0.5, 9.0


def _corrected(codes: Array, limit: float) -> Array:
    """Return frames in which samples far from the median of their four neighbours are lost."""
    shifts = [np.roll(codes, s, axis) for axis in (1, 2) for s in (1, -1)]
    ordered = np.sort(np.stack(shifts), 0)
    middle = (ordered[1] + ordered[2]) / 2
    return np.where(np.abs(codes - middle) > limit, np.rint(middle), codes)


def _filtered(codes: Array) -> Array:
    return np.rint(correlate1d(codes, [0.05, 0.9, 0.05], 2))


def _state(how: str) -> Any:
    rng = np.random.default_rng(4)
    made = recorded(camera(), 4, rows=SIZE, columns=SIZE, frames=FRAMES, levels=LEVELS)
    stacks: dict[str, NDArray[np.uint16]] = {}
    for name, level in [("dark-0", 0.0), ("dark-1", 0.0), ("flat-0", 300.0), ("flat-1", 1200.0)]:
        sd = np.sqrt(READ + SLOPE * level)
        codes = np.rint(BLACK + level + sd * rng.standard_normal((FRAMES, SIZE, SIZE)))
        codes = _corrected(codes, 2.2 * sd) if how == "corrected" else _filtered(codes)
        stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    recording = InMemory(made.sensor, made.exposures, SIZE, SIZE, made.folder, stacks)
    return state_of(recording, camera(segments=((SLOPE, READ, None),)))


@pytest.mark.parametrize("how", ["corrected", "filtered"])
def test_tails_that_are_cut_off_deny_what_makes_neighbours_alike(how: str) -> None:
    state = _state(how)
    off = {m.statistic: m.z for m in state.mismatches}
    assert off["correlation_0_1"] > 10
    assert (off.get("kurtosis", 0.0) < -8) == (how == "corrected")
    for kind in ("spatial_filtering", "row_noise", "adc_dnl"):
        denial = displaced(state, kind, state.null.mean)
        cut = denial is not None and denial.why.startswith("tails are cut off")
        assert cut == (how == "corrected")
    denial = displaced(state, "prnu", state.null.mean)
    assert denial is None or not denial.why.startswith("tails are cut off")
