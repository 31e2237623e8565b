"""Promise: what `dsis mismatch` leaves on disk is complete, the same every time, and of use."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch import folders
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.files import write_finding
from analysis.mismatch.finding import Change, Finding, Where
from analysis.mismatch.jsonfile import finding_values, write_json
from dsis.camera import Camera, read_camera
from dsis.cli import main
from dsis.errors import InputError
from dsis.recording import Recording, read_recording
from dsis.simulate import dark, flat, simulate
from dsis.simulate.maps import SensorMaps
from mismatch_findings import BASE, CAMERA, FOUND, NOTHING, ROWS, evidence

WHERE_KEYS = [  # contracts, section 4
    "exposures",
    "kind",
    "channel",
    "signal_dn",
    "rows",
    "columns",
    "spatial_frequency",
    "frames",
    "pixels",
]


def strict(path: Path) -> dict[str, Any]:
    def refuse(word: str) -> None:
        raise AssertionError(word)  # NaN and Infinity are no JSON

    values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    return values


def test_json_is_that_of_the_contract(tmp_path: Path) -> None:
    write_json(FOUND, tmp_path / "mismatch.json")
    values = strict(tmp_path / "mismatch.json")
    assert values["schema"] == "dsis-mismatch/1"
    assert values["verdict"] == "omitted_physics"
    first, second = values["mismatches"]
    assert {"statistic", "z", "p_adjusted", "explained_by", "where", "says"} <= first.keys()
    assert [key for key in first["where"] if key in WHERE_KEYS] == WHERE_KEYS
    assert first["where"]["signal_dn"] == [100, 700]
    assert first["where"]["rows"] is None
    assert second["explained_by"] is None
    assert second["where"]["pixels"] == [[3, 4]]
    assert values["parameter_errors"] == [
        {"parameter": "noise.slope", "model": 0.6, "recorded": 0.5, "standard_error": 0.002}
    ]
    assert values["omitted_physics"] == [
        {
            "effect": "row_noise",
            "parameters": {"sigma_dn": {"value": 3.2, "standard_error": 0.1}},
            "because": ["row_variance"],
            "heldout_gain": {"nats_per_frame": 120.4, "ci95": [101.0, 139.8]},
            "alternatives": [
                {
                    "effect": "line_flicker",
                    "heldout_gain": None,
                    "why_not": "It does not grow with the signal.",
                    "would_settle": "A second level.",
                }
            ],
        }
    ]
    assert values["unexplained"][0].keys() == {"statistic", "z", "where", "says"}
    assert values["undecided"][0]["heldout_gain"] == {
        "nats_per_frame": 2.0,
        "ci95": [None, None],
    }
    fit = values["fit"]
    assert fit["heldout_frames"] == {"flat-1": [1, 3]}
    assert fit["loglik_per_pixel"] == {"before": -3.412, "after": -3.377}
    assert json.dumps(fit["discrepancies"]) == '{"before": 14, "after": 0}'
    assert fit["gap_closed"] is None
    assert fit["classifier_auc"] == {"before": 0.97, "after": 0.51}


@given(st.floats(), st.floats(), st.integers(0, 2**40))
def test_any_number_has_a_place_in_json(z: float, before: float, frame: int) -> None:
    where = Where(frames=(frame, np.int64(frame)))  # type: ignore[arg-type] # as analysis makes it
    mismatch = replace(ROWS, z=np.float64(z), where=where)
    proof = replace(FOUND.proof, discrepancies=Change(before, 0.0))
    values = finding_values(replace(FOUND, mismatches=(mismatch,), proof=proof))
    again = json.loads(json.dumps(values, allow_nan=False))
    assert again["mismatches"][0]["z"] == (z if np.isfinite(z) else None)
    assert again["mismatches"][0]["where"]["frames"] == [frame, frame]
    found = again["fit"]["discrepancies"]["before"]
    assert found == (before if np.isfinite(before) else None)


def test_same_finding_same_bytes(tmp_path: Path) -> None:
    for name, seconds in (("one", 1.0), ("two", 2.0)):
        seen = replace(evidence(), seconds=seconds)
        write_finding(replace(FOUND, evidence=seen), tmp_path / name, "Recording")
    one, two = (
        {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        for folder in (tmp_path / "one", tmp_path / "two")
    )
    assert one == two
    assert {Path("mismatch.json"), Path("report.html"), Path("camera.toml")} < one.keys()


# From files to files, through the command, with a search that is made up.


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("mismatch") / "recording"
    shots = [
        dark("dark", frames=2, exposure_time_s=0.01),
        flat("flat-1", 300.0, frames=2, exposure_time_s=0.01, light=300.0),
    ]
    simulate(BASE, shots, 16, 24, out, seed=5)
    return out


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """Return a camera.toml; it comes from a diagnosis, as it may."""
    write_finding(NOTHING, tmp_path / "model", maps=half_maps())
    return tmp_path / "model" / "camera.toml"


def half_maps() -> SensorMaps:
    """Return maps of a sensor whose right half sees 1.5 times as much."""
    gains = np.where(np.arange(24) < 12, 0.8, 1.2) * np.ones((16, 1))
    return SensorMaps(np.zeros((16, 24), np.float32), gains.astype(np.float32))


@pytest.fixture
def searches(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return what the search was asked; it finds row noise in everything."""
    asked: list[dict[str, Any]] = []

    def find(camera: Camera, recording: object, **rest: Any) -> Finding:
        rest["progress"](1, 2, "searching")
        asked.append({"camera": camera, "recording": recording, **rest})
        return FOUND

    monkeypatch.setattr(folders, "find_mismatch", find)
    return asked


