"""Promise: what spoils a measurement without being an error is remarked."""

from pathlib import Path

import numpy as np

from dsis.recording import ExposurePlan, write_recording
from recording_folders import COLUMNS, ROWS, SENSOR, frames_of


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

    def test_codes_that_are_no_multiples_of_their_step(self, tmp_path: Path) -> None:
        coarse = [(6 * (codes // 6) + 5).astype(np.uint16) for codes in frames_of(2)]
        (says,) = self.remarks(tmp_path / "6", f=coarse)
        assert "all codes are 5 and multiples of 6" in says
        few = [np.where(codes % 2, 64, 2064).astype(np.uint16) for codes in frames_of(2)]
        assert not any("multiples" in r for r in self.remarks(tmp_path / "two", f=few))
