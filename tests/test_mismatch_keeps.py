"""Promise: `dsis mismatch` takes nothing of the user's when it replaces an earlier result."""

from dataclasses import replace
from pathlib import Path

import pytest

from analysis.mismatch import folders
from analysis.mismatch.files import write_finding
from analysis.mismatch.finding import Finding
from dsis.cli import main
from dsis.simulate import dark, flat, simulate
from folder_bytes import every_byte
from mismatch_findings import BASE, FOUND, NOTHING, evidence


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    shots = [
        dark("dark", frames=2, exposure_time_s=0.01),
        flat("flat-1", 300.0, frames=2, exposure_time_s=0.01, light=300.0),
    ]
    return simulate(BASE, shots, 16, 24, tmp_path / "recording", seed=5).folder


@pytest.fixture
def result(tmp_path: Path) -> Path:
    """Return an earlier result, with figures."""
    write_finding(replace(FOUND, evidence=evidence()), tmp_path / "result")
    assert list((tmp_path / "result" / "figures").iterdir())
    return tmp_path / "result"


@pytest.fixture(autouse=True)
def searches(monkeypatch: pytest.MonkeyPatch) -> list[Finding]:
    """Return what the searches found: nothing, at once."""
    found: list[Finding] = []

    def find(*_: object, **__: object) -> Finding:
        found.append(NOTHING)
        return NOTHING

    monkeypatch.setattr(folders, "find_mismatch", find)
    return found


def test_the_camera_model_that_it_reads(
    recording: Path,
    result: Path,
    searches: list[Finding],
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = every_byte(result)
    model = result / "camera.toml"
    assert main(["mismatch", str(model), str(recording), "-o", str(result)]) == 2
    said = "holds camera.toml, the camera model that is read, which would be lost: give another"
    assert capsys.readouterr().err == f"dsis: {result}: {said} folder\n"
    assert every_byte(result) == before
    assert not searches


@pytest.mark.parametrize(
    ("name", "lost"),
    [
        ("figures/mine.png", "figures/mine.png"),
        ("figures/mine.txt", "figures/mine.txt"),
        ("notes.txt", "notes.txt"),
        ("camera.toml", "changes to camera.toml"),
    ],
)
def test_files_of_the_user(
    recording: Path,
    result: Path,
    searches: list[Finding],
    name: str,
    lost: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    model = tmp_path / "camera.toml"
    model.write_bytes((result / "camera.toml").read_bytes())
    command = ["mismatch", str(model), str(recording), "-o", str(result)]
    with (result / name).open("a", encoding="utf-8") as file:
        file.write("# mine\n")
    before = every_byte(result)
    assert main(command) == 2
    said = capsys.readouterr().err
    assert said == f"dsis: {result}: holds {lost}, which would be lost: give another folder\n"
    assert every_byte(result) == before
    assert not searches


def test_a_result_as_it_was_written_is_replaced(
    recording: Path, result: Path, tmp_path: Path
) -> None:
    model = tmp_path / "camera.toml"
    model.write_bytes((result / "camera.toml").read_bytes())
    for _ in range(2):
        assert main(["mismatch", str(model), str(recording), "-o", str(result)]) == 0
    assert every_byte(result).keys() >= {"mismatch.json", "camera.toml", "report.html"}
