"""Image files: the only place that touches OpenImageIO."""

import errno
import glob
import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - the name that its own examples use
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.errors import InputError

EXTENSIONS = {"png8": "png", "tiff16": "tif", "dpx16": "dpx", "exr": "exr"}
LIGHT_FORMATS = (".exr", ".tif", ".tiff")
READABLE = (".png", ".tif", ".tiff", ".dpx", ".exr", ".jpg", ".jpeg", ".cin", ".hdr")

# x and y of red, green, blue and white (ITU-R BT.709-6, items 1.3 and 1.4).
REC709_CHROMATICITIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

# Writers stamp the time of writing into some formats; the same frame must give the same bytes.
_NO_DATE = "2000:01:01 00:00:00"
_TIFF_HEADER_BYTES = 256
# SMPTE ST 268-1, file information header: bytes 36 to 135 hold the name of the file, NUL if unset.
_DPX_NAME_AT, _DPX_NAME_BYTES = 36, 100


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
    10; the order of the patterns is kept. Whatever exists is meant literally, brackets included:
    `take[1]/*.png` looks into a folder `take[1]` if there is one. Hidden files of folders are
    passed over, and so are names that no file can have.
    """
    found: list[Path] = []
    for pattern in patterns:
        try:
            hits = _hits(folder / Path(pattern).expanduser())
        except (OSError, RuntimeError, ValueError):  # too long, an unknown ~user, a NUL
            hits = []
        found += sorted(hits, key=natural_order)
    return tuple(found)


def _hits(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    there = next(base for base in (path, *path.parents) if base.exists())
    if there == path:
        inside = (p for p in path.iterdir() if not p.name.startswith("."))
        return [p for p in inside if p.suffix.lower() in READABLE and p.is_file()]
    # `Path.glob` knows no root that is no pattern itself.
    pattern = str(path.relative_to(there))
    named = glob.glob(pattern, root_dir=there)  # noqa: PTH207
    return [there / name for name in named if (there / name).is_file()]


def natural_order(path: Path) -> list[tuple[int, int, str]]:
    """Return a sorting key under which `frame2` comes before `frame10`."""
    parts = re.split(r"(\d+)", str(path))
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p) for p in parts]


def info(path: Path) -> ImageInfo:
    """Return what the header of an image says; raise `InputError` where it is no image."""
    opened = _opened(path)
    spec = opened.spec()
    opened.close()
    floating = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    return ImageInfo(spec.height, spec.width, spec.nchannels, floating)


def read(path: Path) -> NDArray[np.float32]:
    """Return an image as float32 (row, column, 3); integer files are scaled to 0..1.

    Grey images fill all three channels, alpha is dropped. Raises `InputError` where the file is
    damaged or holds values that are not finite.
    """
    opened = _opened(path)
    pixels = _whole(path, opened, oiio.FLOAT)
    image = pixels.astype(np.float32, copy=False)
    image = image[:, :, :3] if image.shape[2] >= 3 else np.repeat(image[:, :, :1], 3, axis=2)
    if not np.isfinite(image).all():
        raise InputError.of(path, "", "holds values that are not finite (NaN or infinite)")
    return np.ascontiguousarray(image)


@dataclass(frozen=True)
class CodesInfo:
    """What the header of an image file says of the codes in it.

    Attributes
    ----------
    rows, columns, channels
        Size in pixels, and samples per pixel.
    pixel_type
        Type of a sample in OpenImageIO's words: `uint8`, `uint16`, `uint`, `int16`, `half` ...
    bits
        Bits of a sample that the file holds; 12 for a packed 12-bit TIFF.
    images
        2 where the file holds more than one image, else 1.
    """

    rows: int
    columns: int
    channels: int
    pixel_type: str
    bits: int
    images: int


def known_format(path: Path) -> bool:
    """Return whether a file has the suffix of a format that can be read."""
    formats = str(oiio.get_string_attribute("extension_list")).split(";")
    known = {suffix for form in formats for suffix in form.rpartition(":")[2].split(",")}
    return path.suffix.lower().removeprefix(".") in known - {""}


def codes_info(path: Path) -> CodesInfo:
    """Return what the header says of a file's codes; raise `InputError` where it is no image."""
    opened = _opened(path)
    spec = opened.spec()
    images = 2 if opened.seek_subimage(1, 0) else 1
    opened.geterror()  # asking for a second image leaves a complaint where there is none
    opened.close()
    kind = str(spec.format)
    bits = spec.get_int_attribute("oiio:BitsPerSample", 8 * spec.format.size())
    return CodesInfo(spec.height, spec.width, spec.nchannels, kind, bits, images)


