"""Promise: recordings are read exactly, streamed, checked with all faults at once, written back."""

import hashlib
import json
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Self

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - a foreign writer here
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from dsis import imagefile
from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.imagefile import codes_info, read_codes
from dsis.recording import (
    ExposurePlan,
    Recording,
    Sensor,
    read_recording,
    write_recording,
)
from dsis.recording import model as recording_model
from dsis.recording.ahead import in_order

ROWS, COLUMNS = 24, 32
SENSOR = Sensor(name="s", cfa=Cfa.MONO, black_level=16.0, white_level=4095.0, bit_depth=12)
TOML = """
[sensor]
name = "s"
cfa = "MONO"
black_level = 16.0
white_level = 4095
bit_depth = 12
"""


def frames_of(count: int, seed: int = 0, top: int = 4000) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.integers(17, top, (ROWS, COLUMNS), dtype=np.uint16) for _ in range(count)]


def exposure(name: str, frames: str, **more: object) -> str:
    values = {"kind": "flat", "exposure_time_s": 0.01} | more
    lines = [f"{key} = {json.dumps(value)}" for key, value in values.items()]
    return "\n".join(["[[exposure]]", f'name = "{name}"', *lines, f"frames = {frames}", ""])


def described(folder: Path, *exposures: str, sensor: str = TOML) -> Path:
    (folder / "recording.toml").write_text("\n".join([sensor, *exposures]), encoding="utf-8")
    return folder


