"""Promise: the four conditions are the paper's, on disk as the manifest says, bit for bit again."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsis.cli import main
from dsis.errors import DamagedError, InputError
from dsis.manifest import read_manifest
from dsis.spec import read_spec
from dsis.stimuli import build_stimuli, check_stimuli
from folder_bytes import every_byte
from ramp import COLUMNS, FRAMES, ROWS, frames_of, write_test


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stimuli")
    build_stimuli(read_spec(write_test(folder, levels=(0, 2))), folder / "out", jobs=2)
    return folder / "out"


def test_every_condition_is_there(built: Path) -> None:
    manifest = read_manifest(built)
    names = {clip.stimulus for clip in manifest.clips}
    conditions = {
        f"ramp__{noise}__{dem}__{level}"
        for noise in ("awgn", "sd")
        for dem in ("none", "bilinear", "lu_tan")
        for level in (0, 2)
    }
    assert names == {"ramp__reference"} | conditions
    assert check_stimuli(built) == 13 * FRAMES


def test_any_number_of_jobs_gives_the_same_bytes(built: Path, tmp_path: Path) -> None:
    spec = built.parent / "spec.toml"
    build_stimuli(read_spec(spec), tmp_path / "one", jobs=1)
    assert every_byte(tmp_path / "one") == every_byte(built)


def test_a_manifest_builds_the_same_clips_again(built: Path, tmp_path: Path) -> None:
    build_stimuli(read_spec(built / "manifest.json"), tmp_path / "again", jobs=2)
    assert every_byte(tmp_path / "again") == every_byte(built)


def test_another_seed_gives_other_noise_on_the_same_reference(built: Path, tmp_path: Path) -> None:
    build_stimuli(read_spec(built.parent / "spec.toml", seed=4), tmp_path / "other", jobs=2)
    name = "ramp__reference"
    np.testing.assert_array_equal(frames_of(tmp_path / "other", name), frames_of(built, name))
    name = "ramp__sd__none__0"
    assert (frames_of(tmp_path / "other", name) != frames_of(built, name)).any()


def test_logged_psnr_is_that_of_the_files(built: Path) -> None:
    manifest = read_manifest(built)
    reference = frames_of(built, "ramp__reference").astype(np.float64)
    for clip in manifest.clips:
        if clip.role == "test":
            error = frames_of(built, clip.stimulus) - reference
            psnr = 10 * np.log10(255**2 / (error**2).mean(axis=(1, 2, 3)))
            np.testing.assert_allclose(clip.quality.psnr_db, psnr, rtol=1e-9)


def test_white_noise_is_matched_to_the_camera_noise(built: Path) -> None:
    """Short clips are matched on all frames: to the tolerance of sigma, 0.001 of a code."""
    manifest = read_manifest(built)
    for level in (0, 2):
        awgn, sd = (
            float(
                np.mean(
                    [p or 0 for p in manifest.clip(f"ramp__{n}__none__{level}").quality.psnr_db]
                )
            )
            for n in ("awgn", "sd")
        )
        assert abs(awgn - sd) < 0.005
    weak, strong = (manifest.clip(f"ramp__sd__none__{level}").quality for level in (0, 2))
    assert np.mean(strong.psnr_db) < np.mean(weak.psnr_db) - 3


@pytest.mark.parametrize(
    "awgn", [{"sigma": 4.28}, {"match": "visibility"}], ids=["given", "matched"]
)
def test_white_noise_level_given_or_matched_by_visibility(
    awgn: dict[str, Any], tmp_path: Path
) -> None:
    manifest = build_stimuli(read_spec(write_test(tmp_path, awgn=awgn)), tmp_path / "out")
    white, camera = (manifest.clip(f"ramp__{n}__none__0") for n in ("awgn", "sd"))
    if "sigma" in awgn:
        assert white.awgn_sigma == 4.28
        assert white.quality.psnr_float_db[0] == pytest.approx(
            20 * np.log10(255 / 4.28), abs=5 * 4.343 * np.sqrt(2 / (ROWS * COLUMNS * 3))
        )
    else:
        # The energy is measured on three of the six frames that were matched.
        assert white.quality.visible_noise == pytest.approx(camera.quality.visible_noise, rel=0.1)


@pytest.mark.parametrize("damage", ["flip", "missing", "short", "long"])
def test_check_finds_what_is_wrong(built: Path, tmp_path: Path, damage: str) -> None:
    shutil.copytree(built, tmp_path / "copy")
    clip = tmp_path / "copy" / "player" / "ramp__sd__none__0.rgb"
    data = bytearray(clip.read_bytes())
    if damage == "flip":
        data[2 * ROWS * COLUMNS * 3 + 5] ^= 1
    elif damage == "short":
        del data[-1:]
    elif damage == "long":
        data += bytes(ROWS * COLUMNS * 3)
    clip.write_bytes(data)
    if damage == "missing":
        clip.unlink()
    with pytest.raises(DamagedError) as raised:
        check_stimuli(tmp_path / "copy")
    expected = {"flip": "frame 2 is not", "missing": "cannot be read", "short": "frame 5 is not"}
    assert expected.get(damage, "7 frames, must be 6") in str(raised.value)
    assert "ramp__sd__none__0" in str(raised.value)
    assert main(["stimuli", "--check", str(tmp_path / "copy")]) == 1


def test_foreign_folders_and_recorded_votes_are_not_replaced(built: Path, tmp_path: Path) -> None:
    test = read_spec(built.parent / "spec.toml")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("keep me", encoding="utf-8")
    with pytest.raises(InputError, match=r"not empty and holds no manifest\.json"):
        build_stimuli(test, tmp_path / "mine")
    shutil.copytree(built, tmp_path / "voted")
    (tmp_path / "voted" / "session").mkdir()
    with pytest.raises(InputError, match="recorded votes \\(session\\), which would be lost"):
        build_stimuli(test, tmp_path / "voted")
    assert (tmp_path / "mine" / "thesis.txt").exists()


def test_dry_run_says_disk_memory_and_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = write_test(tmp_path)
    assert main(["stimuli", str(spec), "--out", str(tmp_path / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "7 clips, 42 frames" in said
    assert f"{7 * FRAMES * ROWS * COLUMNS * 3 / 1000:.3g} kB" in said
    assert "memory" in said
    assert "time" in said
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "out.partial").exists()