def read_codes(path: Path) -> NDArray[np.unsignedinteger]:
    """Return the codes of a single-channel file as they were recorded: unsigned, (row, column).

    OpenImageIO stretches 10 bits to 16 and a Netpbm maximum of 4095 to 65535; that is undone, so
    codes are right-aligned. Raises `InputError` where the file is damaged or holds no such codes.
    """
    opened = _opened(path)
    spec = opened.spec()
    kind = str(spec.format)
    if kind not in ("uint8", "uint16", "uint") or spec.nchannels != 1:
        opened.close()
        fact = f"holds {spec.nchannels} channels of type {kind}, must hold one of unsigned codes"
        raise InputError.of(path, "", fact)
    stored: NDArray[np.unsignedinteger] = _whole(path, opened, spec.format)[:, :, 0]
    if path.suffix.lower() in (".pgm", ".pnm"):
        return _unstretched(stored, _netpbm_maximum(path))
    container = 8 * stored.itemsize
    spare = container - spec.get_int_attribute("oiio:BitsPerSample", container)
    return stored >> stored.dtype.type(spare) if spare else stored


def _opened(path: Path) -> oiio.ImageInput:
    opened = oiio.ImageInput.open(str(path))
    if opened is None:
        reason = _first_line(oiio.geterror()) or "unknown"
        raise InputError.of(path, "", f"is no readable image: {reason}")
    return opened


def _whole(
    path: Path, opened: oiio.ImageInput, form: oiio.TypeDesc | oiio.BASETYPE
) -> NDArray[Any]:
    """Return the pixels of an opened file and close it; raise `InputError` where it is damaged."""
    pixels = opened.read_image(format=form)
    error = opened.geterror()
    opened.close()
    if pixels is None or error.strip():
        raise InputError.of(path, "", f"is damaged: {_first_line(error) or 'no pixels'}")
    return np.asarray(pixels)


def _first_line(complaint: str) -> str:
    """Return the first line: the libraries of the formats complain once a strip."""
    return next((line.strip() for line in complaint.splitlines() if line.strip()), "")


def _netpbm_maximum(path: Path) -> int:
    """Return the largest code that the header of a Netpbm file allows."""
    with path.open("rb") as file:
        head = re.sub(rb"#[^\n]*", b"", file.read(4096))
    return int(head.split(maxsplit=4)[3])


def _unstretched(stored: NDArray[np.unsignedinteger], most: int) -> NDArray[np.unsignedinteger]:
    """Return the codes 0..most that were stretched to the full range and rounded down."""
    top = np.iinfo(stored.dtype).max
    if most == top:
        return stored
    return ((stored.astype(np.uint64) * most + top - 1) // top).astype(stored.dtype)


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
        pixels = codes(display, 255)
    else:
        pixels = codes(display, 65535)
    write_codes(path, pixels)


def write_light(path: Path, light: NDArray[np.float32], says: str) -> None:
    """Write linear light with Rec.709 primaries as EXR or TIFF of float32, whole or not at all.

    Parameters
    ----------
    path
        Where to; its ending decides the format.
    light
        float32 (row, column, 3).
    says
        What it is; goes into the file's description.
    """
    write_codes(path, light, {"ImageDescription": says, "oiio:ColorSpace": "lin_rec709_scene"})


def begin(path: Path) -> Path:
    """Return an empty file in the folder of `path`, made where it is absent: what is not yet whole.

    Raises `OSError`, which names `path`, where no file can be written.
    """
    unfinished = path.with_name(f".{path.stem}.unfinished{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.write_bytes(b"")
    except OSError as error:
        raise OSError(error.errno, f"cannot be written: {error.strerror}", str(path)) from None
    return unfinished


def write_codes(
    path: Path, pixels: NDArray[np.generic], attributes: Mapping[str, str] = MappingProxyType({})
) -> None:
    """Write pixels as they are (uint8, uint16, float16 or float32), whole or not at all."""
    rows, columns, channels = pixels.shape
    kinds = {
        "uint8": oiio.UINT8,
        "uint16": oiio.UINT16,
        "float16": oiio.HALF,
        "float32": oiio.FLOAT,
    }
    spec = oiio.ImageSpec(columns, rows, channels, kinds[pixels.dtype.name])
    for name, value in attributes.items():
        spec.attribute(name, value)
    if pixels.dtype == np.float32 and path.suffix.lower() == ".exr":
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), REC709_CHROMATICITIES)
    spec.attribute("DateTime", _NO_DATE)
    spec.attribute("compression", "zip" if path.suffix.lower() == ".exr" else "none")
    if path.suffix == ".png":
        spec.attribute("png:compressionLevel", 1)
    unfinished = begin(path)
    complaint = _written(unfinished, pixels, spec)
    if complaint:
        unfinished.unlink(missing_ok=True)
        raise OSError(errno.EIO, f"cannot be written: {complaint}", str(path))
    unfinished.replace(path)


