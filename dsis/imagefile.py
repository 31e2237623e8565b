"""Image files: the only place that touches OpenImageIO."""

import glob
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - the name that its own examples use
from numpy.typing import NDArray

from dsis.errors import InputError

EXTENSIONS = {"png8": "png", "tiff16": "tif", "dpx16": "dpx", "exr": "exr"}
READABLE = (".png", ".tif", ".tiff", ".dpx", ".exr", ".jpg", ".jpeg", ".cin", ".hdr")

# Writers stamp the time of writing into some formats; the same frame must give the same bytes.
_NO_DATE = "2000:01:01 00:00:00"


@dataclass(frozen=True)
class ImageInfo:
    """What the header of an image file says: size in pixels, channels, floating point or not."""

    rows: int
    columns: int
    channels: int
    floating: bool


def find_files(folder: Path, patterns: Iterable[str]) -> tuple[Path, ...]:
    """Return the files that globs, folders (their images) and paths name, in natural order.

    Relative patterns count from `folder`. Each pattern's files are sorted so that 2 comes before
    10; the order of the patterns is kept.
    """
    found: list[Path] = []
    for pattern in patterns:
        path = folder / Path(pattern).expanduser()
        if path.is_dir():
            hits = [p for p in path.iterdir() if p.suffix.lower() in READABLE]
        elif path.is_file():
            hits = [path]
        else:
            # `Path.glob` takes no absolute patterns.
            hits = [Path(p) for p in glob.glob(str(path)) if Path(p).is_file()]  # noqa: PTH207
        found += sorted(hits, key=natural_order)
    return tuple(found)


def natural_order(path: Path) -> list[tuple[int, int, str]]:
    """Return a sorting key under which `frame2` comes before `frame10`."""
    parts = re.split(r"(\d+)", str(path))
    return [(1, int(p), "") if p.isdigit() else (0, 0, p) for p in parts]


def info(path: Path) -> ImageInfo:
    """Return what the header of an image says; raise `InputError` where it is no image."""
    opened = oiio.ImageInput.open(str(path))
    if opened is None:
        raise InputError.of(path, "", f"is no readable image: {oiio.geterror().strip()}")
    spec = opened.spec()
    opened.close()
    floating = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    return ImageInfo(spec.height, spec.width, spec.nchannels, floating)


def read(path: Path) -> NDArray[np.float32]:
    """Return an image as float32 (row, column, 3); integer files are scaled to 0..1.

    Grey images fill all three channels, alpha is dropped. Raises `InputError` where the file is
    damaged or holds values that are not finite.
    """
    opened = oiio.ImageInput.open(str(path))
    if opened is None:
        raise InputError.of(path, "", f"is no readable image: {oiio.geterror().strip()}")
    pixels = opened.read_image(format=oiio.FLOAT)
    error = opened.geterror().strip()
    opened.close()
    if pixels is None or error:
        raise InputError.of(path, "", f"is damaged: {error or 'no pixels'}")
    image = np.asarray(pixels, np.float32)
    image = image[:, :, :3] if image.shape[2] >= 3 else np.repeat(image[:, :, :1], 3, axis=2)
    if not np.isfinite(image).all():
        raise InputError.of(path, "", "holds values that are not finite (NaN or infinite)")
    return np.ascontiguousarray(image)


def write(path: Path, display: NDArray[np.float32], form: str) -> None:
    """Write a display frame, float32 0..1 (row, column, 3), whole or not at all.

    Parameters
    ----------
    path
        Where to.
    display
        The frame; clipped to 0..1 for integer formats.
    form
        `png8`, `tiff16`, `dpx16` (rounded to whole codes) or `exr` (half float, not clipped).
    """
    if form == "exr":
        pixels: NDArray[np.generic] = display.astype(np.float16)
    elif form == "png8":
        pixels = codes(display, 255).astype(np.uint8)
    else:
        pixels = codes(display, 65535).astype(np.uint16)
    write_codes(path, pixels)


def write_codes(path: Path, pixels: NDArray[np.generic]) -> None:
    """Write pixels as they are (uint8, uint16 or float16), whole or not at all."""
    rows, columns, channels = pixels.shape
    kinds = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "float16": oiio.HALF}
    spec = oiio.ImageSpec(columns, rows, channels, kinds[pixels.dtype.name])
    spec.attribute("DateTime", _NO_DATE)
    spec.attribute("compression", "zip" if path.suffix == ".exr" else "none")
    if path.suffix == ".png":
        spec.attribute("png:compressionLevel", 1)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    out = oiio.ImageOutput.create(str(unfinished))
    if out is None or not out.open(str(unfinished), spec) or not out.write_image(pixels):
        reason = (out.geterror() if out else oiio.geterror()).strip()
        raise InputError.of(path, "", f"cannot be written: {reason}")
    out.close()
    unfinished.replace(path)


def codes(display: NDArray[np.float32], top: int) -> NDArray[np.float32]:
    """Return display values 0..1 as whole codes 0..top, rounded half up, clipped."""
    scaled: NDArray[np.float32] = np.clip(display, 0, 1) * np.float32(top) + np.float32(0.5)
    return np.floor(scaled)
