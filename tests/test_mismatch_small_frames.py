"""Frames of few rows: they are compared, or refused in one sentence."""

import pytest

from analysis.mismatch import find_mismatch
from dsis.errors import InputError
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")


@pytest.mark.parametrize(
    ("cfa", "rows", "columns"), [("MONO", 4, 60), ("MONO", 60, 5), ("RGGB", 8, 40)]
)
def test_small_frames_of_a_right_model_match(cfa: str, rows: int, columns: int) -> None:
    own = camera(cfa=cfa)
    found = find_mismatch(own, recorded(own, 1, rows=rows, columns=columns, frames=6), seed=1)
    assert found.verdict == "match"


@pytest.mark.parametrize(
    ("cfa", "rows", "columns"), [("MONO", 3, 60), ("MONO", 60, 1), ("RGGB", 6, 40), ("GBRG", 40, 4)]
)
def test_frames_of_too_few_lines_are_refused(cfa: str, rows: int, columns: int) -> None:
    own = camera(cfa=cfa)
    with pytest.raises(InputError, match=f"frames: are of {columns} x {rows} pixels, must have"):
        find_mismatch(own, recorded(own, 1, rows=rows, columns=columns, frames=6), seed=1)