def _written(path: Path, pixels: NDArray[np.generic], spec: oiio.ImageSpec) -> str:
    """Write a file and return why it does not hold the pixels, "" if it does.

    Some writers say nothing when the disk is full: a frame counts once it has been read back.
    """
    if _plain_tiff(path, pixels) and not spec.get_string_attribute("ImageDescription"):
        # OpenImageIO takes four times as long for the same samples.
        samples = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder("<"))
        try:
            with path.open("wb") as file:
                file.write(_tiff_header(pixels))
                file.write(samples.data)
            kept = np.fromfile(path, samples.dtype, offset=_TIFF_HEADER_BYTES)
        except OSError as error:
            return error.strerror or "unknown"
        return "" if np.array_equal(kept, samples.reshape(-1)) else "the disk may be full"
    out = oiio.ImageOutput.create(str(path))
    whole = out is not None and out.open(str(path), spec) and out.write_image(pixels)
    whole = (out is not None and out.close()) and whole
    try:
        if whole and path.suffix.lower() == ".dpx":
            _forget_dpx_name(path)
    except OSError as error:
        return error.strerror or "unknown"
    if whole and _holds(path, pixels):
        return ""
    return (out.geterror() if out else oiio.geterror()).strip() or "the disk may be full"


def _forget_dpx_name(path: Path) -> None:
    """Clear the file's name in the header of a DPX: no attribute of OpenImageIO sets or drops it.

    It writes the whole path of the unfinished file: the folder would be in the bytes of a frame.
    """
    with path.open("r+b") as file:
        file.seek(_DPX_NAME_AT)
        file.write(bytes(_DPX_NAME_BYTES))


def _plain_tiff(path: Path, pixels: NDArray[np.generic]) -> bool:
    """Tell whether pixels are what `_tiff_header` describes: whole codes, grey or RGB, < 4 GB."""
    codes = pixels.dtype in (np.uint8, np.uint16) and pixels.shape[2] in (1, 3)
    small = pixels.nbytes < 2**32 - _TIFF_HEADER_BYTES
    return codes and small and path.suffix.lower() in (".tif", ".tiff")


def _tiff_header(pixels: NDArray[np.generic]) -> bytes:
    """Return what precedes the samples of an uncompressed TIFF: 6.0, little-endian, one strip."""
    rows, columns, channels = pixels.shape
    short, long, rational = 3, 4, 5
    after = 8 + 2 + 14 * 12 + 4  # the entries; then what is too long for one
    bits = 8 * pixels.itemsize
    entries = (
        (256, long, 1, columns),
        (257, long, 1, rows),
        (258, short, channels, bits if channels == 1 else after),
        (259, short, 1, 1),  # not compressed
        (262, short, 1, 1 if channels == 1 else 2),  # zero is black, or RGB
        (273, long, 1, _TIFF_HEADER_BYTES),  # where the samples begin
        (274, short, 1, 1),  # the first row is the top one
        (277, short, 1, channels),
        (278, long, 1, rows),  # all in one strip
        (279, long, 1, pixels.nbytes),
        (282, rational, 1, after + 8),
        (283, rational, 1, after + 8),
        (284, short, 1, 1),  # the samples of a pixel stand together
        (296, short, 1, 1),  # resolution without a unit: square pixels
    )
    directory = b"".join(struct.pack("<HHII", *entry) for entry in entries)
    head = struct.pack("<2sHIH", b"II", 42, 8, len(entries)) + directory + bytes(4)
    more = struct.pack("<4H", *(bits,) * channels, *(0,) * (4 - channels)) + struct.pack(
        "<II", 1, 1
    )
    return (head + more).ljust(_TIFF_HEADER_BYTES, b"\0")


def _holds(path: Path, pixels: NDArray[np.generic]) -> bool:
    """Tell whether a file holds these pixels, bit for bit."""
    opened = oiio.ImageInput.open(str(path))
    if opened is None:
        oiio.geterror()  # an error that nobody asks for is printed at the end of the program
        return False
    found = opened.read_image(format=opened.spec().format)
    error = opened.geterror()
    opened.close()
    return not error and found is not None and np.array_equal(found, pixels)


def codes(display: NDArray[np.float32], top: int) -> NDArray[np.uint8 | np.uint16]:
    """Return display values 0..1 as whole codes 0..top (255 or 65535), rounded half up, clipped.

    What is not a number becomes 0.
    """
    whole = np.empty(display.shape, np.uint8 if top == 255 else np.uint16)
    _round(display.reshape(-1), np.float32(top), whole.reshape(-1))
    return whole


@kernel
def _round(
    display: NDArray[np.float32], top: np.float32, whole: NDArray[np.uint8 | np.uint16]
) -> None:
    zero, one, half = np.float32(0), np.float32(1), np.float32(0.5)
    for i in range(display.size):
        x = min(one, max(zero, display[i]))  # in this order NaN becomes 0
        whole[i] = np.int32(x * top + half)
