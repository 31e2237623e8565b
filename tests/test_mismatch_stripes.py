"""Stripes and checkerboards that are weaker than the strongest bin of chance are proposed too."""

import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")


def _striped(frequency: tuple[float, float], amplitude_dn: float = 0.13) -> Camera:
    return camera(registry()["bistable_pattern"](amplitude_dn=amplitude_dn, frequency=frequency))


@pytest.mark.parametrize("frequency", [(0.5, 0.0), (0.0, 0.5)])
def test_a_weak_bistable_stripe_is_located_and_proposed(frequency: tuple[float, float]) -> None:
    state = state_of(recorded(_striped(frequency), 12), camera())
    assert "alternation_variance" in {one.statistic for one in state.mismatches}
    proposed = CANDIDATES["bistable_pattern"].propose(state.clues())
    assert frequency in {one.effect.model_dump()["frequency"] for one in proposed}


@pytest.mark.long
def test_a_weak_bistable_checkerboard_is_named() -> None:
    true = _striped((0.5, 0.5), amplitude_dn=0.16)
    found = find_mismatch(camera(), recorded(true, 12, levels=FEW_LEVELS), seed=1)
    (named,) = found.omitted_physics
    assert named.effect == "bistable_pattern"
    assert named.parameters["frequency"].value == (0.5, 0.5)
    fitted = named.parameters["amplitude_dn"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - 0.16) < 4 * fitted.standard_error < 0.13


@pytest.mark.parametrize("cfa", ["MONO", "GRBG"])
def test_interference_along_rows_alone_is_proposed_where_it_is(cfa: str) -> None:
    # Upright stripes of free phase lie on an axis of the frequencies, which planes do not look at.
    at = 0.1371
    striped = registry()["periodic_noise"](amplitude_dn=0.5, frequency=(at, 0.0))
    state = state_of(recorded(camera(striped, cfa=cfa), 12), camera(cfa=cfa))
    assert "column_spectrum_peak" in {one.statistic for one in state.mismatches}
    proposed = CANDIDATES["periodic_noise"].propose(state.clues())
    found = [one.effect.model_dump()["frequency"] for one in proposed]
    # Of a mosaic's planes whole frames tell aliases apart.
    assert any(abs(abs(fx) - at) < 0.25 / 64 and fy == 0 for fx, fy in found)