def save(
    path: Path, codes: np.ndarray, bits: int | None = None, *, compressed: bool = False
) -> Path:
    """Write codes with OpenImageIO itself, packed to `bits` where given."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kinds = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "uint32": oiio.UINT32,
             "int16": oiio.INT16, "float32": oiio.FLOAT}  # fmt: skip
    pixels = codes if codes.ndim == 3 else codes[:, :, np.newaxis]
    spec = oiio.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], kinds[codes.dtype.name])
    spec.attribute("compression", "zip" if compressed else "none")
    if bits is not None:
        spec.attribute("oiio:BitsPerSample", bits)
        pixels = (pixels << (16 - bits)) | (pixels >> (2 * bits - 16))
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(np.ascontiguousarray(pixels))
    out.close()
    return path


def message_of(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        read_recording(path)
    return str(refused.value)


def tree(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


class TestRoundTrip:
    names = st.text(min_size=1, max_size=12).filter(lambda s: s.isprintable())
    plans = st.lists(
        st.builds(
            ExposurePlan,
            name=names,
            kind=st.sampled_from(["flat", "scene"]),
            exposure_time_s=st.floats(1e-7, 1e4),
            frames=st.integers(1, 3),
            light=st.none() | st.floats(1e-9, 1e12),
        )
        | st.builds(
            ExposurePlan,
            name=names,
            kind=st.just("dark"),
            exposure_time_s=st.floats(1e-7, 1e4),
            frames=st.integers(1, 3),
        ),
        min_size=1,
        max_size=4,
        unique_by=lambda plan: plan.name,
    )

    @settings(
        max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
    )
    @given(plans=plans, cfa=st.sampled_from(Cfa), black=st.floats(0, 60000), seed=st.integers(0, 9))
    def test_what_was_written_reads_back_equal(
        self, tmp_path: Path, plans: list[ExposurePlan], cfa: Cfa, black: float, seed: int
    ) -> None:
        sensor = Sensor(name="ü", cfa=cfa, black_level=black, white_level=65535.0, bit_depth=16)
        frames = frames_of(sum(plan.frames for plan in plans), seed, 65535)
        written = write_recording(tmp_path / "r", sensor, plans, iter(frames))
        again = read_recording(tmp_path / "r")
        assert again == written == read_recording(tmp_path / "r" / "recording.toml")
        assert again.sensor == sensor
        assert [e.plan for e in again.exposures] == plans
        assert (again.rows, again.columns) == (ROWS, COLUMNS)
        read = [codes for e in again.exposures for codes in again.frames(e)]
        np.testing.assert_array_equal(read, frames)

    def test_bytes_are_the_same_every_time(self, tmp_path: Path) -> None:
        plans = [ExposurePlan("a", "flat", 0.01, 3, 5.0), ExposurePlan("b", "dark", 0.01, 12)]
        for name in ("one", "two"):
            write_recording(tmp_path / name, SENSOR, plans, iter(frames_of(15)))
        assert tree(tmp_path / "one") == tree(tmp_path / "two")

    def test_another_program_reads_the_frames(self, tmp_path: Path) -> None:
        frames = frames_of(2)
        write_recording(tmp_path / "r", SENSOR, [ExposurePlan("a", "flat", 1.0, 2)], frames)
        files = sorted((tmp_path / "r" / "a").iterdir())
        np.testing.assert_array_equal([np.asarray(Image.open(f)) for f in files], frames)

    @pytest.mark.parametrize("count", [1, 3])
    def test_frames_must_be_as_many_as_announced(self, tmp_path: Path, count: int) -> None:
        with pytest.raises(ValueError, match="announce"):
            write_recording(
                tmp_path / "r", SENSOR, [ExposurePlan("a", "flat", 1.0, 2)], frames_of(count)
            )
        assert not (tmp_path / "r").exists()

    def test_what_cannot_be_read_is_not_put_in_place(self, tmp_path: Path) -> None:
        out, good = tmp_path / "r", ExposurePlan("a", "flat", 1.0, 1)
        write_recording(out, SENSOR, [good], frames_of(1))
        before = tree(out)
        lit_dark = ExposurePlan("a", "dark", 1.0, 1, light=3.0)
        with pytest.raises(InputError, match="the exposure is dark"):
            write_recording(out, SENSOR, [lit_dark], frames_of(1))
        with pytest.raises(ValueError, match="above 4095"):
            write_recording(out, SENSOR, [good], [np.full((2, 2), 4096, np.uint16)])
        assert tree(out) == before

    def test_only_a_recording_that_dsis_wrote_is_replaced(self, tmp_path: Path) -> None:
        plans = [ExposurePlan("a", "flat", 1.0, 1)]
        own = tmp_path / "own"
        write_recording(own, SENSOR, plans, frames_of(1, 1))
        write_recording(own, SENSOR, plans, frames_of(1, 2))
        assert not list(tmp_path.glob("own.*"))
        found = read_recording(own)
        np.testing.assert_array_equal(found.frame(found.exposures[0], 0), frames_of(1, 2)[0])
        save(tmp_path / "real" / "0.tif", frames_of(1)[0])
        real = described(tmp_path / "real", exposure("a", '"0.tif"'))
        before = tree(real)
        with pytest.raises(InputError, match="give another folder"):
            write_recording(real, SENSOR, plans, frames_of(1))
        assert tree(real) == before


class TestFormats:
    @pytest.mark.parametrize("suffix", ["tif", "png", "dpx", "jp2", "pgm", "sgi"])
    def test_16_bit_codes_are_exact(self, tmp_path: Path, suffix: str) -> None:
        codes = np.random.default_rng(1).integers(0, 65536, (96, 128), dtype=np.uint16)
        np.testing.assert_array_equal(read_codes(save(tmp_path / f"a.{suffix}", codes)), codes)

    @pytest.mark.parametrize("suffix", ["tif", "png", "bmp", "tga"])
    def test_8_bit_codes_are_exact_and_unsigned_16_bit_in_the_stream(
        self, tmp_path: Path, suffix: str
    ) -> None:
        codes = np.arange(256, dtype=np.uint8).reshape(8, 32)
        Image.fromarray(codes).save(tmp_path / f"a.{suffix}")
        sensor = TOML.replace("4095", "255").replace("= 12", "= 8")
        folder = described(tmp_path, exposure("a", f'"a.{suffix}"'), sensor=sensor)
        found = read_recording(folder)
        (frame,) = found.frames(found.exposures[0])
        assert frame.dtype == np.uint16
        np.testing.assert_array_equal(frame, codes)

    @pytest.mark.parametrize(
        ("suffix", "bits"),
        [("tif", 10), ("tif", 12), ("tif", 14), ("dpx", 10), ("dpx", 12), ("jp2", 12)],
    )
    def test_packed_codes_come_back_right_aligned(
        self, tmp_path: Path, suffix: str, bits: int
    ) -> None:
        """OpenImageIO stretches them to 16 bits; every code of the range is checked."""
        codes = np.arange(2**bits, dtype=np.uint16).reshape(32, -1)
        path = save(tmp_path / f"a.{suffix}", codes, bits)
        assert codes_info(path).bits == bits
        np.testing.assert_array_equal(read_codes(path), codes)

    @settings(
        max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
    )
    @given(most=st.integers(1, 65535), seed=st.integers(0, 99))
    def test_netpbm_codes_are_exact_whatever_their_maximum(
        self, tmp_path: Path, most: int, seed: int
    ) -> None:
        codes = np.random.default_rng(seed).integers(0, most + 1, (7, 9))
        path = tmp_path / "a.pgm"
        raw = codes.astype(">u2" if most > 255 else "u1").tobytes()
        path.write_bytes(b"P5\n# made by hand 12\n9 7\n%d\n" % most + raw)
        np.testing.assert_array_equal(read_codes(path), codes)

    @pytest.mark.parametrize("dtype", ["u1", "<u2", ">u2", "u4", "u8"])
    def test_npy_of_any_unsigned_type(self, tmp_path: Path, dtype: str) -> None:
        codes = np.asfortranarray(frames_of(1, top=250)[0].astype(dtype))
        np.save(tmp_path / "a.npy", codes)
        sensor = TOML.replace("4095", "255").replace("= 12", "= 8")
        found = read_recording(described(tmp_path, exposure("a", '"a.npy"'), sensor=sensor))
        (frame,) = found.frames(found.exposures[0])
        assert frame.dtype == np.uint16
        assert frame.flags["C_CONTIGUOUS"]
        np.testing.assert_array_equal(frame, codes)


class TestStreaming:
    def recording(self, parent: Path, count: int = 11) -> Recording:
        folder = parent / "[raw] take*1"  # no pattern, though it looks like one
        for number, codes in enumerate(frames_of(count)):
            save(folder / "f" / f"{number}.tif", codes, compressed=number % 2 == 0)
        return read_recording(described(folder, exposure("a", '"f/*.tif"')))

    def test_a_glob_is_read_in_natural_order(self, tmp_path: Path) -> None:
        found = self.recording(tmp_path)
        assert [p.stem for p in found.exposures[0].frames] == [str(n) for n in range(11)]

    @pytest.mark.parametrize("ahead", [0, 1, 3])
    def test_every_frame_is_read_once_and_in_order(
        self, tmp_path: Path, ahead: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        found, read = self.recording(tmp_path), []
        real = recording_model.read_frame

        def counted(path: Path) -> np.ndarray:
            read.append(path)
            return real(path)

        monkeypatch.setattr(recording_model, "read_frame", counted)
        frames = list(found.frames(found.exposures[0], ahead=ahead))
        np.testing.assert_array_equal(frames, frames_of(11))
        assert sorted(read) == sorted(found.exposures[0].frames)
        some = list(found.frames(found.exposures[0], [7, 2], ahead=ahead))
        np.testing.assert_array_equal(some, [frames_of(11)[7], frames_of(11)[2]])

    def test_reading_ahead_is_bounded_and_stops_with_its_consumer(self) -> None:
        begun = []

        def items() -> Iterator[int]:
            for number in range(1000):
                begun.append(number)
                yield number

        stream = in_order(lambda n: n * n, items(), 2)
        assert [next(stream) for _ in range(3)] == [0, 1, 4]
        assert len(begun) <= 3 + 2 * 2
        stream.close()
        assert threading.active_count() <= 2  # the main thread, and hypothesis may hold one

    def test_a_fault_is_raised_where_its_frame_is_due(self, tmp_path: Path) -> None:
        found = self.recording(tmp_path)
        path = found.exposures[0].frames[3]
        path.write_bytes(path.read_bytes()[:900])
        stream = found.frames(found.exposures[0], ahead=1)
        for _ in range(3):
            next(stream)
        with pytest.raises(InputError, match=r"3\.tif"):
            next(stream)


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


class TestHygiene:
    def remarks(self, folder: Path, **exposures: list[np.ndarray]) -> tuple[str, ...]:
        plans = [
            ExposurePlan(name, "dark" if name.startswith("d") else "flat", 0.01, len(frames))
            for name, frames in exposures.items()
        ]
        frames = [codes for stack in exposures.values() for codes in stack]
        return write_recording(folder / "r", SENSOR, plans, frames).remarks()

    def test_a_good_recording_has_none(self, tmp_path: Path) -> None:
        assert self.remarks(tmp_path, f=frames_of(3), d=frames_of(2, 1, 30)) == ()

    def test_identical_frames(self, tmp_path: Path) -> None:
        a, b = frames_of(2)
        (says,) = self.remarks(tmp_path, f=[a, b, a], g=[b, frames_of(1, 5)[0]])[:1]
        assert "byte-identical" in says
        assert self.remarks(tmp_path, f=[a, b, a], g=[b, frames_of(1, 5)[0]])[1].endswith(
            "f frame 1, g frame 0"
        )
        assert says.endswith("f frame 0, f frame 2")

    def test_one_frame_clipped_saturated_empty_constant(self, tmp_path: Path) -> None:
        a, b = frames_of(2)
        white, zero = np.full_like(a, 4095), np.zeros_like(a)
        clipped, low = a.copy(), a.copy()
        clipped[:2], low[:3] = 4095, 0
        found = self.remarks(
            tmp_path, f1=[a], f2=[white, white], f3=[clipped, b], f4=[zero, zero],
            f5=[low, b - 1], f6=[white - 7, b - 2],
        )  # fmt: skip
        wanted = [
            "f1: one frame only", "f2: saturated", "f3: 4.17% of the pixels are clipped",
            "f4: empty", "f5: 6.25% of the pixels are at code 0", "f6: 1 of 2 frames hold one code",
        ]  # fmt: skip
        assert len(found) == len(wanted)
        for remark, start in zip(found, wanted, strict=True):
            assert remark.startswith(start)

    def test_no_light(self, tmp_path: Path) -> None:
        assert "no exposure has light" in self.remarks(tmp_path, d=frames_of(2))[0]
        dim = self.remarks(tmp_path, d=frames_of(2, 0, 300), f=frames_of(2, 1, 200))
        assert dim == ("f: no brighter than the darks",)
        white = np.full((ROWS, COLUMNS), 4095, np.uint16)
        found = self.remarks(tmp_path, f=[white, white])
        assert found[-1] == "every exposure with light is clipped: gain cannot be measured"

    def test_left_aligned_codes(self, tmp_path: Path) -> None:
        (says,) = self.remarks(tmp_path, f=[codes & ~np.uint16(15) for codes in frames_of(2)])
        assert "multiples of 16" in says


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
