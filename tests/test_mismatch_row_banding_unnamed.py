"""Rows that are like their neighbours where a word is missing: theirs, or a rival's."""

import pytest

from exposing import effect
from mismatch_recordings import camera
from mismatch_rows import diagnosed

pytestmark = pytest.mark.usefixtures("unproven")

ROWS = frozenset({"row_banding", "row_noise", "pink_noise", "black_level_drift"})
"""What moves whole rows: where none of it is there, other words only take time."""


@pytest.mark.parametrize("kind", ["row_noise", "crosstalk", "line_flicker"])
def test_it_takes_no_place_of_what_has_no_word(kind: str) -> None:
    values: dict[str, dict[str, float]] = {
        "row_noise": {"sigma_dn": 1.3},
        "crosstalk": {"fraction": 0.048},
        "line_flicker": {"depth_percent": 0.48, "cycles_per_frame": 2.3},
    }
    found = diagnosed(camera(effect(kind, **values[kind])), camera(), 10, ROWS - {kind})
    assert "row_banding" not in {one.effect for one in found.omitted_physics}
    assert found.unexplained


@pytest.mark.long
def test_without_its_word_its_correlation_stays_unexplained() -> None:
    true = camera(effect("row_banding", sigma_dn=1.3, length_rows=3.0))
    found = diagnosed(true, camera(), 9, ROWS - {"row_banding"} | {"crosstalk"})
    assert {one.effect for one in found.omitted_physics} <= {"row_noise"}
    assert any(m.statistic in ("row_correlation", "slow_row_variance") for m in found.unexplained)
