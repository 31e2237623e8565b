"""Plain grey PNG frames: inflated in one piece, in half the time that reading row by row takes.

What is not plain (colours, transparency, interlacing, fewer than 8 bits) or not sound in its length
is left to the library of all formats, whose word on it counts. A wrong checksum is refused here:
that library's own would also print it. Format: W3C Recommendation "Portable Network Graphics",
second edition, sections 5, 7 and 9.
"""

import struct
import zlib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import inlined, kernel
from dsis.errors import InputError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_UNDERSTOOD = {b"IHDR", b"IDAT", b"IEND"}
_PLAIN = [0, 0, 0, 0]  # grey, the one compression, the one filtering, not interlaced
_MAX_BYTES = 2**31


def _inflate() -> tuple[Callable[[], Any], type[Exception]]:
    """Return what unpacks, and its error; isal does in half of zlib's time where it is there."""
    try:
        fast = import_module("isal.isal_zlib")
    except ImportError:
        return zlib.decompressobj, zlib.error
    return fast.decompressobj, fast.error


_DECOMPRESSOR, _DAMAGED = _inflate()


def plain_codes(path: Path) -> NDArray[np.unsignedinteger] | None:
    """Return the codes of a sound grey PNG of 8 or 16 bits, (row, column); None for any other.

    Raises `InputError` where a checksum or the packed lines are damaged.
    """
    try:
        content = chunks(path.read_bytes())
    except zlib.error as error:
        raise InputError.of(path, "", f"is damaged: {error}") from None
    if content is None:
        return None
    (columns, rows, bits, *kind), packed = content
    size = bits // 8
    expected = rows * (1 + columns * size)
    if bits not in (8, 16) or kind != _PLAIN or not 0 < expected < _MAX_BYTES:
        return None
    unpacking = _DECOMPRESSOR()
    try:
        # One byte of room beyond the end shows lines too many, however far they would swell.
        lines = np.frombuffer(unpacking.decompress(packed, expected + 1), np.uint8)
    except _DAMAGED:
        raise InputError.of(path, "", "is damaged: its packed lines cannot be unpacked") from None
    if lines.size != expected or not unpacking.eof:  # the end has the checksum of all lines
        return None
    codes: NDArray[np.unsignedinteger] = np.empty((rows, columns), np.uint8 if size == 1 else ">u2")
    out = codes.view(np.uint8).reshape(rows, columns * size)
    sound = _unfilter(lines.reshape(rows, 1 + columns * size), size, out)
    return codes.astype(np.uint8 if size == 1 else np.uint16, copy=False) if sound else None


def chunks(content: bytes) -> tuple[tuple[int, ...], bytes] | None:
    """Return the fields of the header and the packed lines; None where it is no whole plain PNG.

    Raises `zlib.error` where the checksum of a chunk that is needed is wrong.
    """
    if not content.startswith(_SIGNATURE):
        return None
    view, at = memoryview(content), len(_SIGNATURE)
    header: tuple[int, ...] | None = None
    packed = []
    while at + 12 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        end = at + 8 + length
        if end + 4 > len(content):
            return None
        if zlib.crc32(view[at + 4 : end]) != struct.unpack_from(">I", content, end)[0]:
            if kind in _UNDERSTOOD:
                message = f"the checksum of a chunk {kind.decode()} is wrong"
                raise zlib.error(message)
            return None
        critical = kind[:1].isupper()
        if (critical and kind not in _UNDERSTOOD) or kind == b"tRNS":
            return None
        if kind == b"IHDR" and length == struct.calcsize(">IIBBBBB"):
            header = struct.unpack_from(">IIBBBBB", content, at + 8)
        elif kind == b"IDAT":
            packed.append(view[at + 8 : end])
        elif kind == b"IEND":
            return None if header is None else (header, b"".join(packed))
        at = end + 4
    return None


def refuse_cut(path: Path) -> None:
    """Raise `InputError` where a PNG ends within its lines: the library would also print it."""
    content = path.read_bytes()
    at = len(_SIGNATURE)
    while content.startswith(_SIGNATURE) and at + 8 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        at += 12 + length
        if at > len(content) and kind in (b"IHDR", b"IDAT"):
            fact = f"is damaged: it ends within its chunk {kind.decode()}, cut short?"
            raise InputError.of(path, "", fact)


@inlined
def _nearest(left: np.int32, up: np.int32, corner: np.int32) -> np.int32:
    """Return which is nearest to left + up - corner; ties in this order."""
    a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    if a <= b and a <= c:
        return left
    return up if b <= c else corner


@kernel
def _unfilter(stored: NDArray[np.uint8], size: int, out: NDArray[np.uint8]) -> bool:
    """Undo the filter of each line: its number, then bytes less what the bytes around predict.

    Returns False where a number is none of 0 to 4.
    """
    rows, width = out.shape
    above = np.zeros(width, np.uint8)
    zero = np.int32(0)
    for r in range(rows):
        kind, source, line = stored[r, 0], stored[r, 1:], out[r]
        if kind > 4:
            return False
        for i in range(np.uintp(width)):
            line[i] = source[i]
        if kind == 2:
            for i in range(np.uintp(width)):
                line[i] += above[i]
        elif kind:
            for i in range(width):
                left = np.int32(line[i - size]) if i >= size else zero
                if kind == 1:
                    predicted = left
                elif kind == 3:
                    predicted = (left + np.int32(above[i])) >> 1
                else:
                    corner = np.int32(above[i - size]) if i >= size else zero
                    predicted = _nearest(left, np.int32(above[i]), corner)
                line[i] += np.uint8(predicted)
        above = line
    return True
