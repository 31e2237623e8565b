"""Coarse codes need not be multiples of their step: step and phase are named as they were recorded.

Recordings are numpy's noise, rounded here; nothing of them is made by the effects.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analysis.mismatch import Finding, find_mismatch
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

BLACK, SLOPE, INTERCEPT = 64.3, 0.5, 16.0  # DN, DN, DN^2
LEVELS = (250.0, 900.0, 2600.0)
SIZE = {"rows": 64, "columns": 64}
OTHERS = ("adc_dnl", "heavy_tailed_read_noise", "prnu")
VOCABULARY = frozenset({"quantisation", *OTHERS})
RESPONSE = {"MONO": [[1.0]], "GRBG": [[1.0, 0.6], [0.4, 1.0]]}
BASE = {cfa: camera(cfa=cfa, segments=((SLOPE, INTERCEPT, None),), black=BLACK) for cfa in RESPONSE}


@cache
def coarse(step: int, phase: int, cfa: str = "MONO", intercept: float = INTERCEPT) -> InMemory:
    """Return normal noise of the base model in codes phase + n step, 0 <= phase < step."""
    draws = np.random.default_rng([step, phase, len(cfa)])
    like = recorded(BASE[cfa], 1, levels=LEVELS, **SIZE)
    assert like.stacks is not None
    light = np.tile(RESPONSE[cfa], (SIZE["rows"] // len(RESPONSE[cfa]),) * 2)
    stacks = {}
    for exposure in like.exposures:
        signal = (exposure.light or 0.0) * light
        shape = like.stacks[exposure.name].shape
        noise = draws.standard_normal(shape) * np.sqrt(SLOPE * signal + intercept)
        steps = np.rint((BLACK + signal + noise - phase) / step)
        codes = phase + step * np.clip(steps, 0, (4095 - phase) // step)
        stacks[exposure.name] = codes.astype(np.uint16)
    return replace(like, stacks=stacks)


def found_in(recording: InMemory, model: Camera) -> Finding:
    return find_mismatch(model, recording, seed=1, vocabulary=VOCABULARY)


@pytest.mark.long
@pytest.mark.parametrize(
    ("step", "phase", "cfa"),
    [(2, 1, "MONO"), (6, 5, "MONO"), (6, 0, "MONO"), (5, 4, "GRBG"), (8, 3, "GRBG")],
)
def test_step_and_phase_are_named(step: int, phase: int, cfa: str) -> None:
    found = found_in(coarse(step, phase, cfa), BASE[cfa])
    assert [one.effect for one in found.omitted_physics] == ["quantisation"]
    own = found.omitted_physics[0]
    numbers = {name: one.value for name, one in own.parameters.items()}
    assert numbers == {"step_dn": step} | ({"phase_dn": phase} if phase else {})
    # Of so many codes one in a step occurs: each pixel of a frame tells the logarithm.
    pixels = SIZE["rows"] * SIZE["columns"]
    assert own.heldout_gain.nats_per_frame == pytest.approx(pixels * np.log(step), rel=0.02)
    assert not found.unexplained
    # What rounding adds, step^2 / 12, is the steps', not the read noise's.
    assert "noise.intercept" not in {one.parameter for one in found.parameter_errors}
    segment = found.camera.noise.segment[0]
    assert segment.intercept_se is not None
    assert abs(segment.intercept - INTERCEPT) < 5 * segment.intercept_se
    assert 5 * segment.intercept_se < (step**2 - 1) / 12 or step == 2


@pytest.mark.parametrize(("step", "phase"), [(6, 5), (9, 4)])
def test_codes_that_the_model_has_are_no_mismatch(step: int, phase: int) -> None:
    known = registry()["quantisation"](step_dn=float(step), phase_dn=phase)
    model = BASE["MONO"].model_copy(update={"effect": (known,)})
    found = found_in(coarse(step, phase), model)
    assert found.verdict == "match"


def test_narrow_noise_of_few_codes_shows_the_phase_too() -> None:
    """Darks whose noise is a third of a step; black is no multiple of it, nor is the phase."""
    narrow = 5.0  # DN^2: 2.2 DN in steps of 7
    model = camera(segments=((SLOPE, narrow, None),), black=BLACK)
    found = found_in(coarse(7, 2, intercept=narrow), model)
    assert [one.effect for one in found.omitted_physics] == ["quantisation"]
    numbers = {name: one.value for name, one in found.omitted_physics[0].parameters.items()}
    assert numbers == {"step_dn": 7, "phase_dn": 2}
    assert not found.parameter_errors
    assert not found.unexplained
