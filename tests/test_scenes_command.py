"""`dsis scenes` writes a panorama whole, says what is in it, and refuses what it cannot do."""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - the name that its own examples use
import pytest

from dsis.cli import main
from dsis.imagefile import read
from dsis.scenes import PRESETS, SCENES, Preset, panorama, preset_strip

TINY = Preset(32, 18, 8)


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PRESETS, "quick", TINY)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", ["out.exr", "new/folder/out.tif", "OUT.EXR"])
def test_the_file_is_the_panorama(
    scene: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / name
    assert main(["scenes", scene, "--preset", "quick", "--seed", "3", "--out", str(out)]) == 0
    light = panorama(preset_strip("quick", scene, 3))
    assert light.shape == (36, 80, 3)
    assert read(out).tobytes() == np.ascontiguousarray(light).tobytes()
    header = oiio.ImageInput.open(str(out)).spec()
    assert str(header.format) == "float"
    printed = capsys.readouterr().out
    for part in (scene, "seed 3", "80x36", "linear light", "Rec.709"):
        assert part in header.getattribute("ImageDescription")
        assert part in printed
    if out.suffix.lower() == ".exr":
        red_green_blue_white = header.getattribute("chromaticities")
        expected = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # ITU-R BT.709-6, 1.3, 1.4
        assert red_green_blue_white == pytest.approx(expected, abs=1e-6)
    assert [path.name for path in out.parent.iterdir() if path.is_file()] == [out.name]


def test_jobs_runs_and_a_cluster_give_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    files = []
    with distributed.LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=False,
        protocol="tcp",
        dashboard_address="127.0.0.1:0",
    ) as cluster:
        by = (["--jobs", "1"], ["--jobs", "2"], ["--scheduler", cluster.scheduler_address])
        for run, workers in enumerate(by):
            monkeypatch.setenv("DSIS_CACHE", str(tmp_path / f"cache{run}"))  # each renders
            out = tmp_path / f"{run}.exr"
            ask = ["scenes", "landscape", "--preset", "quick", "--seed", "5", *workers]
            assert main([*ask, "--out", str(out)]) == 0
            files.append(out.read_bytes())
    assert files[0] == files[1] == files[2]


def test_wrong_names_are_refused_together(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes", "seaside", "--preset", "huge", "--out", "x.exr"]) == 2
    said = capsys.readouterr().err
    assert "preset: is 'huge', must be one of: quick, standard, lab" in said
    assert "scene: is 'seaside', must be one of: city, landscape" in said


@pytest.mark.parametrize("name", ["out.png", "out", "."])
def test_a_file_that_cannot_hold_light_is_refused_before_rendering(
    name: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("DSIS_CACHE", str(tmp_path / "cache"))
    assert main(["scenes", "city", "--preset", "quick", "--out", str(tmp_path / name)]) == 2
    assert "must be a file that ends in one of: .exr, .tif, .tiff" in capsys.readouterr().err
    assert not (tmp_path / "cache").exists()


def test_a_place_where_nothing_can_be_written_is_refused_before_rendering(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def read_only(path: Path, held: bytes) -> int:
        if path.parent == tmp_path:
            raise PermissionError(13, "Permission denied", str(path))
        return write(path, held)

    monkeypatch.setattr(Path, "write_bytes", read_only)
    monkeypatch.setenv("DSIS_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "city.exr"
    assert main(["scenes", "city", "--preset", "quick", "--out", str(out)]) == 2
    assert capsys.readouterr().err == f"dsis: {out}: cannot be written: Permission denied\n"
    assert not (tmp_path / "cache").exists()


def test_help_says_where_panoramas_are_kept(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["scenes", "--help"])
    said = capsys.readouterr().out
    assert "$DSIS_CACHE/scenes" in said
    assert "~/.cache" in said


def test_presets_are_twice_the_clips() -> None:
    strips = {name: preset_strip(name, "city", 1) for name in ("standard", "lab")}
    sizes = {name: (strip.columns, strip.rows) for name, strip in strips.items()}
    assert sizes == {"standard": (2920, 1080), "lab": (5840, 2160)}
