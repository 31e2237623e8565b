"""Promise: what many frames or exposures have in common is said once, and how many have it."""

from pathlib import Path

import numpy as np
import pytest

from dsis.errors import InputError
from dsis.recording import Recording, read_recording
from dsis.recording.frameformat import read_frame
from recording_folders import TOML, described, exposure, frames_of, message_of, save


def _five(folder: Path, suffix: str, **more: object) -> Path:
    parts = [exposure(f"f{i}", f'"f{i}/*.{suffix}"', **more) for i in range(5)]
    return described(folder, *parts)


def _arrays(folder: Path, made: object) -> Path:
    for i in range(5):
        (folder / f"f{i}").mkdir()
        for number, codes in enumerate(frames_of(6, i)):
            np.save(folder / f"f{i}" / f"{number}.npy", made(codes))
    return _five(folder, "npy")


@pytest.mark.parametrize(
    ("made", "fact"),
    [
        (lambda c: c.astype(np.int16), "holds int16 values, must hold unsigned whole codes ("),
        (lambda c: c.astype(float), "holds float64 values, must hold unsigned whole codes ("),
        (lambda c: np.stack([c] * 3, 2), "holds an array of 24 x 32 x 3, must hold one channel ("),
    ],
)
def test_frames_that_cannot_be_used(tmp_path: Path, made: object, fact: str) -> None:
    (says,) = message_of(_arrays(tmp_path, made)).splitlines()
    assert f"exposure[0].frames: f0/0.npy {fact}" in says
    assert says.endswith("(the first of 30 such frames)")


def test_every_unsigned_type_that_is_read_is_allowed(tmp_path: Path) -> None:
    wide = read_recording(_arrays(tmp_path, lambda c: c.astype(np.uint64)))
    codes = wide.frame(wide.exposures[0], 0)
    np.testing.assert_array_equal(codes, frames_of(6, 0)[0])
    np.save(tmp_path / "f0" / "0.npy", codes.astype(np.int32))
    allowed = "must hold unsigned whole codes (uint8, uint16, uint32 or uint64)"
    assert allowed in message_of(tmp_path)


def test_files_of_no_known_format_are_told_which_are(tmp_path: Path) -> None:
    for i in range(5):
        (tmp_path / f"f{i}").mkdir()
        for number, codes in enumerate(frames_of(6, i)):
            codes.tofile(tmp_path / f"f{i}" / f"{number}.raw")
    (says,) = message_of(_five(tmp_path, "raw")).splitlines()
    known = "TIFF, PNG, PGM, DPX, .npy, DNG or camera raw"
    assert f"f0/0.raw is a .raw file, must be a frame in {known} (the first of 30" in says


def test_a_key_at_fault_in_every_exposure(tmp_path: Path) -> None:
    for i in range(5):
        save(tmp_path / f"f{i}" / "0.tif", frames_of(1, i)[0])
    says = message_of(_five(tmp_path, "tif", iso=100)).splitlines()
    assert len(says) == 1
    assert "exposure[0].iso: unknown key" in says[0]
    assert says[0].endswith("(the first of 5 such exposures)")


def test_missing_frames(tmp_path: Path) -> None:
    """A few are named one by one, of a whole folder the first."""
    names = ", ".join(f'"f/{number}.tif"' for number in range(12))
    (says,) = message_of(described(tmp_path, exposure("f", f"[{names}]"))).splitlines()
    assert says.endswith("'f/0.tif' is missing (the first of 12 missing frames)")


class TestCopies:
    def of(self, folder: Path, **frames: str) -> tuple[str, ...]:
        found: Recording = read_recording(
            described(folder, *(exposure(name, files) for name, files in frames.items()))
        )
        return found.remarks()

    def test_a_glob_that_is_listed_twice(self, tmp_path: Path) -> None:
        for number, codes in enumerate(frames_of(6)):
            save(tmp_path / "f" / f"{number}.tif", codes)
        (says,) = self.of(tmp_path, f='["f/*.tif", "f/*.tif"]')
        assert says == (
            "the same file is listed more than once: 0.tif is f frame 0, f frame 6 "
            "(the first of 6 in f)"
        )

    def test_an_exposure_that_is_a_copy_of_another(self, tmp_path: Path) -> None:
        for number, codes in enumerate(frames_of(12)):
            save(tmp_path / "f" / f"{number}.tif", codes)
            save(tmp_path / "g" / f"{number}.tif", codes)
        (says,) = self.of(tmp_path, g='"g/*.tif"', f='"f/*.tif"')
        assert says == (
            "byte-identical frames, noise cannot repeat itself: g frame 0, f frame 0 "
            "(the first of 12 in g, f)"
        )

    def test_frames_come_in_the_order_of_their_numbers(self, tmp_path: Path) -> None:
        codes = frames_of(11)
        codes[10] = codes[4]
        for number, one in enumerate(codes):
            save(tmp_path / "f" / f"{number}.tif", one)
        (says,) = self.of(tmp_path, f='"f/*.tif"')
        assert says.endswith("itself: f frame 4, f frame 10")


def test_text_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    """Editors and shells of Windows write one before UTF-8."""
    save(tmp_path / "a.tif", frames_of(1)[0])
    text = "\n".join([TOML, exposure("a", '"a.tif"')])
    (tmp_path / "recording.toml").write_text(text, encoding="utf-8-sig")
    assert len(read_recording(tmp_path).exposures) == 1
    lines = "n 12 32 24\nb 1000 12\ni a.tif\n"
    (tmp_path / "emva.txt").write_text(lines, encoding="utf-8-sig")
    assert len(read_recording(tmp_path / "emva.txt").exposures) == 1


def test_frames_below_a_line_that_is_not_understood_are_no_faults(tmp_path: Path) -> None:
    save(tmp_path / "a.tif", frames_of(1)[0])
    lines = "n 12 32 24\nb ten\ni a.tif\ni a.tif\nd 1000\ni a.tif\n"
    (tmp_path / "emva.txt").write_text(lines, encoding="utf-8")
    (says,) = message_of(tmp_path / "emva.txt").splitlines()
    assert "line 2: 'b ten' is not understood" in says
    (tmp_path / "emva.txt").write_text("n 12 32 24\ni a.tif\nd 1000\ni a.tif\n", encoding="utf-8")
    assert "line 2: 'i a.tif' stands before the first b or d" in message_of(tmp_path / "emva.txt")


def test_frames_of_a_descriptor_that_are_all_missing(tmp_path: Path) -> None:
    lines = ["n 12 32 24", "b 1000 12", *(f"i {number}.png" for number in range(9))]
    (tmp_path / "emva.txt").write_text("\n".join(lines), encoding="utf-8")
    (says,) = message_of(tmp_path / "emva.txt").splitlines()
    assert says.endswith("line 3: '0.png' is missing (the first of 9 missing frames)")


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_nobody_but_us_says_that_a_png_is_cut(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], share: float
) -> None:
    path = save(tmp_path / "a.png", frames_of(1)[0])
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(InputError, match="is damaged: it ends within its chunk IDAT"):
        read_frame(path)
    assert capfd.readouterr().err == ""
