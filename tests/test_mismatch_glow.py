"""Promise: how far an amplifier's glow reaches is fitted with how bright it is."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.effects import registry
from mismatch_recordings import TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

TIME_S, NOISE_DN = 0.5, 0.3
GLOW = CANDIDATES["amp_glow"]
CORNERS = {"top_left": (0, 0), "bottom_right": (63, 95), "top": (0, None), "right": (None, 95)}


def _clues(growth_dn: np.ndarray) -> Any:
    """Return a map of what grows with time, DN in the longest exposure, in two channels."""
    images = {
        channel: (growth_dn + np.random.default_rng(seed).normal(0, NOISE_DN, (64, 96)), NOISE_DN)
        for seed, channel in enumerate(("R", "B"))
    }
    images = {channel: (image - image.mean(), noise) for channel, (image, noise) in images.items()}
    return SimpleNamespace(image=lambda _: images, scale=lambda _name, _channel: TIME_S)


def _shape(place: str, extent: float) -> np.ndarray:
    y, x = np.mgrid[:64, :96]
    row, column = CORNERS[place]
    down = 0 if row is None else np.abs(y - row)
    right = 0 if column is None else np.abs(x - column)
    return np.asarray(np.exp(-np.sqrt(down**2 + right**2) / (extent * 96)))


@pytest.mark.parametrize("place", CORNERS)
@pytest.mark.parametrize("extent", [0.08, 0.15, 0.26, 0.45])
def test_a_proposal_has_the_extent_that_the_map_shows(place: str, extent: float) -> None:
    (found,) = GLOW.propose(_clues(20.0 * TIME_S * _shape(place, extent)))
    values = found.effect.model_dump()
    assert values["place"] == place
    assert values["extent"] == pytest.approx(extent, rel=0.06)
    assert values["dn_per_s"] == pytest.approx(20.0, rel=0.06)
    assert set(found.free) == {"dn_per_s", "extent"}


def test_what_is_darkest_at_an_edge_glows_from_elsewhere() -> None:
    found = GLOW.propose(_clues(-20.0 * TIME_S * _shape("top", 0.2)))
    assert found
    assert all("top" not in one.effect.model_dump()["place"] for one in found)


def test_what_is_as_good_as_the_same_everywhere_is_no_glow() -> None:
    layout: Any = None
    assert GLOW.sane(layout, registry()["amp_glow"](dn_per_s=9.0, extent=0.6))
    assert not GLOW.sane(layout, registry()["amp_glow"](dn_per_s=9.0, extent=1.5))


@pytest.mark.long
def test_brightness_and_extent_of_a_glow_are_told_within_their_errors() -> None:
    glow = {"dn_per_s": 570.0, "place": "left", "extent": 0.27}
    true = camera(registry()["amp_glow"](**glow))
    found = find_mismatch(camera(), recorded(true, 7, rows=48, levels=TWO_LEVELS), seed=3)
    (omitted,) = found.omitted_physics
    assert omitted.effect == "amp_glow"
    assert omitted.choices == {"place": "left"}
    for name in ("dn_per_s", "extent"):
        own = omitted.parameters[name]
        assert 0 < own.standard_error < 0.15 * glow[name]
        assert abs(own.value - glow[name]) < 4 * own.standard_error
