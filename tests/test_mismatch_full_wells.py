"""Flats that are brighter than a full well: they say the full well, and nothing of gains."""

from typing import Any

import numpy as np
import pytest

from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.prove.virtual import virtual_sensor
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.camera import Camera
from dsis.effects import Effect, registry
from dsis.effects.saturation import Saturation
from mismatch_recordings import InMemory, camera, held_of, recorded

pytestmark = pytest.mark.usefixtures("unproven")

SIDE, FRAMES, FULL = 64, 8, 2000.3
LEVELS = (100.0, 300.0, 600.0, 1000.0, 1500.0, 2600.0, 5000.0)  # the last one is above white
ROW_PERCENT = 0.3


def filled(*, rows: float = ROW_PERCENT, full: float = FULL) -> InMemory:
    """Return numpy's own recording: gains of rows, shot noise of slope 0.5, then a full well."""
    rng = np.random.default_rng(4)
    made = recorded(camera(), 1, rows=SIDE, columns=SIDE, frames=FRAMES, levels=LEVELS)
    gains = 1 + rows / 100 * rng.standard_normal((SIDE, 1))
    stacks = {}
    flats = {f"flat-{i}": level for i, level in enumerate(LEVELS)}
    for name, level in ({"dark-0": 0.0, "dark-1": 0.0} | flats).items():
        light = level * gains + np.sqrt(0.5 * level) * rng.standard_normal((FRAMES, SIDE, SIDE))
        noisy = 64.0 + np.minimum(light, full) + np.sqrt(20.0) * rng.standard_normal(light.shape)
        stacks[name] = np.clip(np.rint(noisy), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, SIDE, SIDE, made.folder, stacks)


@pytest.mark.parametrize(("full", "names"), [(FULL, {"flat-5", "flat-6"}), (3900.0, {"flat-6"})])
def test_which_flats_are_full(full: float, names: set[str]) -> None:
    recording = filled(full=full)
    layout = layout_of(recording, Split.of(recording).development, Source(recording).frames)
    assert layout.full == {(name, "MONO") for name in names}


@pytest.mark.parametrize(
    "true",
    [
        camera(),
        camera(registry()["flicker"](sigma_percent=5.0)),
        camera(registry()["black_level_drift"](sigma_dn=20.0)),
        camera(segments=((2.0, 20.0, 1200.0), (0.3, 10.0, None))),
    ],
    ids=["plain", "flicker", "drift", "quieter path"],
)
def test_flats_that_are_not_full_keep_their_say(true: Camera) -> None:
    """The last one: noise falls where another read-out path begins, and grows from there on."""
    for seed in range(6):
        recording = recorded(true, seed, rows=SIDE, columns=SIDE)
        layout = layout_of(recording, Split.of(recording).development, Source(recording).frames)
        assert layout.full == frozenset()


@pytest.mark.long
def test_a_soft_limit_below_known_light_is_found_as_soft() -> None:
    softness = 30.0
    true = camera(Saturation(full_well_dn=FULL, softness_dn=softness))
    levels = (100.0, 300.0, 600.0, 1000.0, 1500.0, 2000.0, 3000.0)
    recording = recorded(true, 3, rows=SIDE, columns=SIDE, levels=levels)
    words = frozenset({"saturation", "nonlinearity", "row_prnu"})
    (found,) = find_mismatch(camera(), recording, vocabulary=words).omitted_physics
    assert found.parameters["softness_dn"].value == pytest.approx(softness, rel=0.05)
    assert found.parameters["full_well_dn"].value == pytest.approx(FULL, abs=1.5)


def test_a_full_well_hides_no_gains_and_is_proven() -> None:
    words = frozenset({"saturation", "row_prnu", "row_fpn", "prnu", "nonlinearity"})
    finding = find_mismatch(camera(), filled(), vocabulary=words)
    named = {one.effect: one.parameters for one in finding.omitted_physics}
    assert set(named) == {"saturation", "row_prnu"}
    assert named["saturation"]["full_well_dn"].value == pytest.approx(FULL, abs=0.1)
    assert named["row_prnu"]["sigma_percent"].value == pytest.approx(ROW_PERCENT, rel=0.3)
    assert all(one.heldout_gain.ci95[0] > 0 for one in finding.omitted_physics)


@pytest.mark.parametrize(
    ("effects", "noise"), [((), 2520.0), ((Saturation(full_well_dn=FULL),), 20.0)]
)
def test_light_above_white_has_its_noise_unless_a_well_is_full(
    effects: tuple[Effect, ...], noise: float
) -> None:
    held = held_of(filled())
    lights: dict[str, Any] = {f"flat-{i}": np.full((2, 2), v) for i, v in enumerate(LEVELS)}
    lights |= {"dark-0": np.zeros((2, 2)), "dark-1": np.zeros((2, 2))}
    made = virtual_sensor(camera(*effects), held, lights, 1)
    assert float(made["flat-6"].fresh.var(0).mean()) == pytest.approx(noise, rel=0.15)


@pytest.mark.parametrize("below", [0.0, 11.0, 60.0])
def test_light_just_below_white_has_its_whole_noise(below: float) -> None:
    """What neighbours take of it, say, leaves it below white with all of its noise."""
    light = 4095.0 - 64.0 - below
    held = held_of(filled())
    lights: dict[str, Any] = {f"flat-{i}": np.full((2, 2), v) for i, v in enumerate(LEVELS)}
    lights |= {"dark-0": np.zeros((2, 2)), "dark-1": np.zeros((2, 2))}
    made = virtual_sensor(camera(), held, lights | {"flat-6": np.full((2, 2), light)}, 1)
    noise = 0.5 * light + 20.0
    assert float(made["flat-6"].fresh.var(0, ddof=1).mean()) == pytest.approx(noise, rel=0.03)
    assert float(made["flat-6"].fresh.mean()) == pytest.approx(light, abs=1.0)
