"""Promise: what the pages on recordings and camera models show is read as it stands there."""

import re
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from analysis.mismatch import finding
from analysis.mismatch.files import FILES as DIAGNOSIS
from dsis.camera import BaseNoise, Camera, Segment, read_camera
from dsis.cli import main
from dsis.recording import Sensor, read_recording
from dsis.recording.tomlfile import Entry, RecordingFile
from recording_folders import save

DOCS = Path(__file__).resolve().parents[1] / "docs"
RECORDINGS, CAMERAS, FILES = (
    (DOCS / name).read_text(encoding="utf-8")
    for name in ("recordings.md", "camera-models.md", "mismatch-files.md")
)


def example(page: str, name: str) -> str:
    return re.search(rf"<!-- example {name} -->\n```\w+\n(.*?)```", page, re.DOTALL)[1]


def _names(of: type) -> set[str]:
    return {field.alias or name for name, field in of.model_fields.items()}


def _keys(page: str) -> set[str]:
    rows = re.findall(r"^\|[^|\n]*\| (`[^|\n]*`) \|", page, re.MULTILINE)
    return {key for row in rows for key in re.findall(r"`(\w+)`", row)}


@pytest.fixture
def bench_camera(tmp_path: Path) -> Path:
    """Return the page's folder, with frames of 0.25 DN per electron."""
    rng = np.random.default_rng(1)
    for name, light in {"dark-10ms": 0, "flat-1": 200, "flat-2": 800}.items():
        for number in range(3):
            codes = 64 + rng.poisson(light / 0.25, (96, 128)) * 0.25 + rng.normal(0, 2, (96, 128))
            save(tmp_path / "bench-camera" / name / f"{number}.tif", codes.round().astype("u2"))
    toml = example(RECORDINGS, "recording.toml")
    (tmp_path / "bench-camera" / "recording.toml").write_text(toml, encoding="utf-8")
    return tmp_path / "bench-camera"


def test_the_example_recording_is_read_and_fitted(
    bench_camera: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = read_recording(bench_camera)
    assert [e.plan.kind for e in found.exposures] == ["dark", "flat", "flat"]
    assert [len(e.frames) for e in found.exposures] == [3, 3, 3]
    monkeypatch.chdir(bench_camera.parent)
    line = re.search(r"`dsis (camera fit bench-camera .*?)`", RECORDINGS)[1]
    assert main(line.split()) in (None, 0)
    fitted = read_camera(bench_camera.parent / "camera.toml")
    assert abs(fitted.noise.segment[0].slope - 0.25) < 0.02


def test_the_example_camera_is_read(tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_text(example(CAMERAS, "camera.toml"), encoding="utf-8")
    camera = read_camera(tmp_path / "camera.toml")
    assert len(camera.noise.segment) == 2
    assert [effect.kind for effect in camera.effect] == ["row_noise"]


def test_a_headerless_file_becomes_a_frame(tmp_path: Path) -> None:
    codes = np.random.default_rng(2).integers(0, 4096, (96, 128), dtype=np.uint16)
    codes.astype("<u2").tofile(tmp_path / "0.raw")
    code = example(RECORDINGS, "convert")
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert (np.load(tmp_path / "0.npy") == codes).all()


def test_the_tables_have_the_keys_that_there_are() -> None:
    recording = _names(RecordingFile) | _names(Sensor) | _names(Entry)
    assert _keys(RECORDINGS) == recording - {"sensor", "exposure"}
    camera = _names(Camera) | _names(BaseNoise) | _names(Segment) | {"kind"}
    assert _keys(CAMERAS) == camera - {"noise", "segment", "effect"}


@pytest.mark.parametrize(
    "of",
    [finding.Where, finding.Mismatch, finding.ParameterError, finding.OmittedEffect,
     finding.FittedParameter, finding.Gain, finding.Alternative, finding.Proof],
)  # fmt: skip
def test_every_key_of_mismatch_json_is_told(of: type) -> None:
    for field in fields(of):
        assert f"`{field.name}`" in FILES, field.name


def test_every_file_of_a_diagnosis_is_told() -> None:
    for name in DIAGNOSIS:
        assert re.search(rf"^\| `{name}/?` \|", FILES, re.MULTILINE), name


def test_links_lead_to_pages() -> None:
    for page in (RECORDINGS, CAMERAS, FILES):
        for link in re.findall(r"\]\((.*?)\)", page):
            assert (DOCS / link).is_file(), link
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    for page in ("recordings.md", "camera-models.md", "mismatch-files.md"):
        assert f"](docs/{page})" in readme
