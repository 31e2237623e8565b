"""Light that is uneven: a fall to the corners, tilts, bows; no amplifier, no glow."""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import pytest
from planter import Choice, draw_case, plant
from planter.case import Effect as Planted

from analysis.mismatch import find_mismatch
from analysis.mismatch.diagnose import VOCABULARY
from dsis.camera import read_camera
from dsis.effects import registry
from dsis.recording import read_recording
from mismatch_recordings import FEW_LEVELS, TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

FALL, DOWN, RIGHT, BOW = 2.8, -2.1, 1.4, 2.1
NUMBERS = (
    "falloff_percent",
    "tilt_down_percent",
    "tilt_right_percent",
    "bow_down_percent",
    "bow_right_percent",
    "ring_percent",
)


def _shading(**percent: float) -> object:
    return registry()["shading"](**{"falloff_percent": 0.0, **percent})


@pytest.mark.long
@pytest.mark.parametrize(
    "percent",
    [
        {"falloff_percent": FALL, "tilt_down_percent": DOWN, "tilt_right_percent": RIGHT},
        {"tilt_down_percent": DOWN, "bow_down_percent": BOW},
    ],
)
def test_uneven_light_is_named_with_its_numbers(percent: dict[str, float]) -> None:
    true = camera(_shading(**percent))  # type: ignore[arg-type] # an effect of the registry
    found = find_mismatch(
        camera(), recorded(true, 8, rows=64, columns=96, levels=TWO_LEVELS), seed=1
    )
    (named,) = found.omitted_physics
    assert named.effect == "shading"
    assert not found.unexplained
    for name in NUMBERS:
        fitted = named.parameters[name]
        assert isinstance(fitted.value, float)
        off = abs(fitted.value - percent.get(name, 0.0))
        assert off < max(4 * fitted.standard_error, 0.02)


@pytest.mark.long
def test_two_amplifiers_that_have_no_word_are_no_tilt_of_the_light() -> None:
    taps = registry()["tap_mismatch"](gain_percent=3.0, regions="left_right")
    words = VOCABULARY - {"tap_mismatch"}
    recording = recorded(camera(taps), 9, rows=48, columns=64, levels=TWO_LEVELS)
    found = find_mismatch(camera(), recording, seed=1, vocabulary=words)
    assert not found.omitted_physics
    assert found.verdict == "unexplained"


def test_the_fall_of_a_lens_is_a_fall_and_no_bow(tmp_path: Path) -> None:
    """cos^4 has more than r^2: two bows would fit it better, a ring is what it has.

    Corners are 30 degrees off the axis: polynomials come nearest to it with -0.46 of the fall.
    """
    choice = Choice(cfa="MONO", segments=1, light=True, times="darks")
    planted = Planted("shading", {"falloff_percent": 20.0, "law": "cos4"})
    case = draw_case(5, "small", choice)
    few = tuple(one for one in case.exposures if one.name not in {"flat-1", "flat-3"})
    plant(tmp_path, replace(case, exposures=few).having(planted))
    found = find_mismatch(
        read_camera(tmp_path / "camera.toml"),
        read_recording(tmp_path),
        seed=1,
        vocabulary=frozenset({"shading", "prnu", "tap_mismatch", "amp_glow"}),
    )
    (named,) = found.omitted_physics
    assert named.effect == "shading"
    values = {name: parameter.value for name, parameter in named.parameters.items()}
    assert values["falloff_percent"] == pytest.approx(20, abs=0.3)
    assert values["ring_percent"] == pytest.approx(-0.46 * 20, rel=0.05)
    assert values["bow_down_percent"] == values["bow_right_percent"] == 0


@pytest.mark.parametrize("fall", [10.0, 70.0])
def test_a_camera_that_knows_its_lens_matches_its_own_recording(fall: float) -> None:
    """What a fall of the light takes of the level is taken once, however much it is."""
    known = camera(_shading(falloff_percent=fall))  # type: ignore[arg-type] # an effect of the registry
    recording = recorded(known, 9, levels=FEW_LEVELS)
    found = find_mismatch(known, recording, seed=1, vocabulary=frozenset())
    assert found.verdict == "match"
    assert not found.searched
    assert any("No physics was looked for" in remark for remark in found.remarks)


@pytest.mark.long
def test_a_fall_is_told_beside_a_decay_that_the_camera_has() -> None:
    """The lines of an edge lean and bend the map: what they make of it is no uneven light."""
    edge = registry()["line_settling"](gain_percent=3.0, length_pixels=6.0, edge="left")
    known = camera(edge)
    true = camera(edge, _shading(falloff_percent=1.5))  # type: ignore[arg-type] # an effect of the registry
    recording = recorded(true, 5, rows=64, columns=96, levels=TWO_LEVELS)
    found = find_mismatch(known, recording, seed=2, vocabulary=frozenset({"shading"}))
    (named,) = found.omitted_physics
    fall = named.parameters["falloff_percent"]
    assert fall.value == pytest.approx(1.5, abs=4 * fall.standard_error)
    others = {name: one for name, one in named.parameters.items() if name != "falloff_percent"}
    assert all(abs(one.value) <= 4 * one.standard_error for one in others.values())
