"""Where a second gain begins: between the levels of every colour, and of the exposure left out."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.segments import _apart, second_path
from analysis.mismatch.state import State
from mismatch_recordings import InMemory, camera, recorded, setting_of

SLOPE, READ, BLACK, SECOND = 0.5, 6.0, 64.0, 220.0
SIZE, FRAMES = 64, 8


def _recording(levels: tuple[float, ...], switch: float, cfa: str, share: float) -> InMemory:
    """Return numpy's own noise; red and blue have a share of the light of green."""
    rng = np.random.default_rng(3)
    made = recorded(camera(cfa=cfa), 3, rows=SIZE, columns=SIZE, frames=FRAMES, levels=levels)
    colours = np.full((SIZE, SIZE), 1.0)
    colours[::2, ::2] = colours[1::2, 1::2] = share
    stacks: dict[str, NDArray[np.uint16]] = {}
    flats = [(f"flat-{i}", level) for i, level in enumerate(levels)]
    for name, level in [("dark-0", 0.0), ("dark-1", 0.0), *flats]:
        light = level * colours
        variance = READ + SLOPE * light + np.where(light > switch, SECOND, 0.0)
        noisy = BLACK + light + np.sqrt(variance) * rng.standard_normal((FRAMES, SIZE, SIZE))
        stacks[name] = np.clip(np.rint(noisy), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, SIZE, SIZE, made.folder, stacks)


@pytest.mark.parametrize(
    ("cfa", "share", "left_out", "gap"),
    [
        ("MONO", 1.0, None, (950, 1300)),
        ("MONO", 1.0, "flat-3", (950, 1300)),  # the first of the second gain
        ("RGGB", 0.6, None, (950, 1470)),  # 0.6 of 1300 and of 2450 lie on either side
        ("RGGB", 0.8, "flat-3", (950, 1040)),  # red of what is left out is of the second gain
    ],
)
def test_it_begins_between_the_levels_next_to_it(
    cfa: str, share: float, left_out: str | None, gap: tuple[float, float]
) -> None:
    levels = (130.0, 620.0, 950.0, 1300.0, 2450.0, 2750.0)
    recording = _recording(levels, 1000.0, cfa, share)
    setting = replace(setting_of(recording), interpolated=left_out)
    model = camera(cfa=cfa, segments=((SLOPE, READ, None),))
    path = second_path(State.of(setting, model, lambda: None))
    assert path is not None
    assert gap[0] - 5 < path.switch_dn < gap[1] + 5
    assert abs(path.switch_dn - 1000.0) < 4 * path.error_dn


def test_levels_that_are_alike_are_one() -> None:
    assert _apart([0.3, 0.0, 100.0, 101.0, 99.9, 130.0, 131.0, 400.0]) == [0.0, 99.9, 130.0, 400.0]
    assert _apart([]) == []
