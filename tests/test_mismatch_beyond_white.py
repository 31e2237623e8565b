"""Flats that the model cuts off at white, and that the recording does not."""

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

BLACK, WHITE, WELL = 64.0, 4095.0, 3800.0
SLOPE, READ = 0.5, 20.0
LEVELS = (1200.0, 2400.0, 3600.0, 4800.0)


def _recording(well: float, seed: int) -> InMemory:
    """Return numpy's own recording: charge that a full well limits, then read noise."""
    made = recorded(camera(), seed, rows=48, columns=64, frames=6, levels=LEVELS)
    assert made.stacks is not None
    rng = np.random.default_rng(seed)
    for name, frames in made.stacks.items():
        level = 0.0 if name.startswith("dark") else LEVELS[int(name[-1])]
        charge = level + np.sqrt(SLOPE * level) * rng.standard_normal(frames.shape)
        read = np.sqrt(READ) * rng.standard_normal(frames.shape)
        codes = np.rint(BLACK + np.minimum(charge, well) + read)
        made.stacks[name] = np.clip(codes, 0, WHITE).astype(np.uint16)
    return made


@pytest.mark.long
def test_light_beyond_white_that_a_full_well_keeps_below_is_a_full_well() -> None:
    """The model has every sample of the brightest flat at white: what is recorded lies below."""
    found = find_mismatch(camera(black=BLACK), _recording(WELL, 1), seed=1)
    (one,) = found.omitted_physics
    assert one.effect == "saturation"
    assert one.because == ("level",)
    told = one.parameters["full_well_dn"]
    assert abs(told.value - WELL) < 4 * told.standard_error
    assert told.standard_error < 1.0


def test_without_its_word_the_level_is_unexplained() -> None:
    left = find_mismatch(
        camera(black=BLACK), _recording(WELL, 2), seed=2, vocabulary=frozenset({"row_noise"})
    )
    assert not left.omitted_physics
    worst = max(left.unexplained, key=lambda own: abs(own.z))
    assert worst.statistic == "level"
    assert worst.where.exposures == ("flat-3",)


@pytest.mark.parametrize("seed", [3, 4])
def test_light_beyond_white_that_is_cut_off_there_is_left_out(seed: int) -> None:
    found = find_mismatch(camera(black=BLACK), _recording(1e6, seed), seed=seed)
    assert found.verdict == "match"
    assert any("flat-3" in own for own in found.remarks)
