"""Promise: PNG frames are read as every other library reads them, fast path or not.

Oracle: OpenImageIO, which has nothing in common with the fast path.
"""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from dsis.errors import InputError
from dsis.imagefile import read_codes
from dsis.recording import png
from dsis.recording.frameformat import read_frame


def chunk(kind: bytes, content: bytes) -> bytes:
    return (
        struct.pack(">I", len(content))
        + kind
        + content
        + struct.pack(">I", zlib.crc32(kind + content))
    )


def file_of(lines: bytes, rows: int, columns: int, bits: int, *more: bytes) -> bytes:
    """Return a grey PNG whose filtered lines are given; the packed lines lie in two chunks."""
    packed = zlib.compress(lines)
    half = len(packed) // 2
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, bits, 0, 0, 0, 0))
    body = (chunk(b"IDAT", packed[:half]), chunk(b"IDAT", packed[half:]), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + header + b"".join(more) + b"".join(body)


@st.composite
def filtered(draw: st.DrawFn) -> tuple[np.ndarray, int, int, int]:
    """Filtered lines of any bytes: each is some picture, whatever its filters."""
    rows, columns, size = (
        draw(st.integers(1, 7)),
        draw(st.integers(1, 9)),
        draw(st.sampled_from((1, 2))),
    )
    shape = (rows, columns * size)
    content = draw(arrays.arrays(np.uint8, shape, elements=st.integers(0, 255)))
    kinds = draw(arrays.arrays(np.uint8, (rows, 1), elements=st.integers(0, 4)))
    return np.concatenate([kinds, content], 1), rows, columns, 8 * size


@given(stored=filtered())
@settings(max_examples=150)
def test_every_filter_is_undone(tmp_path_factory: pytest.TempPathFactory, stored: tuple) -> None:
    lines, rows, columns, bits = stored
    path = tmp_path_factory.getbasetemp() / "filtered.png"
    path.write_bytes(file_of(lines.tobytes(), rows, columns, bits))
    found = png.plain_codes(path)
    assert found is not None
    assert found.dtype == np.dtype(f"uint{bits}")
    assert np.array_equal(found, read_codes(path))


def test_the_interpreters_zlib_gives_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    codes = np.random.default_rng(1).integers(0, 2**16, (40, 30)).astype(">u2")
    lines = np.concatenate([np.zeros((40, 1), np.uint8), codes.view(np.uint8)], 1)
    path = tmp_path / "a.png"
    path.write_bytes(file_of(lines.tobytes(), 40, 30, 16))
    assert np.array_equal(read_frame(path), codes)
    monkeypatch.setattr(png, "_DECOMPRESS", zlib.decompress)
    monkeypatch.setattr(png, "_DAMAGED", zlib.error)
    assert np.array_equal(read_frame(path), codes)


LINES = np.zeros((3, 9), np.uint8)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("transparent", file_of(LINES.tobytes(), 3, 4, 16, chunk(b"tRNS", b"\0\1"))),
        ("an unknown critical chunk", file_of(LINES.tobytes(), 3, 4, 16, chunk(b"ABCD", b""))),
        ("four bits", file_of(bytes(3 * 3), 3, 4, 4)),
        ("too few lines", file_of(LINES[:2].tobytes(), 3, 4, 16)),
        ("too many lines", file_of(bytes(27 + 9), 3, 4, 16)),
        ("an unknown filter", file_of(bytes([9]) * 27, 3, 4, 16)),
        ("no end", file_of(LINES.tobytes(), 3, 4, 16)[:-12]),
        ("cut", file_of(LINES.tobytes(), 3, 4, 16)[:60]),
        ("a bit that fell over", file_of(LINES.tobytes(), 3, 4, 16).replace(b"IDAT", b"IDAU", 1)),
        ("no PNG", b"P5 4 3 255\n" + bytes(12)),
    ],
)
def test_what_is_not_plain_and_sound_is_left_to_the_library(
    tmp_path: Path, name: str, content: bytes
) -> None:
    path = tmp_path / "frame.png"
    path.write_bytes(content)
    assert png.plain_codes(path) is None, name


def test_a_damaged_frame_is_refused_in_one_line(tmp_path: Path) -> None:
    content = bytearray(file_of(bytes(range(27)), 3, 4, 16))
    content[50] ^= 0xFF
    path = tmp_path / "frame.png"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is damaged") as caught:
        read_frame(path)
    assert "\n" not in caught.value.faults[0].fact
