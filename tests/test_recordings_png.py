"""Promise: PNG frames are read as every other library reads them, fast path or not.

Oracle: OpenImageIO, which has nothing in common with the fast path.
"""

import struct
import tracemalloc
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
def filtered(draw: st.DrawFn, largest: int, least_kind: int) -> tuple[np.ndarray, int, int, int]:
    """Filtered lines of any bytes: each is some picture, whatever its filters."""
    rows, columns, size = (
        draw(st.integers(1, 7)),
        draw(st.integers(1, 9)),
        draw(st.sampled_from((1, 2))),
    )
    shape = (rows, columns * size)
    content = draw(arrays.arrays(np.uint8, shape, elements=st.integers(0, largest)))
    kinds = draw(arrays.arrays(np.uint8, (rows, 1), elements=st.integers(least_kind, 4)))
    return np.concatenate([kinds, content], 1), rows, columns, 8 * size


# Few values and Paeth's filter alone: predictions that tie.
@given(stored=filtered(255, 0) | filtered(4, 4))
@settings(max_examples=200)
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
    monkeypatch.setattr(png, "_DECOMPRESSOR", zlib.decompressobj)
    monkeypatch.setattr(png, "_DAMAGED", zlib.error)
    assert np.array_equal(read_frame(path), codes)


LINES = np.zeros((3, 9), np.uint8)


def with_other_lines_checksum(rows: int, columns: int) -> bytes:
    """Return a file whose chunks are sound, but not the checksum that ends its packed lines."""
    packed = bytearray(zlib.compress(bytes(rows * (1 + 2 * columns))))
    packed[-1] ^= 1
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 16, 0, 0, 0, 0))
    end = chunk(b"IDAT", bytes(packed)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + header + end


def with_another_checksum(content: bytes, kind: bytes) -> bytes:
    """Return a file of which the first chunk of a kind has one bit of its checksum turned over."""
    at = content.index(kind)
    last = at + 4 + struct.unpack_from(">I", content, at - 4)[0] + 3
    return content[:last] + bytes([content[last] ^ 1]) + content[last + 1 :]


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


def test_a_small_file_that_would_swell_is_not_unpacked(tmp_path: Path) -> None:
    """A hundred million bytes of zeros in a file for twelve pixels: no room is made for them."""
    path = tmp_path / "frame.png"
    path.write_bytes(file_of(bytes(10**8), 3, 4, 16))
    tracemalloc.start()
    try:
        assert png.plain_codes(path) is None
        assert tracemalloc.get_traced_memory()[1] < 10**7
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (with_another_checksum(file_of(bytes(27), 3, 4, 16), b"IHDR"), "a chunk IHDR is wrong"),
        (with_another_checksum(file_of(bytes(27), 3, 4, 16), b"IDAT"), "a chunk IDAT is wrong"),
        (with_another_checksum(file_of(bytes(27), 3, 4, 16), b"IEND"), "a chunk IEND is wrong"),
        (with_other_lines_checksum(3, 4), "packed lines cannot be unpacked"),
    ],
)
def test_nobody_but_us_says_that_a_frame_is_damaged(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], content: bytes, says: str
) -> None:
    path = tmp_path / "frame.png"
    path.write_bytes(content)
    with pytest.raises(InputError, match=f"is damaged: .*{says}"):
        read_frame(path)
    assert capfd.readouterr().err == ""
