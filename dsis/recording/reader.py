"""A recording from its folder, its TOML, an EMVA 1288 descriptor or a camera raw file."""

from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

from dsis.cfa import Cfa
from dsis.errors import Fault, InputError
from dsis.recording.cameraraw import RAW_SUFFIXES, raw_header
from dsis.recording.emva1288 import read_descriptor
from dsis.recording.frameformat import FrameHeader, read_header
from dsis.recording.listing import NAMED, Listed, Listing, counted
from dsis.recording.model import RecordedExposure, Recording, Sensor
from dsis.recording.tomlfile import RECORDING, read_listing

Headers = Mapping[Path, FrameHeader]
V = TypeVar("V", bound=Hashable)


class Unfit(NamedTuple):
    """A frame that does not fit, and why."""

    listed: Listed
    frame: Path
    fact: str


def read_recording(path: Path) -> Recording:
    """Return a recording after looking at the header of every frame.

    Parameters
    ----------
    path
        A folder with `recording.toml`, that file, an EMVA 1288 descriptor (`.txt`), or one camera
        raw file (`.dng`, `.cr3` ...: a recording of a single scene frame).

    Raises
    ------
    InputError
        With every fault, what is alike in many frames said once: unknown keys, missing files, empty
        exposures, frames of different size or bits, several channels, signed or floating-point
        values. What only the codes show (a truncated file, a code above `white_level`) is raised
        when the frames are streamed.
    """
    listing = _listing(Path(path))
    headers, unfit = _headers(listing)
    rows, columns = _size(listing, headers, unfit)
    _check_bits(listing, headers, unfit)
    _check_colours(listing, headers, unfit)
    faults = [*listing.faults, *_duplicates(listing), *_faults(listing, unfit)]
    if faults or listing.sensor is None:
        raise InputError(faults)
    exposures = tuple(listed.exposure for listed in listing.exposures)
    return Recording(listing.sensor, exposures, rows, columns, listing.file.parent.absolute())


def _listing(path: Path) -> Listing:
    suffix = path.suffix.lower()
    if path.is_dir():
        if not (path / RECORDING).is_file():
            raise InputError.of(path, "", f"holds no {RECORDING}")
        return read_listing(path / RECORDING)
    if not path.exists():
        raise InputError.of(path, "", f"is missing; give a folder with {RECORDING}")
    if suffix == ".toml":
        return read_listing(path)
    if suffix == ".txt":
        return read_descriptor(path)
    if suffix in RAW_SUFFIXES:
        return _single_raw(path)
    allowed = f"a folder with {RECORDING}, that file, an EMVA 1288 descriptor (.txt), camera raw"
    raise InputError.of(path, "", f"is no recording, must be one of: {allowed}")


def _single_raw(path: Path) -> Listing:
    """Return one camera raw file as a recording of one scene."""
    raw = raw_header(path)
    faults = []
    if raw.colours not in set(Cfa):
        allowed = ", ".join(Cfa)
        faults.append(Fault(str(path), "", f"has filters {raw.colours}, must be one of: {allowed}"))
    if raw.exposure_time_s <= 0:
        fact = f"states no exposure time: list it in a {RECORDING}, with exposure_time_s"
        faults.append(Fault(str(path), "", fact))
    if faults:
        raise InputError(faults)
    sensor = Sensor(
        name=path.stem,
        cfa=Cfa(raw.colours),
        black_level=raw.black_level,
        white_level=raw.white_level,
        bit_depth=int(raw.white_level).bit_length(),
    )
    frames = (path.absolute(),)
    exposure = RecordedExposure(path.stem, "scene", raw.exposure_time_s, None, frames)
    return Listing(path, sensor, (Listed("", exposure),))


def _headers(listing: Listing) -> tuple[dict[Path, FrameHeader], list[Unfit]]:
    """Return the header of every frame that has one, in the order listed."""
    headers: dict[Path, FrameHeader] = {}
    unfit = []
    for listed in listing.exposures:
        for frame in listed.exposure.frames:
            if frame in headers or not frame.is_file():
                continue
            try:
                headers[frame] = read_header(frame)
            except InputError as error:
                facts = "; ".join(fault.fact for fault in error.faults)
                unfit.append(Unfit(listed, frame, facts))
    return headers, unfit


