"""`dsis mismatch` on recordings of an independent simulator: whether, where, and what physics."""

import json
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from planter import Case, Choice, Effect, draw_case, plant

from analysis.mismatch import Finding, diagnose, find_mismatch
from analysis.mismatch.jsonfile import finding_values
from dsis.camera import read_camera
from dsis.recording import read_recording


def _case(seed: int = 3, **choice: Any) -> Case:
    fixed = {"cfa": "MONO", "segments": 1, "bit_depth": 12, "light": True, "times": "darks"}
    return draw_case(seed, "tiny", Choice(**{**fixed, **choice}))


def _found(folder: Path, case: Case, **options: Any) -> Finding:
    plant(folder / "rec", case)
    camera, recording = read_camera(folder / "rec" / "camera.toml"), read_recording(folder / "rec")
    return find_mismatch(camera, recording, seed=5, **options)


def test_nothing_hidden_is_a_match(tmp_path: Path) -> None:
    found = _found(tmp_path, _case())
    assert found.verdict == "match"
    assert not found.mismatches
    assert not found.parameter_errors
    assert not found.omitted_physics


def test_wrong_numbers_are_parameter_errors_and_no_physics(tmp_path: Path) -> None:
    case = replace(_case(), wrong={"noise.slope": 20.0, "black_level": -15.0})
    found = _found(tmp_path, case)
    assert found.verdict == "parameters"
    assert {error.parameter for error in found.parameter_errors} == {"noise.slope", "black_level"}
    true = {"noise.slope": case.segments[0].slope, "black_level": case.black_level}
    for error in found.parameter_errors:
        z = (error.recorded - true[error.parameter]) / error.standard_error
        assert abs(z) < 5
        assert abs(error.model - error.recorded) > 5 * error.standard_error


# Strengths well above the detection limit of a tiny recording; benchmarks/mismatch_power.py has
# the limits themselves.
HIDDEN = {
    "row_noise": ("sigma_dn", 0.5),  # in units of the read noise
    "prnu": ("sigma_percent", 2.0),
    "crosstalk": ("fraction", 0.05),
}


def _hiding(kind: str) -> tuple[Case, str, float]:
    """Return a case with an effect, and the effect's parameter."""
    case = _case()
    name, value = HIDDEN[kind]
    value *= case.segments[0].intercept ** 0.5 if name == "sigma_dn" else 1
    return case.having(Effect(kind, {name: value})), name, value


@cache  # one of them is compared with what other processes find
def _of_hidden(kind: str) -> Finding:
    with TemporaryDirectory() as folder:
        return _found(Path(folder), _hiding(kind)[0])


@pytest.mark.parametrize("kind", HIDDEN)
def test_one_hidden_effect_is_named_with_its_parameter(kind: str) -> None:
    _, name, value = _hiding(kind)
    found = _of_hidden(kind)
    assert found.verdict == "omitted_physics"
    assert [effect.effect for effect in found.omitted_physics] == [kind]
    named = found.omitted_physics[0]
    assert named.heldout_gain.nats_per_frame > 0
    assert named.because
    assert {m.explained_by for m in found.mismatches} <= {kind, None}
    fitted = named.parameters[name]
    assert isinstance(fitted.value, float)
    assert abs(fitted.value - value) < 5 * fitted.standard_error


def test_an_effect_outside_the_vocabulary_stays_unexplained(tmp_path: Path) -> None:
    case = _case()
    read = case.segments[0].intercept ** 0.5
    hidden = case.having(Effect("row_noise", {"sigma_dn": 0.8 * read}))
    found = _found(tmp_path, hidden, vocabulary=frozenset({"prnu", "dsnu", "crosstalk", "flicker"}))
    assert found.verdict == "unexplained"
    assert "row_variance" in {m.statistic for m in found.unexplained}
    assert not found.omitted_physics


def test_same_seed_same_json_whatever_the_number_of_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two processes: so few samples have but one, as long as they are few."""
    monkeypatch.setattr(diagnose, "_SMALL", 0.0)
    one, two = _of_hidden("prnu"), _found(tmp_path, _hiding("prnu")[0], jobs=2)
    assert json.dumps(finding_values(one)) == json.dumps(finding_values(two))
