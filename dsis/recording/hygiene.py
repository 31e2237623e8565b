"""Is a recording fit to be analysed: copies of frames, clipping, missing light, odd codes.

Nothing here refuses a recording; each remark states a limit of what it can show.
"""

import math
import zlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.recording.copies import Identity, Same, Streamed, copies_of, remarks_on_copies

CLIPPED_SHARE = 1e-4
"""Share of clipped pixels above which mean and variance of an exposure are biased noticeably."""

_FIRST = 4096  # samples of a frame, which tell that codes are ordinary
_LEAST_STEPS = 4  # that all codes reach over: of fewer no step is told


class Planned(Protocol):
    """What the remarks need to know of an exposure."""

    @property
    def name(self) -> str: ...  # noqa: D102 - `ExposurePlan` says it
    @property
    def kind(self) -> str: ...  # noqa: D102 - `ExposurePlan` says it
    @property
    def frames(self) -> object: ...  # noqa: D102 - their files, or arrays, or how many


@dataclass(frozen=True)
class FrameSummary:
    """One frame in a few numbers: code sum, least and largest code, clipped counts, common step.

    `checksum` is CRC-32 of the codes. `step` is the greatest that all differences of codes are
    multiples of; 0 where there is one code.
    """

    total: int
    least: int
    largest: int
    at_zero: int
    at_white: int
    step: int
    size: int
    checksum: int

    @property
    def constant(self) -> bool:
        """Whether it holds one code only: such frames may well be equal."""
        return self.least == self.largest

    @property
    def identity(self) -> Identity | None:
        """`identity_of` the frame."""
        return None if self.constant else (self.checksum, self.total, self.size)


class Inspection:
    """Gathers what passes by while frames are streamed; threads may share it."""

    def __init__(self, white_level: float) -> None:
        self.white_level = white_level
        self._seen: dict[str, dict[int, FrameSummary]] = defaultdict(dict)
        self._lock = Lock()

    def look(self, exposure: str, index: int, codes: NDArray[np.uint16]) -> None:
        """Take note of frame `index` of an exposure: uint16 (row, column)."""
        numbers = _summarise(codes.reshape(-1), np.uint16(np.ceil(self.white_level)))
        checksum = zlib.crc32(np.ascontiguousarray(codes).data)
        total, least, largest, at_zero, at_white = (int(n) for n in numbers)
        step = _step_of(codes.reshape(-1))
        summary = FrameSummary(total, least, largest, at_zero, at_white, step, codes.size, checksum)
        with self._lock:
            self._seen[exposure][index] = summary

    def copies(self, recording: Streamed) -> tuple[Same, ...]:
        """Return the places of frames of a recording that occur twice in what was looked at.

        See `dsis.recording.copies.copies_of`; where there may be some, frames are read again.
        """
        seen = {(n, i): f.identity for n, frames in self._seen.items() for i, f in frames.items()}
        return copies_of(recording, seen)

    def remarks(self, exposures: Sequence[Planned], copies: Sequence[Same]) -> tuple[str, ...]:
        """Return the remarks on the exposures that were looked at, in their order.

        `copies` are those that `copies` returns.
        """
        seen = [(e, [self._seen[e.name][i] for i in sorted(self._seen[e.name])])
                for e in exposures if e.name in self._seen]  # fmt: skip
        found = [remark for e, frames in seen for remark in _on_exposure(e, frames)]
        told = remarks_on_copies(exposures, copies)
        return (*found, *told, *self._on_codes(), *_on_light(seen))

    def step_dn(self) -> int:
        """Return the greatest step that lies between all codes; 1 for ordinary codes, or few."""
        frames = self._frames()
        if not frames:
            return 1
        least = min(frame.least for frame in frames)
        step = math.gcd(*(one for f in frames for one in (f.step, f.least - least)))
        reach = max(frame.largest for frame in frames) - least
        return step if 1 < step * _LEAST_STEPS <= reach else 1

    def phase_dn(self) -> int:
        """Return what all codes leave when divided by their step: 0 for multiples of it."""
        return min((frame.least for frame in self._frames()), default=0) % self.step_dn()

    def _frames(self) -> list[FrameSummary]:
        return [frame for frames in self._seen.values() for frame in frames.values()]

    def _on_codes(self) -> list[str]:
        step, phase = self.step_dn(), self.phase_dn()
        if step <= 1:
            return []
        if phase:
            return [f"all codes are {phase} and multiples of {step}: coarser than the bit depth"]
        says = f"all codes are multiples of {step}: left-aligned, or converted?"
        return [f"{says} Codes must be right-aligned"]