def test_command_writes_a_model_that_simulates(
    recording: Path, model: Path, searches: list[dict[str, Any]], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    arguments = ["mismatch", str(model), str(recording), "-o", str(out)]
    without = ["--without", "dsnu", "prnu"]
    assert main([*arguments, "--seed", "3", "--jobs", "2", *without]) == 0
    (asked,) = searches
    assert (asked["seed"], asked["jobs"]) == (3, 2)
    assert asked["vocabulary"] == VOCABULARY - {"dsnu", "prnu"}
    found = out / "camera.toml"
    assert read_camera(found) == CAMERA
    assert "row_noise: sigma 3.20 ± 0.10 DN" in found.read_text(encoding="utf-8")
    assert "not allowed to be named: dsnu, prnu" in found.read_text(encoding="utf-8")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("pixels; simulated from camera model") == 3  # as its frames are
    made = str(tmp_path / "made")
    like = ["camera", "simulate", str(found), "--like", str(recording), "-o", made]
    assert main([*like, "--same-sensor"]) == 0
    again = read_recording(Path(made))
    mean = np.mean([f - 100.0 for f in again.frames(again.exposure("flat-1"))], axis=0)
    # Halves of 300 DN, 13 DN of noise in 384 samples each and common rows: 0.5 % of the ratio.
    assert mean[:, 12:].mean() / mean[:, :12].mean() == pytest.approx(1.5, abs=5 * 1.5 * 0.005)


def test_locating_only_looks_for_no_physics(
    recording: Path, model: Path, searches: list[dict[str, Any]], tmp_path: Path
) -> None:
    out = str(tmp_path / "out")
    assert main(["mismatch", str(model), str(recording), "-o", out, "--locate-only"]) == 0
    assert searches[0]["vocabulary"] == frozenset()


@pytest.mark.parametrize("finding", [FOUND, NOTHING])
def test_status_is_0_whatever_is_found(
    finding: Finding,
    recording: Path,
    model: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(folders, "find_mismatch", lambda *_, **__: finding)
    assert main(["mismatch", str(model), str(recording), "-o", str(tmp_path / "out")]) == 0
    assert f"**{finding.verdict}**" in capsys.readouterr().out
    assert strict(tmp_path / "out" / "mismatch.json")["verdict"] == finding.verdict


@pytest.mark.usefixtures("searches")
def test_several_recordings_get_a_folder_each_and_a_table(
    recording: Path, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    both = [str(recording), str(recording)]
    assert main(["mismatch", str(model), *both, "-o", str(out), "--jobs", "1"]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["recording", "recording-2"]
    first, second = (strict(p / "mismatch.json") for p in sorted(out.iterdir()))
    assert first == second
    table = [line for line in capsys.readouterr().out.splitlines() if "| omitted_physics |" in line]
    assert [line.split(" | ")[0] for line in table] == ["| recording", "| recording-2"]


def test_what_was_found_before_a_recording_fails_is_said(
    recording: Path,
    model: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copytree(recording, tmp_path / "damaged")

    def find(_: Camera, one: Recording, **__: object) -> Finding:
        if one.folder.name == "damaged":
            raise InputError.of("frame.tif", "", "is damaged")
        return NOTHING

    monkeypatch.setattr(folders, "find_mismatch", find)
    both, out = [str(recording), str(tmp_path / "damaged")], tmp_path / "out"
    assert main(["mismatch", str(model), *both, "-o", str(out), "--jobs", "1"]) == 2
    said = capsys.readouterr()
    assert said.err == "dsis: frame.tif: is damaged\n"
    assert said.out.startswith("# recording\n\n**match**")
    assert f"report in {out / 'recording' / 'report.html'}" in said.out
    assert [path.name for path in out.iterdir()] == ["recording"]


def test_recordings_side_by_side_are_those_one_by_one(
    recording: Path, model: Path, tmp_path: Path
) -> None:
    made = []
    for jobs in ("1", "2"):
        out = tmp_path / jobs
        command = ["mismatch", str(model), str(recording), str(recording), "-o", str(out)]
        assert main([*command, "--jobs", jobs]) == 0
        made.append([(folder / "mismatch.json").read_bytes() for folder in sorted(out.iterdir())])
    assert len(made[0]) == 2
    assert made[0] == made[1]


def test_bad_input_is_refused_before_the_search(
    recording: Path,
    model: Path,
    searches: list[dict[str, Any]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out, ours = tmp_path / "out", tmp_path / "precious"
    ours.mkdir()
    (ours / "thesis.tex").write_text("years of work")
    other = tmp_path / "bayer.toml"
    text = model.read_text(encoding="utf-8").replace("MONO", "RGGB").replace("4095", "1023")
    other.write_text(text.replace("bit_depth = 12", "bit_depth = 10"), encoding="utf-8")
    good = [str(model), str(recording), "-o"]
    shots = [dark("dark", frames=8, exposure_time_s=0.01)]
    line = simulate(CAMERA, shots, 3, 64, tmp_path / "line").folder
    cases = {
        "64 x 3 pixels, must have 4 x 4": [str(model), str(line), "-o", str(out)],
        "did you mean row_noise": [*good, str(out), "--without", "row_nose", "dsnu"],
        "holds no mismatch.json": [*good, str(ours)],
        "sensor.white_level": [str(other), str(recording), "-o", str(out)],
        "sensor.cfa": [str(other), str(recording), "-o", str(out)],
        "none.toml": [str(tmp_path / "none.toml"), str(tmp_path / "nowhere"), "-o", str(out)],
        "nowhere": [str(tmp_path / "none.toml"), str(tmp_path / "nowhere"), "-o", str(out)],
    }
    for says, arguments in cases.items():
        assert main(["mismatch", *arguments]) == 2
        said = capsys.readouterr().err
        assert says in said
        assert all(line.startswith("dsis: ") for line in said.splitlines())
    assert not searches
    assert not out.exists()
    assert (ours / "thesis.tex").read_text() == "years of work"


def test_an_earlier_result_stays_until_the_next_is_complete(
    recording: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    write_finding(FOUND, out)
    before = (out / "mismatch.json").read_bytes()

    def breaks(*_: object, **__: object) -> Finding:
        raise KeyboardInterrupt

    arguments = ["mismatch", str(model), str(recording), "-o", str(out)]
    monkeypatch.setattr(folders, "find_mismatch", breaks)
    assert main(arguments) == 130
    assert (out / "mismatch.json").read_bytes() == before
    monkeypatch.setattr(folders, "find_mismatch", lambda *_, **__: NOTHING)
    assert main(arguments) == 0
    assert strict(out / "mismatch.json")["verdict"] == "match"
    assert not (tmp_path / "out.partial").exists()
    (out / "notes.txt").write_text("mine")
    assert main(arguments) == 2
    assert (out / "notes.txt").read_text() == "mine"
