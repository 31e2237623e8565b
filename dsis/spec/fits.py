"""Whether the parts of a spec fit one another: sizes, lengths, names."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from dsis.errors import Fault, InputError
from dsis.imagefile import ImageInfo, info
from dsis.spec.footage import Footage, footage_of
from dsis.spec.schema import TRAINING, Content, Sequence, Session

STRIP_MAX_PX = 5 * 10**8  # 6 GB of light


def misfits(
    contents: tuple[Content, ...], sequence: Sequence, folder: Path, file: str
) -> list[Fault]:
    """Return the faults of footage that cannot fill the clips, and of doubled names."""
    faults: list[Fault] = []
    named: dict[str, list[str]] = {}
    for i, content in enumerate(contents):
        at = f"content[{i}]"
        fit = _Fit(content, sequence, file, at)
        for footage in footage_of(content, folder):
            faults += fit.still(footage) if footage.still else fit.numbered(footage)
            if content.stills is not None:
                named.setdefault(footage.name, []).append(str(footage.paths[0]))
        if content.scene is not None:
            faults += fit.scene()
        if content.stills is None and content.name is not None:
            named.setdefault(content.name, []).append(at)
    return faults + list(_confused(named, file))


def _confused(named: Mapping[str, list[str]], file: str) -> Iterator[Fault]:
    """Yield the faults of names; `named` tells what has each."""
    for name, owners in named.items():
        if name == TRAINING:
            fact = f"{name!r} is the name of the training's own content: give another"
            yield Fault(file, "content", f"{fact} to {owners[0]}")
        if len(owners) > 1:
            more = f" and {len(owners) - 2} more" if len(owners) > 2 else ""
            both = f"{owners[0]} and {owners[1]}{more}"
            if owners[0] == owners[1]:
                both = f"{owners[0]} is found twice"
            fact = f"two contents have the name {name!r}: {both}"
            yield Fault(file, "content", fact)


@dataclass(frozen=True)
class _Fit:
    """One `[[content]]`, the clips it must fill, and where faults are said to be."""

    content: Content
    sequence: Sequence
    file: str
    at: str

    def still(self, footage: Footage) -> list[Fault]:
        """Return the faults of a picture that a window pans over."""
        headers, faults = _headers(footage.paths)
        travel = abs(self.content.pan_px_per_frame) * (self.sequence.frames - 1)
        return faults + [
            fault for path, found in headers.items() for fault in self._small(path, found, travel)
        ]

    def numbered(self, footage: Footage) -> list[Fault]:
        """Return the faults of a sequence: too short, damaged, of several sizes, too small."""
        need = self.sequence.frames
        if len(footage.paths) < need:
            fact = f"{len(footage.paths)} frames found, sequence needs {need}"
            return [Fault(self.file, f"{self.at}.files", fact)]
        headers, faults = _headers(footage.paths[:need])
        if faults:
            more = f" (and {len(faults) - 1} more files)" if len(faults) > 1 else ""
            return [Fault(faults[0].file, faults[0].key, faults[0].fact + more)]
        (first, found), *others = headers.items()
        odd = [(path, other) for path, other in others if _shape(other) != _shape(found)]
        if odd:
            fact = f"{odd[0][0]} is {_shape(odd[0][1])}, but {first.name} is {_shape(found)}: "
            fact += f"all frames must be alike ({len(odd)} of {need} are not)"
            return [Fault(self.file, f"{self.at}.files", fact)]
        return self._small(first, found, 0.0)

    def scene(self) -> list[Fault]:
        """Return the fault of a strip that no memory holds."""
        size, scale = self.sequence, self.content.scale
        travel = abs(self.content.pan_px_per_frame) * (size.frames - 1)
        pixels = scale**2 * size.height * (size.width + travel)
        if pixels <= STRIP_MAX_PX:
            return []
        fact = f"needs a scene of {pixels:.3g} pixels ({scale} x {size.height} rows, "
        fact += f"{scale} x {size.width + travel:g} columns), must be at most {STRIP_MAX_PX:.0e}"
        return [Fault(self.file, f"{self.at}.pan_px_per_frame", fact)]

    def _small(self, path: Path, found: ImageInfo, travel: float) -> list[Fault]:
        size, scale = self.sequence, self.content.scale
        rows, columns = scale * size.height, math.ceil(scale * (size.width + travel))
        if found.rows >= rows and found.columns >= columns:
            return []
        fact = f"{path.name} is {found.columns}x{found.rows} pixels, must be {columns}x{rows} "
        fact += f"or more ({scale} x sequence {size.width}x{size.height}"
        fact += f" + a pan of {travel:g})" if travel else ")"
        key = "files" if self.content.stills is None else "stills"
        return [Fault(self.file, f"{self.at}.{key}", fact)]


def _headers(paths: tuple[Path, ...]) -> tuple[dict[Path, ImageInfo], list[Fault]]:
    """Return what the headers say, and the faults of files that are no images."""
    headers: dict[Path, ImageInfo] = {}
    faults: list[Fault] = []
    for path in paths:
        try:
            headers[path] = info(path)
        except InputError as error:
            faults += error.faults
    return headers, faults


def _shape(found: ImageInfo) -> str:
    """Return what frames of one sequence must share."""
    kind = "floating-point" if found.floating else "integer"
    return f"{found.columns}x{found.rows} {kind} pixels"


def too_long(session: Session, sequence: Sequence, file: str) -> list[Fault]:
    """Return the faults of clips that are to be shown for longer than they last."""
    return [
        Fault(
            file,
            f"session.{key}",
            f"is {value:g} s, must be <= sequence.seconds = {sequence.seconds:g}",
        )
        for key, value in (("reference_s", session.reference_s), ("test_s", session.test_s))
        if value > sequence.seconds
    ]
