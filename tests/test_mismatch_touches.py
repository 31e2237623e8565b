"""What is drawn at random for every line has no side: numbers that lean do not speak of it."""

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.touches import touched
from dsis.effects.line_fpn import ColumnFpn, RowFpn
from dsis.effects.shading import Shading
from mismatch_recordings import FEW_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

NAMES = ("fixed_row_variance", "fixed_edge", "half_seam", "fixed_smooth_tilt", "parity")
KEYS = tuple(Key(name, "offset", "", "MONO", "rows") for name in NAMES)


def test_random_lines_lean_to_no_side_and_light_does() -> None:
    row = RowFpn(sigma_dn=0.2)
    shading = Shading(falloff_percent=0.0, tilt_down_percent=1.0)
    assert touched(KEYS, [row]).tolist() == [True, False, False, False, False]
    assert touched(KEYS, [shading]).tolist() == [False, True, True, True, True]
    assert touched(KEYS, [row, shading]).all()
    assert not touched(KEYS, []).any()


@pytest.mark.long
@pytest.mark.parametrize("effect", [RowFpn(sigma_dn=0.4), ColumnFpn(sigma_dn=0.35)])
def test_weak_lines_of_a_mosaic_are_named(effect: RowFpn | ColumnFpn) -> None:
    """Whatever the few sensors lean to, by chance, that they are compared with."""
    true = camera(effect, cfa="RGGB")
    recording = recorded(true, 1, rows=64, columns=80, levels=FEW_LEVELS)
    found = find_mismatch(
        camera(cfa="RGGB"), recording, vocabulary=frozenset({"row_fpn", "column_fpn"})
    )
    assert [own.effect for own in found.omitted_physics] == [effect.kind]
    sigma = found.omitted_physics[0].parameters["sigma_dn"]
    assert abs(float(np.asarray(sigma.value)) - effect.sigma_dn) < 4 * sigma.standard_error
