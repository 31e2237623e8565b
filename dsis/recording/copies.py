"""Frames that lie in a recording twice, byte for byte: noise cannot repeat itself.

Frames are alike by numbers that are taken of each in passing. Only where some are, and only of the
exposures concerned, are frames read again, to see whether noise moves single pixels: what moves
whole frames, rows, columns or a pattern beside little noise makes honest frames equal.
"""

import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import combinations
from math import exp
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Place = tuple[str, int]  # exposure, and number of the frame
Same = tuple[Place, ...]
Identity = tuple[int, int, int]
Codes = NDArray[np.uint16]

COPIES = "noise cannot repeat itself"
"""What is said of all that is left out for its copies."""
# That frames are equal although noise moves as many of their pixels, each for itself, as in two
# unequal ones beyond rows, columns and frames. Codes that hardly move may well be equal; so may
# those that a pattern, or an edge between two codes, moves by few sizes.
_CHANCE = exp(-40)
_FEW = 2  # sizes of changes: none, and one
_SOME = 0.02  # of all pixels, that change by other sizes
_TWO = 2  # frames: of a pattern of two phases there are no more
_MOSTLY = 0.5  # of a change, that neighbours tell: a pattern's
_AROUND = (1, 2)  # pixels to both sides, which tell a cosine of any frequency
_LOOKED_AT = 8  # unequal frames of an exposure that are told from one another
_SAMPLES = 1 << 20  # of a frame, which are held for that: whole rows of its middle


class Streamed(Protocol):
    """A recording: its exposures (name, frames), and the frames of each, uint16 (row, column)."""

    @property
    def exposures(self) -> Sequence[Any]: ...  # noqa: D102 - the class says it
    def frames(self, exposure: Any, /) -> Iterator[Codes]: ...  # noqa: D102


def identity_of(codes: Codes) -> Identity | None:
    """Return what byte-identical frames share, and hardly any others; None for one code only.

    CRC-32, sum and number of codes, uint16 (row, column): the sum alone spreads over thousands of
    values, so 1000 frames of noise hold two that only seem alike once in ten million recordings.
    """
    if (codes == codes[0, 0]).all():
        return None
    checksum = zlib.crc32(np.ascontiguousarray(codes).data)
    return checksum, int(codes.sum(dtype=np.uint64)), codes.size


def copies_of(recording: Streamed, seen: Mapping[Place, Identity | None]) -> tuple[Same, ...]:
    """Return the places of each frame that lies in a recording more than once.

    Parameters
    ----------
    recording
        In whose order places come; a few megabytes of an exposure's frames are held at a time.
    seen
        `identity_of` the frames that were looked at. Frames of one code are no copies.

    Returns
    -------
    Two places or more of each such frame. Frames of exposures none of which moves pixel by pixel
    may be equal: of these, only those that are one file. So it is with frames of some twenty
    pixels: they are too few to tell.
    """
    rank = {e.name: number for number, e in enumerate(recording.exposures)}
    alike = defaultdict(list)
    for place in sorted(seen, key=lambda place: (rank[place[0]], place[1])):
        alike[seen[place]].append(place)
    files = files_of(recording.exposures)

    @cache
    def moves(name: str) -> bool:
        return _moves(recording.frames(recording.exposures[rank[name]]))

    found: list[Same] = []
    for identity, places in alike.items():
        if identity is None or len(places) < _TWO:
            continue
        if any(moves(name) for name in dict.fromkeys(name for name, _ in places)):
            found.append(tuple(places))
        else:
            found += _of_one_file(places, files)
    return tuple(found)


def copied_exposures(copies: Iterable[Same]) -> frozenset[str]:
    """Return the names of the exposures that hold copies."""
    return frozenset(name for same in copies for name, _ in same)


