"""Exposures that hold frames twice, byte for byte, are left out of a diagnosis, and said."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from analysis.mismatch.source import Source
from dsis.errors import InputError
from dsis.recording import Recording
from dsis.recording.copies import COPIES, Same, copied_exposures
from dsis.recording.copies import copies_of as copies_among

_SHOWN = 8
_FEW = 3  # pairs of equal frames that are told one by one


def copies_of(recording: Recording, source: Source) -> tuple[Same, ...]:
    """Return the places of each frame that lies in a recording as stored more than once.

    Frames that `source` has not read are read; see `dsis.recording.copies.copies_of`.
    """
    for exposure in recording.exposures:
        numbers = range(len(exposure.frames))
        unread = [n for n in numbers if (exposure.name, n) not in source.identities]
        for _ in source.frames(exposure.name, unread):
            pass
    return copies_among(recording, source.identities)


def without_copies(recording: Recording, copies: Sequence[Same]) -> Recording:
    """Return a recording without the exposures that hold copies, as `dsis camera fit` does.

    Raises
    ------
    InputError
        No dark or flat is left of those that there are.
    """
    names = copied_exposures(copies)
    left = tuple(e for e in recording.exposures if e.name not in names)
    uniform = [e for e in recording.exposures if e.kind != "scene"]
    if uniform and all(e.name in names for e in uniform):
        fact = f"hold byte-identical frames in every dark and flat, and {COPIES}"
        raise InputError.of(recording.folder, "exposures", f"{fact}: {_places(copies)}")
    return replace(recording, exposures=left)


def remark_on_copies(copies: Sequence[Same]) -> str:
    """Return which exposures are left out for their copies."""
    return f"Exposures left out, {COPIES} and frames of them are byte-identical: {_places(copies)}."


def _places(copies: Sequence[Same]) -> str:
    """Return where copies lie: `flat-1 (frames 1 = 2, 4 = 5), dark and flat-2 (8 frames)`."""
    by: dict[tuple[str, ...], list[Same]] = defaultdict(list)
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
