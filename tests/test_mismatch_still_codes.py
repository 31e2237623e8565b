"""Promise: where codes hardly ever move, no noise is judged: a recording of its model matches."""

from pathlib import Path

import pytest

from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.recording import Recording
from dsis.simulate import dark, flat, simulate

pytestmark = pytest.mark.usefixtures("unproven")


def recorded(
    folder: Path, cfa: Cfa, intercept: float, levels: int, seed: int = 0
) -> tuple[Camera, Recording]:
    noise = BaseNoise(segment=(Segment(slope=0.2, intercept=intercept),))
    camera = Camera(
        name="coarse", cfa=cfa, black_level=2.0, white_level=255.0, bit_depth=8, noise=noise
    )
    shots = [dark(f"dark-{k}", frames=8, exposure_time_s=0.01) for k in range(2)]
    shots += [
        flat(f"flat-{k}", 10 * 2.0**k, frames=8, exposure_time_s=0.01, light=2.0**k)
        for k in range(levels)
    ]
    return camera, simulate(camera, shots, 48, 64, folder, seed=seed)


@pytest.mark.parametrize(("read_dn", "still"), [(0.14, True), (0.3, False)])
def test_which_exposures_are_still(tmp_path: Path, read_dn: float, still: bool) -> None:
    """The black level lies amid a code: one sample in 3000 leaves it at 0.14 DN."""
    recording = recorded(tmp_path, Cfa.MONO, read_dn**2, 1)[1]
    layout = layout_of(recording, Split.of(recording).development, Source(recording).frames)
    assert layout.still == ({("dark-0", "MONO"), ("dark-1", "MONO")} if still else frozenset())


@pytest.mark.parametrize(
    ("cfa", "levels", "seed"),
    [(Cfa.MONO, 3, 0), (Cfa.MONO, 3, 3), (Cfa.RGGB, 2, 0), (Cfa.MONO, 0, 0), (Cfa.RGGB, 0, 0)],
)
def test_nothing_is_found(tmp_path: Path, cfa: Cfa, levels: int, seed: int) -> None:
    camera, recording = recorded(tmp_path, cfa, 0.02, levels, seed)
    found = find_mismatch(camera, recording, vocabulary=frozenset(), seed=seed)
    assert not found.mismatches
