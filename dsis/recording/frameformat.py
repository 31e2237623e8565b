"""Raw frames in files: headers and codes of every format, whatever library reads it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.errors import InputError
from dsis.imagefile import CodesInfo, codes_info, known_format, read_codes
from dsis.recording.cameraraw import RAW_SUFFIXES, raw_frame, raw_header
from dsis.recording.png import plain_codes, refuse_cut

_UNSIGNED = {"uint8": 8, "uint16": 16, "uint": 32, "uint32": 32, "uint64": 64}
_ALLOWED = "must hold unsigned whole codes (uint8, uint16, uint32 or uint64)"
_FORMATS = "TIFF, PNG, PGM, DPX, .npy, DNG or camera raw"


@dataclass(frozen=True)
class FrameHeader:
    """What can be said of a frame before its codes are read.

    Attributes
    ----------
    rows, columns
        Size in pixels.
    pixel_type
        Unsigned type that the codes are stored in.
    bits
        Bits of that type.
    colours
        Colour filters of rows 0, 1 and columns 0, 1 where the file states them: `RGGB` ...
    """

    rows: int
    columns: int
    pixel_type: str
    bits: int
    colours: str | None = None


def read_header(path: Path) -> FrameHeader:
    """Return the header of a frame; raise `InputError` where the file can hold no raw frame."""
    suffix = path.suffix.lower()
    if suffix == ".npy":
        stored = _mapped(path)
        if stored.dtype.kind == "f" and not np.isfinite(stored).all():
            raise InputError.of(
                path, "", f"holds {stored.dtype.name} values, some NaN or infinite; {_ALLOWED}"
            )
        return _header(path, stored.shape, stored.dtype.name)
    if suffix in RAW_SUFFIXES:
        raw = raw_header(path)
        return FrameHeader(raw.rows, raw.columns, "uint16", 16, raw.colours)
    held = _info(path)
    if held.images > 1:
        raise InputError.of(path, "", "holds more than one image, must hold one frame")
    shape = (held.rows, held.columns, held.channels)[: 2 if held.channels == 1 else 3]
    return _header(path, shape, held.pixel_type)


def read_frame(path: Path) -> NDArray[np.unsignedinteger]:
    """Return the codes of a frame as stored, (row, column); raise `InputError` where damaged."""
    suffix = path.suffix.lower()
    if suffix == ".npy":
        stored = _mapped(path)
        _header(path, stored.shape, stored.dtype.name)
        return np.array(stored)
    if suffix in RAW_SUFFIXES:
        return raw_frame(path)
    if suffix != ".png":
        return read_codes(path)
    plain = plain_codes(path)
    if plain is None:
        refuse_cut(path)
        return read_codes(path)
    return plain


def _info(path: Path) -> CodesInfo:
    """Return what the header says; raise `InputError`, with the formats there are, if none."""
    try:
        return codes_info(path)
    except InputError:
        if known_format(path):
            raise
        kind = f"is a {path.suffix} file" if path.suffix else "has no suffix"
        raise InputError.of(path, "", f"{kind}, must be a frame in {_FORMATS}") from None


def _header(path: Path, shape: tuple[int, ...], pixel_type: str) -> FrameHeader:
    if pixel_type not in _UNSIGNED:
        raise InputError.of(path, "", f"holds {pixel_type} values, {_ALLOWED}")
    if len(shape) != 2:
        found = " x ".join(map(str, shape))
        fact = f"holds an array of {found}, must hold one channel (rows x columns)"
        raise InputError.of(path, "", fact)
    if 0 in shape:
        raise InputError.of(path, "", "holds no pixels")
    return FrameHeader(shape[0], shape[1], pixel_type, _UNSIGNED[pixel_type])


def _mapped(path: Path) -> NDArray[np.generic]:
    """Return the array of an .npy file, mapped into memory: only what is touched is read."""
    try:
        stored: NDArray[np.generic] = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        reason = str(error).splitlines()[0]
        raise InputError.of(path, "", f"is damaged or no .npy file: {reason}") from None
    return stored
