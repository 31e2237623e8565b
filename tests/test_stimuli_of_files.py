"""Promise: frames, stills and cameras of the user become stimuli in every format."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from dsis.cli import main
from dsis.imagefile import read, write
from dsis.manifest import read_manifest
from dsis.spec import SHIPPED, read_spec
from dsis.spec.schema import Format
from dsis.stimuli import build_stimuli, check_stimuli
from folder_bytes import every_byte
from ramp import COLUMNS, FRAMES, ROWS, frames_of, scene, write_test


def test_formats_hold_the_same_frames(tmp_path: Path) -> None:
    formats = ["player", "png8", "tiff16", "dpx16", "exr"]
    spec = write_test(tmp_path, formats=formats)
    manifest = build_stimuli(read_spec(spec), tmp_path / "out", jobs=2)
    assert check_stimuli(tmp_path / "out", jobs=2) == len(manifest.clips) * FRAMES * len(formats)
    name = "ramp__sd__bilinear__0"
    player = frames_of(tmp_path / "out", name)[3] / 255
    # Half a code of 8 bits, of 16 bits, and half floats' 11 bits below 1.
    for form, extension, error in (
        ("png8", "png", 1e-6),
        ("tiff16", "tif", 0.51 / 255),
        ("dpx16", "dpx", 0.51 / 255),
        ("exr", "exr", 0.51 / 255 + 2**-12),
    ):
        image = read(tmp_path / "out" / form / name / f"00003.{extension}")
        assert np.abs(np.clip(image, 0, 1) - player).max() <= error, form


def test_no_byte_depends_on_the_folder_that_the_stimuli_go_to(tmp_path: Path) -> None:
    """Whatever the format: two places, names of different lengths, one of them not ASCII."""
    spec = write_test(tmp_path, formats=list(get_args(Format)))
    folders = tmp_path / "here", tmp_path / "somewhere else \N{LATIN SMALL LETTER E WITH ACUTE}"
    for folder in folders:
        build_stimuli(read_spec(spec), folder)
    one, other = (every_byte(folder) for folder in folders)
    assert {name.split("/")[0] for name in one} > set(get_args(Format))
    assert one == other
    del one["manifest.json"]  # names where the footage lies, to build the same again
    assert not [name for name, held in one.items() if bytes(tmp_path.parent) in held]


def test_a_numbered_sequence_is_read_in_natural_order(tmp_path: Path) -> None:
    spec = write_test(tmp_path)
    for frame in range(12):
        light = np.full((ROWS, COLUMNS, 3), 0.02 * (frame + 1), np.float32)
        write(tmp_path / f"take{frame}.exr", light, "exr")
    text = spec.read_text(encoding="utf-8").replace('"ramp.exr"', '"take*.exr"')
    spec.write_text(text.replace("pan_px_per_frame = 0.5\n", ""), encoding="utf-8")
    build_stimuli(read_spec(spec), tmp_path / "out")
    levels = frames_of(tmp_path / "out", "ramp__reference").mean(axis=(1, 2, 3))
    assert (np.diff(levels) > 0).all()


def test_stills_are_contents_of_their_own_with_a_remark(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write(tmp_path / f"{name}.png", np.clip(scene(300, 520), 0, 1), "png8")
    text = (SHIPPED / "stills.toml").read_text(encoding="utf-8")
    text = text.replace("seconds = 0.4", "seconds = 0.04").replace("_s = 0.4", "_s = 0.04")
    (tmp_path / "s.toml").write_text(text.replace("training = 4", "training = 0"), encoding="utf-8")
    manifest = build_stimuli(read_spec(tmp_path / "s.toml", [tmp_path]), tmp_path / "out")
    assert {clip.content for clip in manifest.clips} == {"one", "two"}
    assert len(manifest.remarks) == 2
    assert "not noise-free, display-referred" in manifest.remarks[0]
    # Un-tone-mapped comes back: but for the optics, the reference is the still.
    data = np.fromfile(tmp_path / "out" / "player" / "one__reference.rgb", np.uint8)
    still = read(tmp_path / "one.png")[15:285, 20:500]
    assert np.abs(data.reshape(270, 480, 3) / 255 - still).mean() < 0.01


def test_a_camera_with_effects_says_what_they_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Row noise of 120 DN on about 50 must lower PSNR and be seen; AWGN knows no camera."""
    spec = write_test(tmp_path, camera="striped", awgn={"sigma": 4.0})
    shipped = (SHIPPED / "cameras" / "dual_gain_cinema.toml").read_text(encoding="utf-8")
    camera = tmp_path / "cameras" / "striped.toml"
    camera.parent.mkdir()
    camera.write_text(
        shipped + '[[effect]]\nkind = "row_noise"\nsigma_dn = 120\n', encoding="utf-8"
    )
    assert main(["stimuli", str(spec), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    manifest = read_manifest(tmp_path / "out")
    for name in ("ramp__sd__none__0", "ramp__sd__bilinear__0"):
        quality = manifest.clip(name).quality
        with_effects = [quality.psnr_db[frame] for frame in quality.visible_frames]
        assert np.mean(with_effects) < np.mean(quality.base_psnr_db) - 0.3
        assert quality.visible_noise > 1.2 * quality.base_visible_noise
        assert f"effects on {name}: PSNR" in said
    assert manifest.clip("ramp__awgn__none__0").quality.base_psnr_db == ()
    # The base model alone is the same test without the effect, bit for bit.
    camera.write_text(shipped, encoding="utf-8")
    plain = build_stimuli(read_spec(spec), tmp_path / "plain")
    before = plain.clip("ramp__sd__none__0").quality
    after = manifest.clip("ramp__sd__none__0").quality
    assert [before.psnr_db[frame] for frame in before.visible_frames] == list(after.base_psnr_db)
    assert before.visible_noise == pytest.approx(after.base_visible_noise, rel=1e-12)
