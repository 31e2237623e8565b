"""Promise: a recording that cannot be right is refused, all its faults in one message."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from dsis import imagefile
from dsis.errors import InputError
from dsis.recording import read_recording
from recording_folders import COLUMNS, ROWS, TOML, described, exposure, frames_of, message_of, save


def _unknown_keys(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"', gain=2), sensor=TOML + "iso = 100\n")


def _missing_file(folder: Path) -> Path:
    return described(folder, exposure("a", '["a.tif", "b.tif"]'))


def _empty_glob(folder: Path) -> Path:
    return described(folder, exposure("a", '"flat/*.tif"'))


def _no_frames(folder: Path) -> Path:
    return described(folder, exposure("a", "[]"))


def _no_exposures(folder: Path) -> Path:
    return described(folder)


def _same_name(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"'), exposure("a", '"a.tif"'))


def _wrong_size(folder: Path) -> Path:
    save(folder / "b.tif", frames_of(1)[0][:, :-2])
    return described(folder, exposure("a", '["b.tif", "a.tif", "a.tif"]'))


def _eight_bit(folder: Path) -> Path:
    save(folder / "b.tif", frames_of(1, top=200)[0].astype(np.uint8))
    save(folder / "c.tif", frames_of(1, 2)[0])
    return described(folder, exposure("a", '["b.tif", "a.tif", "c.tif"]'))


def _eight_bit_only(folder: Path) -> Path:
    save(folder / "b.tif", frames_of(1, top=200)[0].astype(np.uint8))
    return described(folder, exposure("a", '"b.tif"'))


def _colour(folder: Path) -> Path:
    save(folder / "b.tif", np.zeros((ROWS, COLUMNS, 3), np.uint16))
    return described(folder, exposure("a", '["a.tif", "b.tif"]'))


def _signed(folder: Path) -> Path:
    save(folder / "b.tif", np.zeros((ROWS, COLUMNS), np.int16))
    return described(folder, exposure("a", '["a.tif", "b.tif"]'))


def _float(folder: Path) -> Path:
    save(folder / "b.exr", np.zeros((ROWS, COLUMNS), np.float32))
    return described(folder, exposure("a", '["a.tif", "b.exr"]'))


def _nan(folder: Path) -> Path:
    np.save(folder / "b.npy", np.full((ROWS, COLUMNS), np.nan))
    return described(folder, exposure("a", '["a.tif", "b.npy"]'))


def _stack(folder: Path) -> Path:
    np.save(folder / "b.npy", np.zeros((4, ROWS, COLUMNS), np.uint16))
    return described(folder, exposure("a", '["a.tif", "b.npy"]'))


def _pickle(folder: Path) -> Path:
    (folder / "b.npy").write_bytes(b"\x93NUMPY and nothing else")
    return described(folder, exposure("a", '["a.tif", "b.npy"]'))


def _no_image(folder: Path) -> Path:
    (folder / "b.tif").write_text("hello", encoding="utf-8")
    return described(folder, exposure("a", '["a.tif", "b.tif"]'))


def _pages(folder: Path) -> Path:
    pages = [Image.fromarray(codes) for codes in frames_of(2)]
    pages[0].save(folder / "b.tif", save_all=True, append_images=pages[1:])
    return described(folder, exposure("a", '["a.tif", "b.tif"]'))


def _dark_light(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"', kind="dark", light=3.0))


def _no_light(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"', light=0.0))


def _no_time(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"', exposure_time_s=0.0))


def _kind(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"', kind="flatfield"))


def _white(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"'), sensor=TOML.replace("4095", "65535"))


def _fraction(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"'), sensor=TOML.replace("4095", "4094.5"))


def _pattern(folder: Path) -> Path:
    return described(folder, exposure("a", '"a.tif"'), sensor=TOML.replace("MONO", "XTRANS"))


BROKEN: list[tuple[Callable[[Path], Path], list[str]]] = [
    (_unknown_keys, ["sensor.iso: unknown key", "exposure[0].gain: unknown key"]),
    (_missing_file, ["exposure[0].frames: 'b.tif' is missing"]),
    (_empty_glob, ["exposure[0].frames: 'flat/*.tif' matches no file"]),
    (_no_frames, ["exposure[0].frames: has 0 items, must have at least 1"]),
    (_no_exposures, ["exposure: is missing"]),
    (_same_name, ["2 exposures are named 'a'"]),
    (_wrong_size, ["b.tif has 24 x 30 pixels, must have 24 x 32 (rows x columns) like a.tif"]),
    (_eight_bit, ["b.tif holds uint8 codes, must hold uint16 like a.tif"]),
    (_eight_bit_only, ["b.tif holds uint8 codes, which cannot reach white_level = 4095"]),
    (_colour, ["b.tif holds an array of 24 x 32 x 3, must hold one channel"]),
    (_signed, ["b.tif holds int16 values, must hold unsigned whole codes"]),
    (_float, ["b.exr holds float values, must hold unsigned whole codes"]),
    (_nan, ["b.npy holds float64 values, some NaN or infinite; must hold unsigned"]),
    (_stack, ["b.npy holds an array of 4 x 24 x 32, must hold one channel"]),
    (_pickle, ["b.npy is damaged or no .npy file"]),
    (_no_image, ["b.tif is no readable image"]),
    (_pages, ["b.tif holds more than one image, must hold one frame"]),
    (_dark_light, ["exposure[0]: light is 3, must be 0 or absent: the exposure is dark"]),
    (_no_light, ["exposure[0]: light is 0, must be greater than 0 in a flat"]),
    (_no_time, ["exposure[0].exposure_time_s: is 0.0, must be greater than 0: give the time"]),
    (_kind, ["exposure[0].kind: is \"flatfield\", must be 'dark', 'flat' or 'scene'"]),
    (_white, ["sensor: white_level is 65535, must be <= 4095"]),
    (_fraction, ["sensor: white_level is 4094.5, must be a whole number"]),
    (_pattern, ['sensor.cfa: is "XTRANS", must be']),
]


class TestBroken:
    @pytest.mark.parametrize(("spoil", "says"), BROKEN, ids=lambda v: getattr(v, "__name__", ""))
    def test_one_clear_message(
        self, tmp_path: Path, spoil: Callable[[Path], Path], says: list[str]
    ) -> None:
        save(tmp_path / "a.tif", frames_of(1)[0])
        message = message_of(spoil(tmp_path))
        assert "recording.toml" in message
        for part in says:
            assert part in message
        assert len(message.splitlines()) == len(says)

    def test_all_faults_in_one_message(self, tmp_path: Path) -> None:
        save(tmp_path / "a.tif", frames_of(1)[0])
        save(tmp_path / "b.tif", frames_of(1)[0][1:])
        sensor = TOML.replace('"MONO"', '"MONOCHROME"')
        described(
            tmp_path,
            exposure("a", '["a.tif", "a.tif", "b.tif"]'),
            exposure("b", '"c.tif"', gain=2),
            exposure("c", '["c.tif", "d.tif"]'),
            sensor=sensor,
        )
        message = message_of(tmp_path)
        for part in ("sensor.cfa", "exposure[1].gain", "b.tif has 23", "'c.tif'", "'d.tif'"):
            assert part in message
        assert len(message.splitlines()) == 5

    def test_what_is_no_recording_at_all(self, tmp_path: Path) -> None:
        assert "holds no recording.toml" in message_of(tmp_path)
        assert "is missing" in message_of(tmp_path / "nowhere")
        (tmp_path / "a.csv").write_text("1", encoding="utf-8")
        assert "must be one of: a folder with recording.toml" in message_of(tmp_path / "a.csv")
        (tmp_path / "recording.toml").write_text("[sensor", encoding="utf-8")
        assert "is not TOML" in message_of(tmp_path)

    @pytest.mark.parametrize("compressed", [False, True])
    @pytest.mark.parametrize("share", [0.02, 0.5, 0.9, 0.999])
    def test_a_truncated_tiff_is_named(
        self, tmp_path: Path, share: float, *, compressed: bool
    ) -> None:
        """Where its header survives, headers pass and the stream refuses it."""
        path = save(tmp_path / "b.tif", frames_of(1)[0], compressed=compressed)
        whole = path.read_bytes()
        path.write_bytes(whole[: int(share * len(whole))])
        described(tmp_path, exposure("a", '"b.tif"'))

        def stream() -> None:
            found = read_recording(tmp_path)
            list(found.frames(found.exposures[0]))

        with pytest.raises(InputError, match=r"b\.tif") as refused:
            stream()
        assert "damaged" in str(refused.value) or "no readable image" in str(refused.value)
        assert len(str(refused.value).splitlines()) == 1

    @pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
    def test_a_truncated_picture_is_refused_in_one_line(self, tmp_path: Path, share: float) -> None:
        """As source of a test's content; the TIFF library complains of every strip by itself."""
        path = tmp_path / "picture.tif"
        noise = np.random.default_rng(1).uniform(size=(200, 300, 3)).astype(np.float32)
        imagefile.write(path, noise, "tiff16")
        whole = path.read_bytes()
        path.write_bytes(whole[: int(share * len(whole))])

        def use() -> None:
            imagefile.info(path)
            imagefile.read(path)

        with pytest.raises(InputError, match=r"picture\.tif") as refused:
            use()
        assert len(str(refused.value).splitlines()) == 1

    def test_a_code_above_the_white_level(self, tmp_path: Path) -> None:
        codes = frames_of(1)[0]
        codes[3, 4] = 4096
        save(tmp_path / "b.tif", codes)
        found = read_recording(described(tmp_path, exposure("a", '"b.tif"')))
        says = r"b\.tif: holds code 4096, must hold none above white_level = 4095"
        with pytest.raises(InputError, match=says):
            list(found.frames(found.exposures[0]))

    def test_a_frame_that_changed_its_size_since(self, tmp_path: Path) -> None:
        save(tmp_path / "b.tif", frames_of(1)[0])
        found = read_recording(described(tmp_path, exposure("a", '"b.tif"')))
        save(tmp_path / "b.tif", frames_of(1)[0][1:])
        with pytest.raises(InputError, match="has 23 x 32 pixels, must have 24 x 32"):
            found.frame(found.exposures[0], 0)
