"""Camera raw and DNG files through LibRaw: the only file that touches rawpy, an optional extra."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.errors import InputError

RAW_SUFFIXES = frozenset((
    ".3fr", ".ari", ".arw", ".cr2", ".cr3", ".crw", ".dng", ".erf", ".fff", ".iiq", ".kdc",
    ".mef", ".mos", ".mrw", ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".rwl", ".sr2",
    ".srf", ".srw", ".x3f",
))  # fmt: skip


@dataclass(frozen=True)
class RawHeader:
    """What a camera raw file says of itself; levels in DN.

    Attributes
    ----------
    rows, columns
        Size of the visible area in pixels.
    colours
        Colour filters of rows 0, 1 and columns 0, 1: `RGGB` ... or `MONO`.
    black_level, white_level
        Pedestal (mean over the filters) and largest code.
    exposure_time_s
        Exposure time, s; 0 where the file does not state it.
    """

    rows: int
    columns: int
    colours: str
    black_level: float
    white_level: float
    exposure_time_s: float


def raw_header(path: Path) -> RawHeader:
    """Return what the file says of itself. LibRaw decodes the file before it tells the filters."""
    with _opened(path) as raw:
        return RawHeader(
            raw.sizes.height,
            raw.sizes.width,
            _colours(path, raw),
            float(np.mean(raw.black_level_per_channel)),
            float(raw.white_level),
            float(raw.other.shutter_speed),
        )


def raw_frame(path: Path) -> NDArray[np.uint16]:
    """Return the codes of the visible area: uint16 (row, column), neither scaled nor balanced."""
    with _opened(path) as raw:
        return np.array(raw.raw_image_visible, np.uint16)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    library = _library(path)
    try:
        with library.RawPy() as raw:
            raw.open_file(str(path))
            yield raw
    except library.LibRawError as error:
        raise InputError.of(path, "", f"is no readable camera raw: {_reason(error)}") from None


def _library(path: Path) -> Any:
    try:
        return import_module("rawpy")
    except ImportError:
        fact = "is a camera raw file, which needs the optional extra: pip install 'dsis[raw]'"
        raise InputError.of(path, "", fact) from None


def _colours(path: Path, raw: Any) -> str:
    """Return the letters of the 2 x 2 pattern, or MONO."""
    pattern = raw.raw_pattern
    if raw.num_colors == 1:
        return "MONO"
    if pattern is None or np.shape(pattern) != (2, 2):
        fact = "has no 2 x 2 colour filter array, must be Bayer or monochrome"
        raise InputError.of(path, "", fact)
    letters = raw.color_desc.decode("ascii")
    return "".join(letters[index] for index in np.ravel(pattern))


def _reason(error: Exception) -> str:
    """Return LibRaw's words, which rawpy hands on as bytes."""
    word = error.args[0] if error.args else ""
    return word.decode("utf-8", "replace") if isinstance(word, bytes) else str(word)
