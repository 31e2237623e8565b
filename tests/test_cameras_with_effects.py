"""Promise: a camera's effects act in physical order, undisturbed by one another, or are refused."""

from pathlib import Path

import numpy as np
import pytest

from dsis.camera import Camera, read_camera, write_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect, Exposure
from dsis.errors import InputError
from dsis.grid import PixelGrid
from effect_examples import BACKGROUND, COLUMNS, KINDS, ROWS, Z_MAX, camera_with, example_of


def test_temporal_effects_change_from_frame_to_frame_and_fixed_ones_do_not() -> None:
    """What holds for all frames shows in fixed measures or the level, and in no other draw."""
    grid = PixelGrid(32, 32, Cfa.RGGB)
    image = np.full(grid.shape, 1000.0, np.float32)
    read_out = camera_with().model_copy(update={"cfa": Cfa.RGGB}).read_out
    temporal = {
        "bistable_pattern", "black_level_drift", "column_noise", "flicker", "impulse",
        "line_flicker", "periodic_noise", "pink_noise", "row_banding", "row_noise",
        "rts",
    }  # fmt: skip

    def made(effect: Effect, frame: int, sensor: int) -> np.ndarray:
        exposure = Exposure(
            grid, frame, Draw(1), Draw(sensor), image, read_out, lambda _: image, 0.2
        )
        return effect.apply(image, exposure)

    for name, kind in KINDS.items():
        effect = example_of(kind)
        frames = np.array([made(effect, frame, 5) for frame in range(8)])
        assert (np.ptp(frames, 0).max() > 0) == (name in temporal), name


def test_another_effect_leaves_the_noise_of_the_others_as_it_was() -> None:
    """The row offsets themselves are the whole difference, to a code of rounding."""
    grid = PixelGrid(ROWS, COLUMNS, Cfa.MONO)
    clean = np.full(grid.shape, 3000.0, np.float32)
    camera = camera_with(KINDS["row_noise"](sigma_dn=4.0))
    before = BACKGROUND.expose(clean, Draw(1), Draw(2), 3, grid)
    after = camera.expose(clean, Draw(1), Draw(2), 3, grid)
    offsets = 4.0 * Draw(1).rows("row_noise", grid, 3)[:, np.newaxis]
    assert np.abs(after - before - offsets).max() <= 1.0


def test_a_second_effect_of_a_kind_has_noise_of_its_own() -> None:
    grid = PixelGrid(512, 8, Cfa.MONO)
    clean = np.full(grid.shape, 3000.0, np.float32)
    rows = KINDS["row_noise"](sigma_dn=40.0)
    one, two = (
        camera_with(*effects).expose(clean, Draw(1), Draw(2), 3, grid).mean(1) - 3000
        for effects in ((rows,), (rows, rows))
    )
    second = two - one
    assert abs(np.corrcoef(one, second)[0, 1]) < Z_MAX / np.sqrt(512)
    assert abs(second.var() / 40**2 - 1) < Z_MAX * np.sqrt(2 / 512)


def test_links_are_sorted_as_light_and_charge_meet_them() -> None:
    effects = tuple(example_of(kind) for kind in reversed(KINDS.values()))
    kinds = [link.kind for link in camera_with(*effects).chain()]
    stages = [link.stage for link in camera_with(*effects).chain()]
    assert stages == sorted(stages)
    assert kinds.index("prnu") < kinds.index("dark_current") < kinds.index("shot_noise")
    assert kinds.index("shot_noise") < kinds.index("crosstalk") < kinds.index("read_noise")
    assert kinds.index("read_noise") < kinds.index("row_noise")
    assert kinds[-1] == "conversion"


def test_all_effects_together_are_simulated() -> None:
    effects = tuple(example_of(kind) for kind in KINDS.values())
    grid = PixelGrid(24, 32, Cfa.RGGB)
    clean = np.full(grid.shape, 2000.0, np.float32)
    camera = camera_with(*effects)
    frames = [
        camera.expose(clean, Draw(1), Draw(2), 1, grid, exposure_time_s=0.1, threads=threads)
        for threads in (1, 2)
    ]
    np.testing.assert_array_equal(*frames)
    np.testing.assert_array_equal(frames[0], np.rint(frames[0]))


