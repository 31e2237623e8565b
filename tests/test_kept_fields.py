"""Promise: a field that is kept is the field that would be made, where there is room or not."""

import numpy as np
import pytest

import dsis.draw as module
from dsis.cfa import Cfa
from dsis.draw import Draw, keep_fields
from dsis.grid import PixelGrid
from dsis.kept import Kept

GRID = PixelGrid(40, 30, Cfa.RGGB, 4, 2)


@pytest.mark.parametrize("most_bytes", [0, 4 * 40 * 30, 1 << 20])
def test_rows_of_a_kept_field_are_those_made_anew(
    monkeypatch: pytest.MonkeyPatch, most_bytes: int
) -> None:
    monkeypatch.setattr(module, "_FIELDS", Kept(0, patience=16))
    keep_fields(most_bytes)
    for frame in (1, 2, 1):
        for scope in ("a", "b"):
            draw = Draw(3).within(scope)
            rows = [draw.normal_rows("noise", GRID, frame, y, y + 10) for y in range(0, 40, 10)]
            expected = Draw(3).within(scope).normal("noise", GRID, frame)
            np.testing.assert_array_equal(np.concatenate(rows), expected)


@pytest.mark.parametrize("kind", ["normal", "uniform"])
def test_few_deviates_are_those_of_a_larger_field_and_the_callers_own(kind: str) -> None:
    """What is changed by one caller is not what the next one gets."""
    line, field = PixelGrid(3, 1000, Cfa.MONO, 4, 2), PixelGrid(30, 1000, Cfa.MONO, 4, 2)
    for frame in (0, 1):
        for scope in ("a", "b"):
            draw = getattr(Draw(3).within(scope), kind)
            expected = draw("line", field, frame)[:3]
            for _ in range(2):
                own = draw("line", line, frame)
                np.testing.assert_array_equal(own, expected)
                own[:] = 0
