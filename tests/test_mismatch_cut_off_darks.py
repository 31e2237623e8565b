"""Darks whose noise is cut off at a code that is not the lowest tell no black level."""

import numpy as np
import pytest
from numpy.typing import NDArray

from dsis.measures.codes import Codes
from mismatch_recordings import InMemory, camera, recorded, state_of

LEVELS = (100.0, 400.0, 1600.0)
BLACK, SLOPE, READ = 64.0, 0.5, 6.0


def _recording(floor: float) -> InMemory:
    """Return numpy's own noise, nothing of which is below `floor`, DN."""
    rng = np.random.default_rng(1)
    made = recorded(camera(), 1, rows=48, columns=64, frames=8, levels=LEVELS)
    stacks: dict[str, NDArray[np.uint16]] = {}
    for name, level in [
        ("dark-0", 0.0),
        ("dark-1", 0.0),
        *zip(("flat-0", "flat-1", "flat-2"), LEVELS, strict=True),
    ]:
        noise = np.sqrt(READ + SLOPE * level) * rng.standard_normal((8, 48, 64))
        codes = np.rint(np.maximum(BLACK + level + noise, floor))
        stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, 48, 64, made.folder, stacks)


@pytest.mark.parametrize("floor", [0.0, BLACK])
def test_black_is_the_users_where_darks_are_cut_off(floor: float) -> None:
    """Half of normal noise of sd s that is cut off at its mean has moved it by 0.4 s."""
    state = state_of(_recording(floor), camera(segments=((SLOPE, READ, None),)))
    fit = state.calibrated.fit
    levels = state.setting.seen.levels
    cut = floor > 0
    dark = levels["dark-0", "MONO"]
    assert (dark.clipped_low > 0.4) == cut
    assert dark.level_dn == pytest.approx(0.4 * READ**0.5 if cut else 0.0, abs=0.15)
    assert fit.black_dn["MONO"] == pytest.approx(0.0, abs=0.03)
    assert np.isnan(fit.black_error_dn["MONO"]) == cut
    off = {m.statistic for m in state.mismatches}
    assert ({"level", "skewness"} <= off) == cut


@pytest.mark.parametrize("step", [1, 4])
def test_samples_piled_up_at_a_code_are_cut_off_there(step: int) -> None:
    """No normal noise has so many at its lowest code: however wide, wherever its mean."""
    rng = np.random.default_rng(2)
    for sd in (0.1, 0.3, 0.5, 1.0, 3.0, 10.0):
        for mean in (0.0, 0.3, 0.5):
            noise = np.rint(1000 + mean + sd * rng.standard_normal(20000)).astype(int) * step
            assert Codes.of(0, np.bincount(noise)).ends(0.0, 65535.0)[0] < step
            if sd > 1:
                cut = np.maximum(noise, 1000 * step)
                assert Codes.of(0, np.bincount(cut)).ends(0.0, 65535.0)[0] == 1000 * step