def _on_exposure(exposure: Planned, frames: list[FrameSummary]) -> list[str]:
    name, pixels = exposure.name, sum(f.size for f in frames)
    at_white = sum(f.at_white for f in frames) / pixels
    at_zero = sum(f.at_zero for f in frames) / pixels
    constant = sum(f.constant for f in frames)
    found = []
    if len(frames) == 1:
        found.append(f"{name}: one frame only, temporal noise cannot be measured")
    if len(frames) > 1 and len({f.identity for f in frames}) == 1 and not constant:
        many = f"its {len(frames)} frames are byte-identical"
        found.append(f"{name}: {many}, temporal noise cannot be measured")
    if at_white == 1:
        found.append(f"{name}: saturated, every pixel is at the white level")
    elif at_white > CLIPPED_SHARE:
        found.append(f"{name}: {at_white:.2%} of the pixels are clipped at the white level")
    if at_zero == 1:
        found.append(f"{name}: empty, every pixel is 0")
    elif at_zero > CLIPPED_SHARE:
        found.append(f"{name}: {at_zero:.2%} of the pixels are at code 0, its mean is biased")
    if constant and at_white < 1 and at_zero < 1:
        found.append(f"{name}: {constant} of {len(frames)} frames hold one code only")
    return found


def _on_light(seen: list[tuple[Planned, list[FrameSummary]]]) -> list[str]:
    """Return remarks on whether the recording holds usable light at all."""
    means = [(e, sum(f.total for f in frames) / sum(f.size for f in frames)) for e, frames in seen]
    darks = [mean for e, mean in means if e.kind == "dark"]
    lit = [(e, frames) for e, frames in seen if e.kind != "dark"]
    if not lit:
        return ["no exposure has light: neither gain nor response can be measured"]
    found = []
    if darks:
        found = [
            f"{e.name}: no brighter than the darks"
            for e, mean in means
            if e.kind != "dark" and mean <= max(darks)
        ]
    if all(f.at_white > CLIPPED_SHARE * f.size for _, frames in lit for f in frames):
        found.append("every exposure with light is clipped: gain cannot be measured")
    return found


@kernel
def _summarise(
    codes: NDArray[np.uint16], white: np.uint16
) -> tuple[np.uint64, np.uint16, np.uint16, np.uint64, np.uint64]:
    total, at_zero, at_white = np.uint64(0), np.uint64(0), np.uint64(0)
    least, largest = np.uint16(65535), np.uint16(0)
    for i in range(codes.size):
        code = codes[i]
        total += np.uint64(code)
        at_zero += np.uint64(code == 0)
        at_white += np.uint64(code >= white)
        least = min(least, code)
        largest = max(largest, code)
    return total, least, largest, at_zero, at_white


def _step_of(codes: NDArray[np.uint16]) -> int:
    """Return the greatest step between codes, (sample,); 0 where there is one code."""
    step = _common_step(np.unique(codes[:_FIRST]))
    return step if step == 1 else _common_step(np.flatnonzero(_occurring(codes)))


def _common_step(ascending: NDArray[np.integer]) -> int:
    return int(np.gcd.reduce(np.diff(ascending)))


@kernel
def _occurring(codes: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Return whether each code 0..65535 occurs."""
    found = np.zeros(65536, np.bool_)
    for i in range(codes.size):
        found[codes[i]] = True
    return found
