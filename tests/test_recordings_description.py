"""Promise: a description that frames contradict is remarked, one that they bear out is not."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.mismatch.diagnose import find_mismatch
from analysis.photon_transfer.described import Described, contradictions
from analysis.photon_transfer.fit import fit_camera
from dsis.camera import Camera
from mismatch_recordings import InMemory, camera, recorded

BLACK, SLOPE, READ_DN2 = 64.0, 0.25, 4.0
LIGHTS = (200.0, 800.0, 1600.0, 2800.0)
LEVELS = (100.0, 500.0, 1600.0)
GIVEN = "is given as"


def _exposure(
    name: str, signal: float, *, light: float | None = None, time_s: float = 0.01
) -> Described:
    """Return an exposure of so many DN above black, whose noise is that of charge."""
    kind = "dark" if name.startswith("d") else "flat"
    variance = READ_DN2 + SLOPE * signal
    return Described(name, kind, time_s, light, BLACK + signal, 0.05, variance)


def _sound(*, response: float = 1.0) -> list[Described]:
    flats = [_exposure(f"f{i}", own * response, light=own) for i, own in enumerate(LIGHTS)]
    return [_exposure("d0", 0.0), *flats]


def _changed(name: str, **values: float | None) -> list[Described]:
    return [replace(e, **values) if e.name == name else e for e in _sound()]  # type: ignore[arg-type]


@pytest.mark.parametrize("black_dn", [20.0, 200.0])
def test_a_black_level_that_is_not_that_of_darks(black_dn: float) -> None:
    (says,) = contradictions(_sound(), black_dn)
    assert says.startswith(f"black_level is given as {black_dn:g} DN, but d0 is at 64 DN")


@pytest.mark.parametrize("black_dn", [0.0, 60.0, 64.0, 68.0])  # 0: not stated
@pytest.mark.parametrize("response", [0.1, 1.0])
def test_a_sound_description_has_no_remark(black_dn: float, response: float) -> None:
    assert contradictions(_sound(response=response), black_dn) == ()


def test_dark_current_is_no_wrong_black_level_and_no_exchange() -> None:
    """A dark of a minute may be far above black, and above flats of a hundredth of a second."""
    warm = [_exposure("d0", 500.0, time_s=60.0), *_sound()[1:]]
    assert contradictions(warm, BLACK) == ()


def test_dark_current_below_a_switch_is_no_wrong_black_level() -> None:
    """A dark of a minute lies in the first read-out path, all brighter flats in a second.

    There noise grows four times as fast as where the dark is. Flats of less time are darker.
    """
    flats = [
        replace(e, variance_dn2=4 * e.variance_dn2) if e.level_dn > 1000.0 else e
        for e in _sound()[1:]
    ]
    assert contradictions([_exposure("d0", 900.0, time_s=60.0), *flats], BLACK) == ()


def test_frames_of_a_dark_and_a_flat_that_are_exchanged() -> None:
    made = _sound()
    dark, bright = made[0], made[-1]
    exchanged = [
        replace(bright, name="d0", kind="dark", light=None),
        *made[1:-1],
        replace(dark, name="f3", kind="flat", light=2800.0),
    ]
    assert contradictions(exchanged, BLACK)[0].startswith("Darker than d0, though exposed no")


@pytest.mark.parametrize(("light", "told"), [(8000.0, True), (80.0, True), (1000.0, False)])
def test_light_that_the_level_contradicts(light: float, *, told: bool) -> None:
    found = contradictions(_changed("f1", light=light), BLACK)
    assert bool(found) is told
    if told:
        assert found[0].endswith("by its level, and the light of the other flats, it is 800.")


def test_full_wells_and_unknown_light_are_no_wrong_light() -> None:
    full = [_exposure(f"g{i}", 2800.0, light=light) for i, light in enumerate((6000.0, 20000.0))]
    assert contradictions([*_sound(), *full], BLACK) == ()
    assert contradictions([replace(e, light=None) for e in _sound()], BLACK) == ()


def _remarks(recording: InMemory, model: Camera) -> tuple[str, ...]:
    return find_mismatch(model, recording, vocabulary=frozenset()).remarks


def test_diagnosis_and_fit_remark_on_a_wrong_black_level() -> None:
    made = recorded(camera(), 4, levels=LEVELS)
    wrong = replace(made, sensor=made.sensor.model_copy(update={"black_level": 200.0}))
    for remarks in (_remarks(wrong, camera()), fit_camera(wrong).remarks):
        assert any(one.startswith("black_level is given as 200 DN") for one in remarks)
    for remarks in (_remarks(made, camera()), fit_camera(made).remarks):
        assert not any(GIVEN in one for one in remarks)


def test_a_mosaic_that_is_said_to_be_mono_is_told() -> None:
    made = recorded(camera(), 4, levels=LEVELS)
    assert made.stacks is not None
    cell = np.tile([[0.5, 1.0], [1.0, 0.7]], (made.rows // 2, made.columns // 2))
    for name, stack in made.stacks.items():
        if name.startswith("flat"):
            stack[:] = np.rint(BLACK + cell * (stack - BLACK)).astype(np.uint16)
    (says,) = [one for one in _remarks(made, camera()) if "MONO" in one]
    assert "0.50 : 1.00 : 1.00 : 0.70" in says


@pytest.mark.parametrize("cell", [[[0.8, 1.0], [0.8, 1.0]], [[0.8, 1.0], [1.0, 0.8]]])
def test_amplifiers_and_checkers_are_no_colour_filters(cell: list[list[float]]) -> None:
    made = recorded(camera(), 4, levels=LEVELS[-1:])
    assert made.stacks is not None
    whole = np.tile(cell, (made.rows // 2, made.columns // 2))
    made.stacks["flat-0"][:] = np.rint(BLACK + whole * (made.stacks["flat-0"] - BLACK))
    assert not any("MONO" in one for one in _remarks(made, camera()))


def test_dark_current_of_a_long_faint_flat_is_no_wrong_light() -> None:
    """500 DN/s: a flat of a second beside darks of its time and of a hundredth of that."""
    faint = _exposure("f9", 600.0, light=100.0, time_s=1.0)
    darks = [_exposure("d0", 5.0), _exposure("d1", 500.0, time_s=1.0)]
    assert contradictions([*darks, *_sound()[1:], faint], BLACK) == ()
    assert contradictions([darks[0], *_sound()[1:], faint], BLACK) == ()


@pytest.mark.parametrize("seed", range(8))
def test_faint_flats_look_like_no_mosaic_by_chance(seed: int) -> None:
    made = recorded(camera(), seed, rows=16, columns=16, frames=2, levels=(1.0,))
    assert not any("MONO" in one for one in _remarks(made, camera()))
