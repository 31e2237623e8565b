"""Stripes and checkerboards that are weaker than the strongest bin of chance are proposed too."""

import pytest

from analysis.mismatch import find_mismatch
from dsis.effects import registry
from mismatch_recordings import camera, recorded


@pytest.mark.parametrize("frequency", [(0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
def test_a_weak_bistable_stripe_is_named(frequency: tuple[float, float]) -> None:
    true = camera(registry()["bistable_pattern"](amplitude_dn=0.13, frequency=frequency))
    found = find_mismatch(camera(), recorded(true, 12), seed=1)
    (named,) = found.omitted_physics
    assert named.effect == "bistable_pattern"
    assert named.parameters["frequency"].value == frequency
    fitted = named.parameters["amplitude_dn"]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - 0.13) < 4 * fitted.standard_error < 0.13
