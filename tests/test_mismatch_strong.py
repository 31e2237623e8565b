"""What is strong is fitted until nothing of it is left: a remainder is no further physics."""

import pytest

from analysis.mismatch import Finding, find_mismatch
from dsis.effects import Effect
from exposing import effect
from mismatch_recordings import FEW_LEVELS, LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

PERCENT = -2.0  # of full scale: levels depart by more than a thousand standard errors
WORDS = frozenset(
    {"nonlinearity", "adc_memory", "dual_gain", "crosstalk", "spatial_filtering", "readout_memory",
     "shading"}
)  # fmt: skip


def _found(levels: tuple[float, ...], *beside: Effect) -> Finding:
    """Return what is found of a bend, and of what is beside it."""
    bend = effect("nonlinearity", percent_full_scale=PERCENT)
    recording = recorded(camera(bend, *beside), 5, rows=64, columns=96, levels=levels)
    return find_mismatch(camera(), recording, seed=1, vocabulary=WORDS)


def test_a_strong_bend_is_fitted_until_no_level_departs() -> None:
    found = _found(FEW_LEVELS)
    (named,) = found.omitted_physics
    own = named.parameters["percent_full_scale"]
    assert named.effect == "nonlinearity"
    assert abs(own.value - PERCENT) < 3 * own.standard_error
    assert own.standard_error < 0.01
    assert not found.unexplained


@pytest.mark.long
def test_what_a_rough_fit_leaves_of_levels_is_no_residue_of_a_converter() -> None:
    """Here one of 1024 codes was named, for levels that a bend fitted roughly had left."""
    found = _found(LEVELS, effect("crosstalk", fraction=0.004))
    assert {one.effect for one in found.omitted_physics} <= {"nonlinearity", "crosstalk"}
    (own,) = (o for o in found.omitted_physics if o.effect == "nonlinearity")
    bent = own.parameters["percent_full_scale"]
    assert abs(bent.value - PERCENT) < 3 * bent.standard_error
    assert all(m.statistic != "level" for m in found.unexplained)
