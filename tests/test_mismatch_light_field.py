"""Light behind a lens is measured as it is, and what it hid is seen.

Recordings are numpy's; nothing of them is made by the effects.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.finding import Finding
from analysis.mismatch.lightfield import measured_light
from analysis.mismatch.named import Named
from dsis.cfa import Cfa
from dsis.effects.shading import Shading
from mismatch_recordings import InMemory, camera, recorded, state_of_all

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES, LEVELS = 64, 96, 8, (400.0, 1200.0, 2800.0)
SLOPE, INTERCEPT, BLACK = 0.25, 10.0, 64.0
ROW_NOISE = 0.9  # DN
PARTS = ((SLOPE, INTERCEPT, None),)
WORDS = frozenset({"shading", "row_noise", "tap_mismatch", "line_settling", "channel_imbalance"})
Array = NDArray[np.float64]


def _lens(fall: float, off: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return the fourth power of the cosine: 1 on the axis, less by `fall` in the corners."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    square = (y - (ROWS - 1) / 2 - off[0]) ** 2 + (x - (COLUMNS - 1) / 2 - off[1]) ** 2
    square = square * 4 / (ROWS**2 + COLUMNS**2)
    tangent = (1 - fall) ** -0.5 - 1  # squared: cos^4 = 1 / (1 + tan^2)^2
    return np.asarray(1 / (1 + tangent * square) ** 2)


def _recording(light: Array, cfa: Cfa, rows_by: float = 0.0, seed: int = 3) -> InMemory:
    like = recorded(camera(cfa=cfa.name), 1, rows=ROWS, columns=COLUMNS, levels=LEVELS)
    draws = np.random.default_rng(seed)
    stacks = {}
    for exposure in like.exposures:
        signal = (exposure.light or 0.0) * light
        shape = FRAMES, ROWS, COLUMNS
        noise = draws.standard_normal(shape) * np.sqrt(SLOPE * signal + INTERCEPT)
        noise += rows_by * draws.standard_normal((FRAMES, ROWS, 1))
        stacks[exposure.name] = np.rint(BLACK + signal + noise).clip(0, 4095).astype(np.uint16)
    return InMemory(like.sensor, like.exposures, ROWS, COLUMNS, like.folder, stacks)


def _measured(light: Array, cfa: Cfa = Cfa.MONO, *own: Shading) -> Named | None:
    model = camera(*own, cfa=cfa.name, segments=PARTS)
    return measured_light(state_of_all(_recording(light, cfa), model).clues(), beside=bool(own))


def _named(found: Finding) -> dict[str, dict[str, tuple[float, float]]]:
    return {
        one.effect: {
            name: (float(p.value), float(p.standard_error))
            for name, p in one.parameters.items()
            if not isinstance(p.value, tuple)
        }
        for one in found.omitted_physics
    }


@pytest.mark.long
def test_a_lens_off_the_centre_is_measured_and_hides_no_row_noise() -> None:
    """Half of the light is lost in a corner; row noise is two sevenths of the read noise."""
    light = _lens(0.5, (6.0, -15.0))
    recording = _recording(light, Cfa.RGGB, ROW_NOISE)
    mosaic = camera(cfa="RGGB", segments=PARTS)
    found = find_mismatch(mosaic, recording, seed=1, vocabulary=WORDS)
    named = _named(found)
    assert sorted(named) == ["row_noise", "shading"]
    value, error = named["row_noise"]["sigma_dn"]
    assert abs(value - ROW_NOISE) < 3 * error < 0.3 * ROW_NOISE
    value, error = named["shading"]["falloff_percent"]
    corners = light[:: ROWS - 1, :: COLUMNS - 1].mean() / light[ROWS // 2, COLUMNS // 2]
    assert value == pytest.approx(100 * (1 - corners), abs=1.5)
    assert {one.effect: one.choices for one in found.omitted_physics}["shading"] == {
        "field": "as measured"
    }
    assert not found.unexplained


def test_a_measured_field_is_the_light() -> None:
    light = _lens(0.5, (6.0, -15.0))
    found = _measured(light)
    assert found is not None
    assert found.light is not None
    assert found.measured
    made = found.light.field[0]
    y, x = np.mgrid[:ROWS, :COLUMNS]
    v, u = (y - (ROWS - 1) / 2) / (ROWS / 2), (x - (COLUMNS - 1) / 2) / (COLUMNS / 2)
    field = np.polynomial.legendre.legval2d(v, u, np.asarray(made) / 100)
    square = ((v * ROWS) ** 2 + (u * COLUMNS) ** 2) / (ROWS**2 + COLUMNS**2)
    field += 1 - found.light.falloff_percent / 100 * square
    field += found.light.tilt_down_percent / 100 * v + found.light.tilt_right_percent / 100 * u
    assert np.abs(field / field.mean() - light / light.mean()).max() < 0.01
    assert np.std(field / field.mean() - light / light.mean()) < 0.0015


def test_what_has_few_numbers_or_no_end_is_not_measured() -> None:
    """A weak fall, halves, a decay from an edge, and gains that neighbours share."""
    assert _measured(_lens(0.04)) is None
    halves = np.ones((ROWS, COLUMNS))
    halves[:, COLUMNS // 2 :] = 1.05
    assert _measured(halves) is None
    decay = np.broadcast_to(1 - 0.1 * np.exp(-np.arange(COLUMNS) / 6), (ROWS, COLUMNS))
    assert _measured(decay) is None
    y, x = (np.minimum(np.arange(n), n - np.arange(n)) for n in (ROWS, COLUMNS))
    power = np.maximum(np.fft.fft2(np.exp(-np.hypot(y[:, None], x) / 9)).real, 0)
    white = np.fft.fft2(np.random.default_rng(2).standard_normal((ROWS, COLUMNS)))
    assert _measured(1 + 0.02 * np.fft.ifft2(np.sqrt(power) * white).real) is None


def test_light_that_a_camera_has_but_not_there_is_measured_beside_it() -> None:
    """The camera's own falls by 12 % from the centre; the recording's also leans to one side."""
    own = Shading(falloff_percent=12.0)
    y = np.linspace(-1, 1, ROWS)[:, None]
    square = (y**2 * ROWS**2 + np.linspace(-1, 1, COLUMNS) ** 2 * COLUMNS**2) / (
        ROWS**2 + COLUMNS**2
    )
    light = (1 - 0.12 * square) * (1 + 0.03 * y)
    found = _measured(light, Cfa.MONO, own)
    assert found is not None
    assert found.light is not None
    assert found.light.tilt_down_percent == pytest.approx(3.0, abs=5 * 0.02)
    assert _measured(1 - 0.12 * square, Cfa.MONO, own) is None
    assert _measured(light) is None  # of a camera without it few numbers have it


@pytest.mark.long
@pytest.mark.parametrize("fall", [0.10, 0.13])
def test_light_of_the_users_camera_may_be_of_another_size_alone(fall: float) -> None:
    square = np.linspace(-1, 1, ROWS)[:, None] ** 2 * ROWS**2 + (
        np.linspace(-1, 1, COLUMNS) ** 2 * COLUMNS**2
    )
    light = 1 - fall * square / (ROWS**2 + COLUMNS**2)
    model = camera(Shading(falloff_percent=12.0), segments=PARTS)
    words = frozenset({"shading", "row_noise"})
    found = find_mismatch(model, _recording(light, Cfa.MONO), seed=1, vocabulary=words)
    assert not found.omitted_physics
    assert not found.unexplained
    (wrong,) = (one for one in found.parameter_errors if "shading" in one.parameter)
    assert wrong.recorded == pytest.approx(100 * fall, abs=0.5)


@pytest.mark.long
def test_two_amplifiers_behind_a_lens_are_told() -> None:
    light = _lens(0.5, (6.0, -15.0))
    light[:, COLUMNS // 2 :] *= 1.03
    found = find_mismatch(
        camera(segments=PARTS), _recording(light, Cfa.MONO), seed=1, vocabulary=WORDS
    )
    named = _named(found)
    assert sorted(named) == ["shading", "tap_mismatch"]
    value, error = named["tap_mismatch"]["gain_percent"]
    assert value == pytest.approx(2.96, abs=max(3 * error, 0.15))
    assert not found.unexplained


def test_without_a_word_for_it_nothing_is_measured() -> None:
    recording = _recording(_lens(0.5, (6.0, -15.0)), Cfa.MONO)
    found = find_mismatch(
        camera(segments=PARTS), recording, seed=1, vocabulary=frozenset({"row_noise"})
    )
    assert not found.omitted_physics
    assert replace(found, remarks=()).unexplained
