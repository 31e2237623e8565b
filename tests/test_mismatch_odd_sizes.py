"""Promise: a mosaic of odd size is diagnosed as one without its last row or column, and says so."""

from pathlib import Path

import numpy as np
import pytest

from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.wholecells import whole_cells
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.recording import Recording
from dsis.simulate import dark, flat, simulate


def recorded(folder: Path, cfa: Cfa, rows: int, columns: int) -> tuple[Camera, Recording]:
    noise = BaseNoise(segment=(Segment(slope=2.0, intercept=20.0),))
    camera = Camera(
        name="odd", cfa=cfa, black_level=256.0, white_level=4095.0, bit_depth=12, noise=noise
    )
    shots = [dark("dark", frames=8, exposure_time_s=0.01)]
    shots.append(flat("flat", 400.0, frames=8, exposure_time_s=0.01, light=1.0))
    return camera, simulate(camera, shots, rows, columns, folder)


@pytest.mark.parametrize(
    ("cfa", "rows", "columns", "left"),
    [
        (Cfa.RGGB, 9, 12, (8, 12)),
        (Cfa.GBRG, 10, 13, (10, 12)),
        (Cfa.RGGB, 8, 12, (8, 12)),
        (Cfa.MONO, 9, 13, (9, 13)),
    ],
)
def test_what_is_left(
    tmp_path: Path, cfa: Cfa, rows: int, columns: int, left: tuple[int, int]
) -> None:
    recording = recorded(tmp_path, cfa, rows, columns)[1]
    taken = whole_cells(recording)
    assert (taken.rows, taken.columns) == left
    for exposure in recording.exposures:
        for one, other in zip(recording.frames(exposure), taken.frames(exposure), strict=True):
            assert np.array_equal(one[: left[0], : left[1]], other)


def test_an_odd_mosaic_is_diagnosed(tmp_path: Path) -> None:
    camera, recording = recorded(tmp_path, Cfa.BGGR, 9, 13)
    found = find_mismatch(camera, recording)
    assert not found.omitted_physics
    assert any("13 x 9 pixels" in remark for remark in found.remarks)
