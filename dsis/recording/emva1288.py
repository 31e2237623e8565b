"""Descriptor files of EMVA 1288 measurements, as they are.

One command a line: `v` release, `n` bits width height, `b` exposure photons (flats), `d` exposure
(darks), `i` path (a frame of the last `b` or `d`). Exposure times are in ns, light in photons per
pixel, paths use backslashes and start from the descriptor (EMVA Standard 1288, release 3.0, and
its reference data set).
"""

from dataclasses import dataclass, field
from pathlib import Path

from dsis.cfa import Cfa
from dsis.errors import Fault, InputError
from dsis.recording.listing import NAMED, Listed, Listing, absolute, counted
from dsis.recording.model import Kind, RecordedExposure, Sensor

_NS_PER_S = 1e9
_ALLOWED = "v release, n bits width height, b exposure photons, d exposure, i path"


@dataclass
class _Group:
    """An exposure that still gathers its frames."""

    line: int
    kind: Kind
    exposure_time_s: float
    light: float | None
    frames: list[Path] = field(default_factory=list)


class _Parser:
    """Reads line after line and keeps what it understood and what it did not."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.faults: list[Fault] = []
        self.groups: list[_Group] = []
        self.missing: list[Fault] = []
        self.frames: list[Path] | None = None  # of the last `b` or `d`, understood or not
        self.format: tuple[int, int, int] | None = None

    def line(self, number: int, text: str) -> None:
        """Take in one line."""
        command, _, rest = text.strip().partition(" ")
        if not command or command.startswith("#"):
            return
        try:
            self._command(number, command, rest.strip())
        except ValueError:
            if command in ("b", "d"):  # its frames are of no exposure, and no faults themselves
                self.frames = []
            self._fault(number, f"{text.strip()!r} is not understood, must be one of: {_ALLOWED}")

    def _command(self, number: int, command: str, rest: str) -> None:
        match command:
            case "v":
                pass
            case "n":
                bits, width, height = (int(word) for word in rest.split())
                if self.format is not None:
                    self._fault(number, "states the format a second time")
                self.format = (bits, height, width)
            case "b":
                time, light = (_number(word) for word in rest.split())
                self._open(number, "flat", time, light)
            case "d":
                (time,) = (_number(word) for word in rest.split())
                self._open(number, "dark", time, None)
            case "i":
                self._frame(number, rest)
            case _:
                raise ValueError

    def _open(self, number: int, kind: Kind, time_ns: float, light: float | None) -> None:
        if not time_ns > 0:
            self._fault(number, f"exposure time is {time_ns:g} ns, must be greater than 0")
        if light is not None and not light > 0:
            self._fault(number, f"light is {light:g}, must be greater than 0")
        self.groups.append(_Group(number, kind, time_ns / _NS_PER_S, light))
        self.frames = self.groups[-1].frames

    def _frame(self, number: int, name: str) -> None:
        path = absolute(self.file.parent, name.replace("\\", "/"))
        if self.frames is None:
            self._fault(number, f"'i {name}' stands before the first b or d")
            return
        self.frames.append(path)
        if not path.is_file():
            self.missing.append(Fault(str(self.file), f"line {number}", f"{name!r} is missing"))

    def _fault(self, number: int, fact: str) -> None:
        self.faults.append(Fault(str(self.file), f"line {number}", fact))

    def sensor(self) -> Sensor | None:
        """Return the sensor: monochrome, white at the largest code of its bits."""
        if self.format is None:
            self.faults.append(Fault(str(self.file), "", "has no line 'n bits width height'"))
            return None
        bits = self.format[0]
        if not 1 <= bits <= 16:
            self.faults.append(Fault(str(self.file), "n", f"bits is {bits}, must be 1 to 16"))
            return None
        return Sensor(
            name=self.file.stem,
            cfa=Cfa.MONO,
            black_level=0.0,
            white_level=2.0**bits - 1,
            bit_depth=bits,
        )

    def exposures(self) -> tuple[Listed, ...]:
        """Return the groups as exposures `flat-00`, `flat-01` ..., `dark-00` ..."""
        counts: dict[Kind, int] = {"flat": 0, "dark": 0}
        listed = []
        for group in self.groups:
            if not group.frames:
                self._fault(group.line, "has no frames, must be followed by lines 'i path'")
            name = f"{group.kind}-{counts[group.kind]:02d}"
            counts[group.kind] += 1
            exposure = RecordedExposure(
                name, group.kind, group.exposure_time_s, group.light, tuple(group.frames)
            )
            listed.append(Listed(f"line {group.line} ({name})", exposure))
        if not listed:
            self.faults.append(Fault(str(self.file), "", "lists no exposures"))
        return tuple(listed)


def read_descriptor(path: Path) -> Listing:
    """Return what an EMVA 1288 descriptor file lists."""
    try:
        # Comments may hold letters of any old code page; commands are ASCII.
        text = path.read_text(encoding="utf-8-sig", errors="surrogateescape")
    except OSError as error:
        raise InputError.of(path, "", f"cannot be read: {error.strerror}") from None
    parser = _Parser(path)
    for number, line in enumerate(text.splitlines(), 1):
        parser.line(number, line)
    sensor, exposures = parser.sensor(), parser.exposures()
    size = None if parser.format is None else parser.format[1:]
    faults = [*parser.faults, *counted(parser.missing, "missing frames", NAMED)]
    return Listing(path, sensor, exposures, size, tuple(faults))


def _number(word: str) -> float:
    """Return a decimal number, whichever mark it uses."""
    return float(word.replace(",", "."))
