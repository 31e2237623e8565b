"""Promise: EMVA 1288 descriptors and camera raw files are read wherever a recording is."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Self

import numpy as np
import pytest
from PIL import Image

from dsis.cfa import Cfa
from dsis.recording import read_recording
from recording_folders import TOML, described, exposure, frames_of, message_of, save


class TestDescriptor:
    def test_the_real_measurement(self, shared_data: Path) -> None:
        found = read_recording(shared_data / "emva1288_ccd12" / "EMVA1288_Data.txt")
        assert (found.rows, found.columns) == (480, 640)
        assert found.sensor.cfa is Cfa.MONO
        assert (found.sensor.bit_depth, found.sensor.white_level) == (12, 4095.0)
        flats, darks = found.of_kind("flat"), found.of_kind("dark")
        assert len(flats) == len(darks) == 51
        assert [len(e.frames) for e in flats] == [len(e.frames) for e in darks] == [2] * 50 + [50]
        first, last = flats[0], flats[49]
        assert (first.exposure_time_s, first.light) == (pytest.approx(40e-6, rel=1e-12), 120.0)
        assert (last.exposure_time_s, last.light) == (pytest.approx(14.02e-3, rel=1e-12), 42137.0)
        assert flats[50].exposure_time_s == darks[50].exposure_time_s
        assert all(dark.light is None for dark in darks)
        for e in (flats[7], darks[50]):
            for codes, path in zip(found.frames(e, range(2)), e.frames, strict=False):
                np.testing.assert_array_equal(codes, np.asarray(Image.open(path)))

    def test_saturated_levels_of_the_real_measurement_are_remarked(self, shared_data: Path) -> None:
        found = read_recording(shared_data / "emva1288_ccd12" / "EMVA1288_Data.txt")
        remarks = found.remarks(threads=2)
        assert any(r.startswith("flat-37: ") and "clipped" in r for r in remarks)
        assert any(r.startswith("flat-49: saturated") for r in remarks)
        assert not any("flat-36" in r or "identical" in r for r in remarks)

    def test_every_fault_names_its_line(self, tmp_path: Path) -> None:
        save(tmp_path / "images" / "a.png", frames_of(1)[0])
        save(tmp_path / "images" / "b.png", frames_of(1)[0][:-1])
        lines = [
            "# v 1.0", "n 12 32 24", "b 1000,5 12.5", "i images\\a.png", "i images\\b.png",
            "d -3", "i images\\c.png", "x what", "b 5", "d 7",
        ]  # fmt: skip
        path = tmp_path / "data.txt"
        path.write_bytes("\r\n".join(lines).encode() + b"\r\n# \xe4\r\n")
        says = message_of(path)
        for part in (
            "line 3 (flat-00): images/b.png has 23 x 32 pixels, must have 24 x 32",
            "line 6: exposure time is -3 ns",
            "line 7: 'images\\\\c.png' is missing",
            "line 8: 'x what' is not understood, must be one of: v release",
            "line 9: 'b 5' is not understood",
            "line 10: has no frames",
        ):
            assert part in says
        assert len(says.splitlines()) == 6


class FakeRaw:
    """What `rawpy.RawPy` offers, of a file that holds a NumPy array."""

    pattern = np.array([[3, 2], [0, 1]], np.uint8)  # GBRG with the second green as 3
    num_colors, color_desc, white_level = 3, b"RGBG", 4000
    black_level_per_channel = (64, 64, 66, 66)
    other = SimpleNamespace(shutter_speed=0.02)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def open_file(self, path: str) -> None:
        try:
            self.codes = np.load(path)
        except ValueError:
            raise FakeRawError(b"Unsupported file format") from None
        self.sizes = SimpleNamespace(height=self.codes.shape[0], width=self.codes.shape[1])

    @property
    def raw_pattern(self) -> np.ndarray:
        return self.pattern

    @property
    def raw_image_visible(self) -> np.ndarray:
        return self.codes


class FakeRawError(Exception):
    """Stands for `rawpy.LibRawError`."""


class TestCameraRaw:
    @pytest.fixture
    def library(self, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
        module = SimpleNamespace(RawPy=FakeRaw, LibRawError=FakeRawError)
        monkeypatch.setitem(sys.modules, "rawpy", module)
        return module

    def shot(self, path: Path) -> np.ndarray:
        codes = frames_of(1, top=3900)[0]
        with path.open("wb") as file:
            np.save(file, codes)
        return codes

    @pytest.mark.usefixtures("library")
    def test_a_single_file_is_a_scene(self, tmp_path: Path) -> None:
        codes = self.shot(tmp_path / "IMG_1.DNG")
        found = read_recording(tmp_path / "IMG_1.DNG")
        assert found.sensor.cfa is Cfa.GBRG
        assert (found.sensor.black_level, found.sensor.white_level) == (65.0, 4000.0)
        (scene,) = found.exposures
        assert (scene.kind, scene.exposure_time_s) == ("scene", 0.02)
        np.testing.assert_array_equal(found.frame(scene, 0), codes)

    @pytest.mark.usefixtures("library")
    def test_frames_of_a_recording(self, tmp_path: Path) -> None:
        codes = self.shot(tmp_path / "1.cr3")
        sensor = TOML.replace("MONO", "GBRG")
        found = read_recording(described(tmp_path, exposure("a", '"1.cr3"'), sensor=sensor))
        np.testing.assert_array_equal(found.frame(found.exposures[0], 0), codes)
        described(tmp_path, exposure("a", '"1.cr3"'), sensor=TOML.replace("MONO", "RGGB"))
        assert "1.cr3 has filters GBRG, must have RGGB" in message_of(tmp_path)

    @pytest.mark.usefixtures("library")
    def test_a_damaged_file_is_named(self, tmp_path: Path) -> None:
        (tmp_path / "1.nef").write_bytes(b"nothing")
        assert "1.nef: is no readable camera raw: Unsupported" in message_of(tmp_path / "1.nef")

    def test_without_the_extra_the_message_says_how_to_get_it(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setitem(sys.modules, "rawpy", None)
        self.shot(tmp_path / "1.dng")
        for path in (tmp_path / "1.dng", described(tmp_path, exposure("a", '"1.dng"'))):
            assert "pip install 'dsis[raw]'" in message_of(path)
