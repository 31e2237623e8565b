"""Frames that lie in a recording twice, byte for byte: noise cannot repeat itself."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, islice

import numpy as np

from analysis.mismatch.source import Source
from dsis.errors import InputError
from dsis.recording import Recording
from dsis.recording.hygiene import Place
from dsis.recording.model import Codes

COPIES = "noise cannot repeat itself"
"""What is said of all that is left out for its copies."""
# Pixels in which unequal frames differ at least beyond what moves rows, columns and frames, where
# noise moves each for itself: that none differs has a chance of exp(-40). Codes that hardly move
# may well be equal; so may those that a pattern moves, by few sizes.
_MOVED, _SIZES = 40, 3
_SOME = 0.02  # of all pixels, that have a size
_DISTINCT = 3  # frames: a pattern of two phases makes two
_LOOKED_AT = 8  # frames of an exposure that are told from one another
_SHOWN = 8
_FEW = 3  # pairs of equal frames that are told one by one


def copies_of(recording: Recording, source: Source) -> tuple[tuple[Place, ...], ...]:
    """Return the places of each frame that lies in a recording as stored more than once.

    Frames of one code, and of exposures whose codes hardly move, may be equal: none of these.
    """
    for exposure in recording.exposures:
        numbers = range(len(exposure.frames))
        unread = [n for n in numbers if (exposure.name, n) not in source.checksums]
        for _ in source.frames(exposure.name, unread):
            pass
    alike = defaultdict(list)
    for place, checksum in sorted(source.checksums.items()):
        alike[checksum].append(place)
    equal = [same for some in alike.values() if len(some) > 1 for same in _equal(recording, some)]
    moving = {name: _moving(recording, name) for name in {n for same in equal for n, _ in same}}
    return tuple(same for same in equal if any(moving[name] for name, _ in same))


def without_copies(recording: Recording, copies: Sequence[Sequence[Place]]) -> Recording:
    """Return a recording without the exposures that hold copies, as `dsis camera fit` does.

    Raises
    ------
    InputError
        No dark or flat is left.
    """
    names = {name for same in copies for name, _ in same}
    left = tuple(e for e in recording.exposures if e.name not in names)
    if all(e.kind == "scene" for e in left):
        fact = f"hold byte-identical frames in every dark and flat, and {COPIES}"
        raise InputError.of(recording.folder, "exposures", f"{fact}: {_places(copies)}")
    return replace(recording, exposures=left)


def remark_on_copies(copies: Sequence[Sequence[Place]]) -> str:
    """Return which exposures are left out for their copies."""
    return f"Exposures left out, {COPIES} and frames of them are byte-identical: {_places(copies)}."


def _equal(recording: Recording, some: Sequence[Place]) -> list[tuple[Place, ...]]:
    """Return those of frames of one checksum that are equal, and hold more than one code."""
    first = _frame(recording, some[0])
    if first.min() == first.max():
        return []
    rest = [place for place in some[1:] if np.array_equal(first, _frame(recording, place))]
    return [(some[0], *rest)] if rest else []


def _moving(recording: Recording, name: str) -> bool:
    """Return whether noise of single pixels makes unequal frames of an exposure unequal."""
    first = list(islice(recording.frames(recording.exposure(name)), _LOOKED_AT))
    pairs = [(a, b) for a, b in combinations(first, 2) if not np.array_equal(a, b)]
    if len({frame.tobytes() for frame in first}) < _DISTINCT:
        return False
    return min(_moved(a, b) for a, b in pairs) >= _MOVED


def _moved(one: Codes, other: Codes) -> int:
    """Return how many pixels of two frames differ beyond their rows and columns, by many sizes."""
    change = one.astype(np.int32) - other
    for axis in (1, 0):
        change -= np.median(change, axis, keepdims=True).astype(np.int32)
    _, pixels = np.unique(np.abs(change), return_counts=True)
    sizes = int((pixels > _SOME * change.size).sum())
    return int(np.count_nonzero(change)) if sizes >= _SIZES else 0


def _frame(recording: Recording, place: Place) -> Codes:
    return recording.frame(recording.exposure(place[0]), place[1])


def _places(copies: Sequence[Sequence[Place]]) -> str:
    """Return where copies lie: `flat-1 (frames 1 = 2, 4 = 5), dark and flat-2 (8 frames)`."""
    by: dict[tuple[str, ...], list[Sequence[Place]]] = defaultdict(list)
    for same in copies:
        by[tuple(dict.fromkeys(name for name, _ in same))].append(same)
    said = []
    for names, groups in by.items():
        if len(names) == 1 and len(groups) <= _FEW:
            pairs = ", ".join(" = ".join(str(number) for _, number in same) for same in groups)
            said.append(f"{names[0]} (frames {pairs})")
        else:
            times = "more than once" if len(names) == 1 else "in common"
            frames = "1 frame" if len(groups) == 1 else f"{len(groups)} frames"
            said.append(f"{' and '.join(names)} ({frames} {times})")
    more = f" and {len(said) - _SHOWN} more" if len(said) > _SHOWN else ""
    return ", ".join(said[:_SHOWN]) + more
