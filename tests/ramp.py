"""A small test of one smooth picture, built; its frames and its bytes."""

from pathlib import Path
from typing import Any

import numpy as np

from dsis.imagefile import write
from written_spec import write_spec

ROWS, COLUMNS, FRAMES = 48, 64, 6


def scene(rows: int, columns: int) -> np.ndarray:
    """Return smooth linear light from black to a little over diffuse white, coloured."""
    y, x = np.mgrid[0:rows, 0:columns].astype(np.float32)
    light = 0.5 + 0.5 * np.sin(x / 9) * np.cos(y / 7)
    return np.stack([light, 0.8 * light**2, 0.3 + 0.5 * light], axis=2).astype(np.float32)


def write_test(
    folder: Path,
    *,
    camera: str = "dual_gain_cinema",
    rows: int = ROWS,
    columns: int = COLUMNS,
    frames: int = FRAMES,
    levels: tuple[int, ...] = (0,),
    **changes: Any,
) -> Path:
    """Write the spec of a test of one smooth picture, and the picture."""
    write(folder / "ramp.exr", scene(rows + 8, columns + 40), "exr")
    size = {"width": columns, "height": rows, "seconds": frames / 25}
    return write_spec(
        folder / "spec.toml",
        seed=3,
        sequence=size,
        content=[{"name": "ramp", "files": "ramp.exr", "pan_px_per_frame": 0.5}],
        camera={"model": f"cameras/{camera}.toml"},
        conditions={"demosaic": ["none", "bilinear", "lu_tan"], "levels": levels},
        **changes,
    )


def frames_of(folder: Path, stimulus: str) -> np.ndarray:
    data = np.fromfile(folder / "player" / f"{stimulus}.rgb", np.uint8)
    return data.reshape(FRAMES, ROWS, COLUMNS, 3)
