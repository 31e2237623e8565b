"""Folders with recordings written by hand, whole or spoilt, for the tests of reading."""

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - a foreign writer here
import pytest

from dsis.cfa import Cfa
from dsis.errors import InputError
from dsis.recording import Sensor, read_recording

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
