"""Promise: recordings are read exactly, streamed in order, and written back."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.imagefile import codes_info, read_codes
from dsis.recording import ExposurePlan, Recording, Sensor, read_recording, write_recording
from dsis.recording import model as recording_model
from dsis.recording.ahead import in_order
from folder_bytes import every_byte
from recording_folders import COLUMNS, ROWS, SENSOR, TOML, described, exposure, frames_of, save


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
        assert every_byte(tmp_path / "one") == every_byte(tmp_path / "two")

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
        before = every_byte(out)
        lit_dark = ExposurePlan("a", "dark", 1.0, 1, light=3.0)
        with pytest.raises(InputError, match="the exposure is dark"):
            write_recording(out, SENSOR, [lit_dark], frames_of(1))
        with pytest.raises(ValueError, match="above 4095"):
            write_recording(out, SENSOR, [good], [np.full((2, 2), 4096, np.uint16)])
        assert every_byte(out) == before

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
        before = every_byte(real)
        with pytest.raises(InputError, match="give another folder"):
            write_recording(real, SENSOR, plans, frames_of(1))
        assert every_byte(real) == before

    @pytest.mark.parametrize(
        "name", ["notes.txt", "a/notes.txt", "a/0.tif", "real/recording.toml", "b/0000.tif"]
    )
    def test_what_dsis_did_not_write_into_one_is_not_lost(self, tmp_path: Path, name: str) -> None:
        plans = [ExposurePlan("a", "flat", 1.0, 2)]
        own = tmp_path / "own"
        write_recording(own, SENSOR, plans, frames_of(2, 1))
        (own / name).parent.mkdir(exist_ok=True)
        (own / name).write_text("mine", encoding="utf-8")
        before = every_byte(own)
        lost = name if name.startswith("a/") else name.split("/", maxsplit=1)[0]
        with pytest.raises(InputError, match=f"own: holds {lost}, which would be lost: give ano"):
            write_recording(own, SENSOR, plans, frames_of(2, 2))
        assert every_byte(own) == before

    def test_unfinished_work_is_replaced_and_what_lies_in_it_is_not_lost(
        self, tmp_path: Path
    ) -> None:
        plans, own = [ExposurePlan("a", "flat", 1.0, 2)], tmp_path / "own"

        def broken() -> Iterator[NDArray[np.uint16]]:
            yield from frames_of(1)
            raise KeyboardInterrupt

        for _ in range(2):  # the second time there are frames of the first
            with pytest.raises(KeyboardInterrupt):
                write_recording(own, SENSOR, plans, broken())
        notes = tmp_path / "own.partial" / "a" / "notes.txt"
        notes.write_text("mine", encoding="utf-8")
        with pytest.raises(InputError, match=r"holds a/notes\.txt, which would be lost"):
            write_recording(own, SENSOR, plans, frames_of(2))
        notes.unlink()
        write_recording(own, SENSOR, plans, frames_of(2))


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
        begun, before = [], threading.active_count()

        def items() -> Iterator[int]:
            for number in range(1000):
                begun.append(number)
                yield number

        stream = in_order(lambda n: n * n, items(), 2)
        assert [next(stream) for _ in range(3)] == [0, 1, 4]
        assert len(begun) <= 3 + 2 * 2
        stream.close()
        assert threading.active_count() <= before

    def test_a_fault_is_raised_where_its_frame_is_due(self, tmp_path: Path) -> None:
        found = self.recording(tmp_path)
        path = found.exposures[0].frames[3]
        path.write_bytes(path.read_bytes()[:900])
        stream = found.frames(found.exposures[0], ahead=1)
        for _ in range(3):
            next(stream)
        with pytest.raises(InputError, match=r"3\.tif"):
            next(stream)
