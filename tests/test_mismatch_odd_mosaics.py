"""Mosaics with an odd number of rows or columns: what lies beyond the last cell is simulated."""

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.layout import Layout
from dsis.cfa import Cfa
from dsis.effects import registry
from mismatch_recordings import TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS = 65, 97


@pytest.mark.long
def test_charge_of_the_odd_last_lines_crosses_into_what_is_looked_at() -> None:
    """Without them the last lines of a cropped frame would have one neighbour less."""
    crosstalk = registry()["crosstalk"](fraction=0.04)
    bands = registry()["line_flicker"](depth_percent=1.0, cycles_per_frame=3.3)
    true = camera(crosstalk, bands, cfa="RGGB")
    recording = recorded(true, 3, rows=ROWS, columns=COLUMNS, levels=TWO_LEVELS)
    found = find_mismatch(camera(cfa="RGGB"), recording, seed=1)
    assert {own.effect for own in found.omitted_physics} == {"crosstalk", "line_flicker"}
    assert not found.unexplained
    for own in found.omitted_physics:
        for name, planted in (("fraction", 0.04), ("cycles_per_frame", 3.3)):
            fitted = own.parameters.get(name)
            if fitted is not None:
                assert isinstance(fitted.value, float)
                assert abs(fitted.value - planted) < 3.5 * fitted.standard_error


@pytest.mark.parametrize("unseen", [(0, 0), (1, 0), (1, 1)])
def test_a_layout_knows_what_is_not_looked_at(unseen: tuple[int, int]) -> None:
    layout = Layout((), 64, 96, Cfa.RGGB, 0.0, 4095.0, {}, {}, unseen=unseen)
    assert layout.grid.shape == (64 + unseen[0], 96 + unseen[1])
    frame = np.arange(np.prod(layout.grid.shape), dtype=np.float32).reshape(layout.grid.shape)
    np.testing.assert_array_equal(layout.seen(frame), frame[:64, :96])
    assert layout.seen_cycles(3.25) == pytest.approx(3.25 * 64 / (64 + unseen[0]))
    assert layout.from_edge("R", "bottom")[-1] == 1 + unseen[0]
    assert layout.from_edge("R", "left")[0] == 0