def files_of(exposures: Sequence[Any]) -> dict[Place, Path]:
    """Return the file of each frame that has one."""
    return {
        (e.name, index): file
        for e in exposures
        if isinstance(e.frames, tuple)
        for index, file in enumerate(e.frames)
        if isinstance(file, Path)
    }


def remarks_on_copies(exposures: Sequence[Any], copies: Sequence[Same]) -> list[str]:
    """Return a remark for the exposures that share frames, with the first of these frames."""
    files = files_of(exposures)
    groups: dict[tuple[bool, tuple[str, ...]], list[Same]] = defaultdict(list)
    for same in copies:
        once = _of_one_file(same, files) == [same]
        groups[once, tuple(dict.fromkeys(name for name, _ in same))].append(same)
    return [_remark(group, names, files, once=once) for (once, names), group in groups.items()]


def _remark(
    group: list[Same], names: Sequence[str], files: Mapping[Place, Path], *, once: bool
) -> str:
    frames = ", ".join(f"{name} frame {index}" for name, index in group[0])
    more = f" (the first of {len(group)} in {', '.join(names)})" if len(group) > 1 else ""
    if once:
        file = files[group[0][0]]
        return f"the same file is listed more than once: {file.name} is {frames}{more}"
    return f"byte-identical frames, {COPIES}: {frames}{more}"


def _of_one_file(places: Iterable[Place], files: Mapping[Place, Path]) -> list[Same]:
    """Return those of some places that share a file."""
    by: dict[Path, list[Place]] = defaultdict(list)
    for place in places:
        if place in files:
            by[files[place]].append(place)
    return [tuple(same) for same in by.values() if len(same) > 1]


def _moves(frames: Iterator[Codes]) -> bool:
    """Return whether noise of single pixels makes unequal frames of an exposure unequal."""
    unequal: list[Codes] = []
    for frame in frames:
        part = _middle(frame)
        if not any(np.array_equal(part, one) for one in unequal):
            unequal.append(part)
        if len(unequal) == _LOOKED_AT:
            break
    if len(unequal) < _TWO:
        return False
    if len(unequal) == _TWO and _told_by_neighbours(_change(*unequal)):
        return False
    return all(_of_noise(_change(a, b)) for a, b in combinations(unequal, 2))


def _middle(frame: Codes) -> Codes:
    rows = max(_SAMPLES // frame.shape[1], 1)
    first = max(frame.shape[0] - rows, 0) // 2
    return frame[first : first + rows].copy()


def _change(one: Codes, other: Codes) -> NDArray[np.int32]:
    """Return by how much pixels of two frames differ beyond their rows and columns."""
    change = one.astype(np.int32) - other
    for axis in (1, 0):
        if change.shape[axis] > _TWO:  # the middle of two takes all of them away
            change -= np.median(change, axis, keepdims=True).astype(np.int32)
    return change


def _of_noise(change: NDArray[np.int32]) -> bool:
    """Return whether so many pixels changed, by many sizes, that no two frames are equal."""
    sizes, pixels = np.unique(np.abs(change), return_counts=True)
    still = int(pixels[sizes == 0].sum()) / change.size
    others = int(np.sort(pixels)[:-_FEW].sum())
    return others > _SOME * change.size and still**change.size <= _CHANCE


def _told_by_neighbours(change: NDArray[np.int32]) -> bool:
    """Return whether the changes of pixels around it tell most of a pixel's: those of a pattern."""
    own = change.astype(np.float64)
    sums = [
        (np.roll(own, step, axis) + np.roll(own, -step, axis)).reshape(-1)
        for axis in (0, 1)
        if own.shape[axis] > 2 * max(_AROUND)
        for step in _AROUND
    ]
    if not sums:
        return False
    matrix, wanted = np.stack(sums), own.reshape(-1)
    weights = np.linalg.lstsq(matrix @ matrix.T, matrix @ wanted, rcond=None)[0]
    rest = wanted - weights @ matrix
    return bool(rest @ rest < (1 - _MOSTLY) * (wanted @ wanted))