class TestRefusals:
    def read(self, tmp_path: Path, effects: str, *, segments: int = 1, cfa: str = "MONO") -> Camera:
        upper = "[[noise.segment]]\nupper_dn = 100.0\nslope = 1.0\nintercept = 2.0\n"
        text = f"""schema = "dsis-camera/1"
name = "x"
cfa = "{cfa}"
black_level = 10
white_level = 1023
bit_depth = 10
[noise]
{upper if segments == 2 else ""}
[[noise.segment]]
slope = 1.0
intercept = 2.0
"""
        path = tmp_path / "camera.toml"
        path.write_text(text + effects)
        return read_camera(path)

    def test_what_a_camera_cannot_have(self, tmp_path: Path) -> None:
        text = """[[effect]]
kind = "channel_imbalance"
gain_percent = 1.0
[[effect]]
kind = "dual_gain_mismatch"
gain_error_percent = 1.0
"""
        with pytest.raises(InputError) as refused:
            self.read(tmp_path, text)
        assert "effect[0] (channel_imbalance): needs a Bayer mosaic" in str(refused.value)
        assert "effect[1] (dual_gain_mismatch): needs a second" in str(refused.value)
        self.read(tmp_path, text, segments=2, cfa="RGGB")

    def test_a_second_gain_belongs_to_the_base_model(self, tmp_path: Path) -> None:
        text = '[[effect]]\nkind = "dual_gain"\n[[effect]]\nkind = "row_nois"\n'
        with pytest.raises(InputError) as refused:
            self.read(tmp_path, text)
        first, second = str(refused.value).splitlines()
        assert first.endswith(
            "effect[0].kind: is 'dual_gain', which is no effect: write a second [[noise.segment]]"
        )
        assert "effect[1].kind: is 'row_nois' (did you mean row_noise?)" in second

    @pytest.mark.parametrize(("level", "bits", "says"), [
        ("1022.5", "10", r"white_level is 1022\.5, must be a whole number"),
        ("1023", "25", "bit_depth is 25, must be <= 24: frames are computed in single precision"),
        ("255", "16", r"black_level is 500\.0, must be below white_level \(255\.0\)"),
    ])  # fmt: skip
    def test_codes_that_cannot_be(self, tmp_path: Path, level: str, bits: str, says: str) -> None:
        path = tmp_path / "camera.toml"
        write_camera(BACKGROUND, path)
        text = path.read_text().replace("white_level = 65535.0", f"white_level = {level}")
        path.write_text(text.replace("bit_depth = 16", f"bit_depth = {bits}"))
        with pytest.raises(InputError, match=says):
            read_camera(path)

    def test_signals_that_single_precision_does_not_hold(self, tmp_path: Path) -> None:
        path = tmp_path / "camera.toml"
        write_camera(BACKGROUND.model_copy(update={"saturation_dn": 1.5}), path)
        path.write_text(path.read_text().replace("saturation_dn = 1.5", "saturation_dn = 1e300"))
        with pytest.raises(InputError, match=r"saturation_dn: is 1e\+300, must be less than"):
            read_camera(path)
        write_camera(BACKGROUND, path)
        path.write_text(path.read_text().replace("upper_dn = 1000.0", "upper_dn = 1e300"))
        with pytest.raises(
            InputError, match=r"segment\[0\].upper_dn: is 1e\+300, must be less than"
        ):
            read_camera(path)

    def test_text_may_begin_with_a_byte_order_mark(self, tmp_path: Path) -> None:
        path = tmp_path / "camera.toml"
        write_camera(BACKGROUND, path)
        path.write_text(path.read_text(encoding="utf-8"), encoding="utf-8-sig")
        assert read_camera(path) == BACKGROUND

    def test_a_law_given_twice(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="poisson_shot_noise is given 2 times"):
            self.read(tmp_path, '[[effect]]\nkind = "poisson_shot_noise"\n' * 2)

    def test_growth_without_an_exposure_time(self, tmp_path: Path) -> None:
        camera = self.read(tmp_path, '[[effect]]\nkind = "dark_current"\ndn_per_s = 3.0\n')
        grid = PixelGrid(4, 4, Cfa.MONO)
        clean = np.zeros((4, 4), np.float32)
        with pytest.raises(InputError, match=r"dark_current.*exposure time"):
            camera.expose(clean, Draw(1), Draw(2), 0, grid)
        camera.expose(clean, Draw(1), Draw(2), 0, grid, exposure_time_s=0.0)
