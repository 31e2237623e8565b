"""Clips built from light that is known; most are read back from the delivered 8-bit codes.

The view `Raw` shows scene light as it is, so that a clip's codes are 255 x light, rounded, and
closed forms can be held against them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dsis.camera import BaseNoise, Camera, Segment, write_camera
from dsis.cfa import Cfa
from dsis.imagefile import write
from dsis.manifest import read_manifest
from dsis.optics import Optics
from dsis.spec import Test, read_spec
from dsis.stimuli import build_stimuli
from written_spec import write_spec

Z_MAX = 5.0
ROWS, COLUMNS = 48, 64
FPS = 25
WHITE_DN, SLOPE, INTERCEPT = 1000.0, 2.0, 100.0

CAMERA = Camera(
    name="plain",
    cfa=Cfa.RGGB,
    black_level=64.0,
    white_level=4095.0,
    bit_depth=12,
    diffuse_white_dn=WHITE_DN,
    noise=BaseNoise(segment=(Segment(slope=SLOPE, intercept=INTERCEPT),)),
)

# Gain 1 within 1e-6 at all frequencies: nothing but the sampling.
NO_OPTICS = Optics(
    f_number=0.01,
    wavelength_nm=1.0,
    pitch_um=8.25,
    low_pass_spot_separation_px=0.0,
    fill_factor=1e-6,
)


def spec_in(
    folder: Path,
    contents: Mapping[str, Mapping[str, Any]],
    *,
    frames: int,
    size: tuple[int, int] = (ROWS, COLUMNS),
    camera: Camera = CAMERA,
    optics: Optics = NO_OPTICS,
    view: str = "Raw",
    awgn: Mapping[str, Any] | None = None,
    training: int = 0,
    formats: tuple[str, ...] = ("player",),
    **conditions: object,
) -> Test:
    """Write a spec, read it; a content's `light` becomes the file that it shows."""
    write_camera(camera, folder / "camera.toml")
    listed = []
    for name, given in contents.items():
        entry = {"name": name, **given}
        if "light" in entry:
            write(folder / f"{name}.exr", entry.pop("light").astype(np.float32), "exr")
            entry["files"] = f"{name}.exr"
        listed.append(entry)
    shown_s = 1 / FPS
    path = write_spec(
        folder / "spec.toml",
        seed=11,
        formats=formats,
        sequence={"height": size[0], "width": size[1], "fps": FPS, "seconds": frames / FPS},
        content=listed,
        camera={"model": "camera.toml"},
        optics=optics.model_dump(),
        color={"view": view, "scene_space": "Linear Rec.709 (sRGB)"},
        awgn=awgn or {"sigma": 6.0},
        conditions={"noise": ["sd"], "demosaic": ["none"], **conditions},
        session={"reference_s": shown_s, "test_s": shown_s, "training": training},
    )
    return read_spec(path)


def built(folder: Path, contents: Mapping[str, Mapping[str, Any]], **settings: Any) -> Path:
    folder.mkdir(exist_ok=True)
    build_stimuli(spec_in(folder, contents, **settings), folder / "out", jobs=2)
    return folder / "out"


def codes_of(out: Path, stimulus: str) -> np.ndarray:
    """Return a delivered clip, (frame, row, column, 3), exact in float64."""
    manifest = read_manifest(out)
    size = manifest.sequence
    data = np.fromfile(out / manifest.clip(stimulus).files["player"].path, np.uint8)
    return data.reshape(-1, size.height, size.width, 3).astype(np.float64)


def flat(light: float) -> np.ndarray:
    return np.full((ROWS, COLUMNS, 3), light)
