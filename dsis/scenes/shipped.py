"""The panoramas that come with dsis, so that a newcomer's first test need not be rendered.

Half floats (11 bits of mantissa: within 2^-11 of what the renderer gives), stored as the steps from
column to column of their bits, which compress to about two thirds. Where one is wide enough it is
what everybody gets, whatever the cache holds: the same request gives the same bytes everywhere.
"""

from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.renderer import render
from dsis.scenes.strip import Strip

Light = NDArray[np.float32]

FOLDER: Final = Path(__file__).parent / "panoramas"
SHIPPED: Final = (
    Strip("city", 1, 540, 1460),  # preset quick
    Strip("landscape", 1, 540, 1460),
    Strip("city", 1_000_004, 540, 1058),  # what the demo's training shows
)


def is_shipped(strip: Strip) -> bool:
    """Tell whether a strip comes with dsis."""
    return _holder(strip) is not None


def as_shipped(strip: Strip) -> Light | None:
    """Return a strip from those that come with dsis, read-only; None where none is wide enough."""
    path = _holder(strip)
    if path is None:
        return None
    with np.load(path) as held:
        bits = np.cumsum(held["steps"], axis=1, dtype=np.uint16)
    light: Light = bits.view(np.float16)[:, : strip.columns].astype(np.float32)
    light.flags.writeable = False
    return light


def _holder(strip: Strip) -> Path | None:
    paths = (_path(other) for other in SHIPPED if other.covers(strip))
    return next((path for path in paths if path.exists()), None)


def ship(threads: int = 1) -> None:
    """Render what comes with dsis and write it into the package, after a renderer was changed."""
    FOLDER.mkdir(exist_ok=True)
    for strip in SHIPPED:
        bits = render(strip, threads).astype(np.float16).view(np.uint16)
        steps = np.diff(bits, axis=1, prepend=np.uint16(0))
        np.savez_compressed(_path(strip), steps=steps)


def _path(strip: Strip) -> Path:
    return FOLDER / f"{strip.scene}-{strip.seed}-{strip.rows}x{strip.columns}.npz"
