"""Stripes and checkerboards that are weaker than the strongest bin of chance are proposed too."""

import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of


def _striped(frequency: tuple[float, float]) -> Camera:
    return camera(registry()["bistable_pattern"](amplitude_dn=0.13, frequency=frequency))


@pytest.mark.parametrize("frequency", [(0.5, 0.0), (0.0, 0.5)])
def test_a_weak_bistable_stripe_is_located_and_proposed(frequency: tuple[float, float]) -> None:
    state = state_of(recorded(_striped(frequency), 12), camera())
    assert "alternation_variance" in {one.statistic for one in state.mismatches}
    proposed = CANDIDATES["bistable_pattern"].propose(state.clues())
    assert frequency in {one.effect.model_dump()["frequency"] for one in proposed}


def test_a_weak_bistable_checkerboard_is_named() -> None:
    found = find_mismatch(camera(), recorded(_striped((0.5, 0.5)), 12), seed=1)
    (named,) = found.omitted_physics
    assert named.effect == "bistable_pattern"
    assert named.parameters["frequency"].value == (0.5, 0.5)
    fitted = named.parameters["amplitude_dn"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - 0.13) < 4 * fitted.standard_error < 0.13
