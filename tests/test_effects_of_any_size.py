"""Promise: an effect of any size that is read makes codes; what cannot is refused, with the bound.

No NaN, no warning of a library, no traceback, however large or small a number is.
"""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from dsis.camera import Camera, camera_values, read_camera
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects.effect import MOST_DN
from dsis.errors import InputError
from dsis.grid import PixelGrid
from dsis.model import structure
from dsis.recording import read_recording
from dsis.simulate import simulate_like
from effect_examples import BACKGROUND, KINDS, every_kind, example_of
from recording_folders import described, exposure, frames_of, save

SIZES = (1e300, 1e38, 1e30, 1e12, MOST_DN, 1e-9, 1e-30, 1e-100, 1e-300)


def _numbers(name: str) -> dict[str, object]:
    values = example_of(KINDS[name]).model_dump(mode="json")
    return {key: v for key, v in values.items() if isinstance(v, float)}


def _camera(name: str, key: str, size: float) -> Camera:
    example = example_of(KINDS[name]).model_dump(mode="json", exclude_none=True)
    values = camera_values(BACKGROUND.model_copy(update={"cfa": Cfa.RGGB}))
    return structure(Camera, {**values, "effect": [{**example, key: size}]}, "camera.toml")


@every_kind
def test_codes_or_a_bound(name: str) -> None:
    grid = PixelGrid(16, 16, Cfa.RGGB)
    clean = np.full((16, 16), 800, np.float32)
    for key in _numbers(name):
        for size in SIZES:
            try:
                camera = _camera(name, key, size)
            except InputError as refused:
                (fault,) = refused.faults
                assert fault.key.endswith(key), (key, size)
                assert json.dumps(size) in fault.fact
                continue
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                image = camera.expose(clean, Draw(1), Draw(2), 1, grid, exposure_time_s=1.0)
            codes = image + camera.black_level
            assert (codes >= 0).all(), (key, size)
            assert (codes <= camera.white_level).all(), (key, size)


def test_a_size_beyond_every_code_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "camera.toml"
    text = """schema = "dsis-camera/1"
name = "x"
cfa = "MONO"
black_level = 10
white_level = 4095
bit_depth = 12
[[noise.segment]]
slope = 1.0
intercept = 2.0
[[effect]]
kind = "hot_pixels"
pixel_fraction = 0.01
mean_dn_per_s = 1e300
"""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_camera(path)
    (says,) = str(refused.value).splitlines()
    assert "effect[0].mean_dn_per_s: is 1e+300, must be less than or equal to 1000000000000" in says


def test_no_frame_without_numbers_is_written(tmp_path: Path) -> None:
    """An exposure of more seconds than anything lasts."""
    save(tmp_path / "a.tif", frames_of(1)[0])
    described(tmp_path, exposure("a", '"a.tif"', exposure_time_s=1e300))
    warm = structure(KINDS["dark_current"], {"dn_per_s": MOST_DN}, "camera.toml")
    camera = BACKGROUND.model_copy(update={"effect": (warm,)})
    with pytest.raises(InputError, match=r"exposure a: signals of 1e\+300 s are too large"):
        simulate_like(camera, read_recording(tmp_path), tmp_path / "out")
    assert not (tmp_path / "out").exists()
