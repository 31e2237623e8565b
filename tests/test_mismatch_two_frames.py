"""Series of two frames a level, as EMVA 1288 records them: many exposures tell noisy pixels."""

from typing import Any

import pytest

from analysis.mismatch import find_mismatch
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

LEVELS = tuple(float(level) for level in range(5, 65, 6))
KINDS: dict[str, dict[str, Any]] = {
    "read_noise_spread": {"log_sigma": 0.15},
    "heavy_tailed_read_noise": {"tail_df": 9},
    "rts": {"pixel_fraction": 0.01, "amplitude_dn": 12.0},
}


def _persistence(kind: str) -> float:
    recording = recorded(camera(registry()[kind](**KINDS[kind])), 5, frames=2, levels=LEVELS)
    state = state_of(recording, camera())
    left = state.null.departures(state.vector)
    keys = [key.statistic for key in state.null.keys]
    return float(left[keys.index("variance_persistence")])


def test_products_of_pairs_tell_noisy_pixels_from_tails() -> None:
    assert _persistence("read_noise_spread") > 10
    assert abs(_persistence("heavy_tailed_read_noise")) < 4


@pytest.mark.parametrize(
    "kind", [pytest.param(own, marks=[pytest.mark.long] * (own == "rts")) for own in KINDS]
)
def test_noise_of_single_pixels_is_named(kind: str) -> None:
    true = camera(registry()[kind](**KINDS[kind]))
    finding = find_mismatch(camera(), recorded(true, 6, frames=2, levels=LEVELS))
    assert [one.effect for one in finding.omitted_physics] == [kind]
