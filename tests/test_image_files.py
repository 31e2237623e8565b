"""Promise: a TIFF that dsis writes is read alike by everyone, and holds what was to be kept."""

import errno
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from OpenImageIO import ImageBuf
from PIL import Image

from dsis import imagefile

CODES = st.sampled_from([np.uint8, np.uint16])


@given(st.integers(1, 9), st.integers(1, 9), st.sampled_from([1, 3]), CODES, st.integers(0, 9))
def test_two_other_libraries_read_the_same_codes(
    tmp_path_factory: pytest.TempPathFactory,
    rows: int,
    columns: int,
    channels: int,
    kind: type[np.unsignedinteger],
    seed: int,
) -> None:
    path = tmp_path_factory.mktemp("tiff") / "a.tif"
    shape, top = (rows, columns, channels), np.iinfo(kind).max
    pixels = np.random.default_rng(seed).integers(0, top, shape, kind, endpoint=True)
    imagefile.write_codes(path, pixels)
    image = ImageBuf(str(path))
    spec = image.spec()
    assert str(spec.format) == np.dtype(kind).name
    assert spec.get_string_attribute("compression") == "none"
    np.testing.assert_array_equal(image.get_pixels(spec.format).reshape(shape), pixels)
    if kind is np.uint8 or channels == 1:  # Pillow knows no colour of 16 bits
        with Image.open(path) as other:
            np.testing.assert_array_equal(np.asarray(other).reshape(shape), pixels)


def test_the_same_frame_gives_the_same_bytes_whatever_its_layout_in_memory(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 65535, (7, 9, 3), np.uint16)
    written = []
    for n, layout in enumerate((pixels, np.asfortranarray(pixels), np.repeat(pixels, 2, 0)[::2])):
        path = tmp_path / f"{n}.tif"
        imagefile.write_codes(path, layout)
        written.append(path.read_bytes())
    assert written[0] == written[1] == written[2]
    assert written[0].endswith(pixels.tobytes())


@pytest.mark.parametrize("name", ["a.tif", "a.png"])
def test_a_full_disk_leaves_no_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether the system says so or keeps only a part in silence."""
    pixels = np.ones((8, 8, 3), np.uint16)
    monkeypatch.setattr(imagefile, "_holds", lambda *_: False)
    monkeypatch.setattr(np, "fromfile", lambda *_, **__: pixels.reshape(-1)[:-1])
    with pytest.raises(OSError, match=r"cannot be written: the disk may be full") as raised:
        imagefile.write_codes(tmp_path / name, pixels)
    assert raised.value.errno == errno.EIO
    assert not list(tmp_path.iterdir())


def test_what_the_system_says_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = Path.open

    def full(path: Path, mode: str = "r", *rest: object) -> object:
        if path.exists():  # there is space for a name, not for samples
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, mode, *rest)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(OSError, match="No space left on device"):
        imagefile.write_codes(tmp_path / "a.tif", np.ones((8, 8, 1), np.uint8))
    assert not list(tmp_path.iterdir())


def test_words_about_a_picture_are_kept_whatever_its_samples(tmp_path: Path) -> None:
    pixels = np.ones((8, 9, 3), np.uint16)
    imagefile.write_codes(tmp_path / "a.tif", pixels, {"ImageDescription": "a flat field"})
    image = ImageBuf(str(tmp_path / "a.tif"))
    assert image.spec().get_string_attribute("ImageDescription") == "a flat field"
    np.testing.assert_array_equal(image.get_pixels(image.spec().format), pixels)


@pytest.mark.parametrize(("channels", "kind"), [(3, np.uint8), (1, np.uint16)])
def test_the_header_says_what_readers_ask_for(
    channels: int, kind: type[np.unsignedinteger], tmp_path: Path
) -> None:
    """Tags of TIFF 6.0, part 1: the first row on top, square pixels, one strip."""
    pixels = np.ones((8, 9, channels), kind)
    imagefile.write_codes(tmp_path / "a.tif", pixels)
    with Image.open(tmp_path / "a.tif") as image:
        tags = dict(image.tag_v2)
    bits = (8 * pixels.itemsize,) * channels
    assert {n: tags[n] for n in (256, 257, 258, 259, 262, 274, 277, 278, 284)} == {
        256: 9, 257: 8, 258: bits, 259: 1, 262: 1 + (channels == 3), 274: 1, 277: channels, 278: 8,
        284: 1,
    }  # fmt: skip
    assert tags[279] == (8 * 9 * channels * pixels.itemsize,)
    assert tags[282] == tags[283] == 1


def test_what_is_too_large_for_a_plain_tiff_is_left_to_the_library() -> None:
    """An offset has 32 bits."""
    for columns, plain in ((2**16 - 1, True), (2**16, False)):
        pixels = np.broadcast_to(np.uint8(0), (2**16, columns, 1))
        assert imagefile._plain_tiff(Path("a.tif"), pixels) is plain