def _duplicates(listing: Listing) -> list[Fault]:
    names = Counter(listed.exposure.name for listed in listing.exposures)
    return [
        Fault(str(listing.file), "exposure", f"{count} exposures are named {name!r}")
        for name, count in names.items()
        if count > 1
    ]


def _size(listing: Listing, headers: Headers, unfit: list[Unfit]) -> tuple[int, int]:
    """Return rows and columns; add every frame of another size to `unfit`."""
    if listing.size is not None:
        wanted, model = listing.size, listing.file.name
    elif headers:
        wanted, model = _usual(listing, headers, lambda h: (h.rows, h.columns))
    else:
        return 0, 0
    for listed, frame, header in _frames(listing, headers):
        if (header.rows, header.columns) != wanted:
            fact = f"has {header.rows} x {header.columns} pixels, "
            fact += f"must have {wanted[0]} x {wanted[1]} (rows x columns) like {model}"
            unfit.append(Unfit(listed, frame, fact))
    return wanted


def _check_bits(listing: Listing, headers: Headers, unfit: list[Unfit]) -> None:
    """Refuse files of different bits: one of them has been converted."""
    if not headers:
        return
    wanted, model = _usual(listing, headers, lambda h: h.pixel_type)
    white = listing.sensor.white_level if listing.sensor else 0
    for listed, frame, header in _frames(listing, headers):
        if header.pixel_type != wanted:
            fact = f"holds {header.pixel_type} codes, must hold {wanted} like {model}"
            unfit.append(Unfit(listed, frame, fact))
        elif white > 2**header.bits - 1:
            fact = f"holds {header.pixel_type} codes, which cannot reach white_level = {white:g}"
            unfit.append(Unfit(listed, frame, fact))


def _check_colours(listing: Listing, headers: Headers, unfit: list[Unfit]) -> None:
    """Compare the colour filters with those that camera raw files state themselves."""
    if listing.sensor is None:
        return
    cfa = listing.sensor.cfa.value
    for listed, frame, header in _frames(listing, headers):
        if header.colours not in (None, cfa):
            fact = f"has filters {header.colours}, must have {cfa} as the sensor says"
            unfit.append(Unfit(listed, frame, fact))


def _usual(listing: Listing, headers: Headers, of: Callable[[FrameHeader], V]) -> tuple[V, str]:
    """Return the most frequent property of the headers, and a file that has it."""
    frames = _frames(listing, headers)
    counts = Counter(of(header) for _, _, header in frames)
    value = counts.most_common(1)[0][0]
    model = next(frame for _, frame, header in frames if of(header) == value)
    return value, _shown(listing, model)


def _frames(listing: Listing, headers: Headers) -> list[tuple[Listed, Path, FrameHeader]]:
    return [
        (listed, frame, headers[frame])
        for listed in listing.exposures
        for frame in listed.exposure.frames
        if frame in headers
    ]


def _faults(listing: Listing, unfit: Sequence[Unfit]) -> list[Fault]:
    """Return one fault for what is alike in frames, with the first of them."""
    alike: dict[str, list[Fault]] = defaultdict(list)
    for listed, frame, fact in unfit:
        says = f"{_shown(listing, frame)} {fact}"
        # Libraries repeat the path in their complaints.
        kind = fact.replace(str(frame), "")
        alike[kind].append(Fault(str(listing.file), listed.place, says))
    return [fault for faults in alike.values() for fault in counted(faults, "such frames", NAMED)]


def _shown(listing: Listing, frame: Path) -> str:
    """Return a path as a user looks for it: from the folder of the description."""
    folder = listing.file.parent.absolute()
    return str(frame.relative_to(folder)) if frame.is_relative_to(folder) else str(frame)
