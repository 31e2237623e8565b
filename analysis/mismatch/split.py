"""Which frames train, which select, which stay locked until the proof.

Frames are split by number in alternating blocks (train, select, train, locked), so that slow drift
is in all parts. Exposures of fewer than six frames are given whole to one part; the brightest is
not locked, for no other shows where a full well ends or what a long exposure gathers; of three
frames or more its last one is, for nothing else proves that. Where of few darks, or flats, none
would be locked, the last frame of each that has three or more is: read noise and offsets are proven
nowhere else. One flat level is left out of the re-calibration, so that the line's interpolation is
tested.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from dsis.recording import RecordedExposure, Recording

LEAST_FRAMES = 6
_LEAST_SPREAD = 3  # frames, of which two are left to look at
_BLOCKS = 16  # about so many blocks in a long exposure
_ORDER = (0, 1, 0, 2)  # train, select, train, locked
_LOCKED = 2
_LEAST_LEVELS = 6  # flat levels from which one can be spared


@dataclass(frozen=True)
class Split:
    """Numbers of frames by exposure, from 0.

    Attributes
    ----------
    train, select, locked
        By the exposure's name; a name is absent where it has no frames there.
    interpolated
        The flat exposure that the re-calibration leaves out; None: too few levels.
    """

    train: Mapping[str, tuple[int, ...]]
    select: Mapping[str, tuple[int, ...]]
    locked: Mapping[str, tuple[int, ...]]
    interpolated: str | None

    @property
    def development(self) -> dict[str, tuple[int, ...]]:
        """Frames that may be looked at before the proof: train and select."""
        names = dict.fromkeys([*self.train, *self.select])
        return {
            name: tuple(sorted((*self.train.get(name, ()), *self.select.get(name, ()))))
            for name in names
        }

    @property
    def all_of_development(self) -> dict[str, tuple[int, ...]]:
        """All frames, the locked ones too, of exposures that have some in development."""
        return {
            name: tuple(sorted((*numbers, *self.locked.get(name, ()))))
            for name, numbers in self.development.items()
        }

    def without(self, names: Collection[str]) -> "Split":
        """Return the split without some exposures."""
        train, select, locked = (
            {name: numbers for name, numbers in part.items() if name not in names}
            for part in (self.train, self.select, self.locked)
        )
        return replace(self, train=train, select=select, locked=locked)

    @classmethod
    def of(cls, recording: Recording) -> "Split":
        """Return the split of a recording."""
        parts: tuple[dict[str, tuple[int, ...]], ...] = ({}, {}, {})
        for exposure in recording.exposures:
            if len(exposure.frames) >= LEAST_FRAMES:
                for part, numbers in zip(parts, _blocks(len(exposure.frames)), strict=True):
                    part[exposure.name] = numbers
        for kind in ("dark", "flat", "scene"):
            few = [
                e for e in recording.exposures if e.kind == kind and len(e.frames) < LEAST_FRAMES
            ]
            given = _whole(len(few))
            locked = {e.name for e in recording.of_kind(kind)} & parts[_LOCKED].keys()
            spread = kind != "scene" and not locked and _LOCKED not in given
            ordered = sorted(few, key=_brightness)
            for own, exposure in zip(given, ordered, strict=True):
                numbers = tuple(range(len(exposure.frames)))
                brightest = kind == "flat" and exposure is ordered[-1]
                if (spread or brightest) and len(numbers) >= _LEAST_SPREAD:
                    parts[_LOCKED][exposure.name] = numbers[-1:]
                    numbers = numbers[:-1]
                parts[own][exposure.name] = numbers
        return cls(parts[0], parts[1], parts[2], _spared(recording))


def _blocks(frames: int) -> tuple[tuple[int, ...], ...]:
    length = max(frames // _BLOCKS, 1)
    part = [_ORDER[(number // length) % 4] for number in range(frames)]
    return tuple(tuple(i for i, p in enumerate(part) if p == which) for which in range(3))


def _whole(count: int) -> list[int]:
    """Return the parts that exposures are given to, the darkest first."""
    found = [_ORDER[place % 4] for place in range(count)]
    if found[-1:] == [_LOCKED]:
        found[-2:] = found[:-3:-1]
    return found


def _brightness(exposure: RecordedExposure) -> tuple[float, float, str]:
    light = exposure.light
    return (
        (exposure.exposure_time_s if light is None else light),
        exposure.exposure_time_s,
        (exposure.name),
    )


def _spared(recording: Recording) -> str | None:
    flats = sorted(
        (e for e in recording.of_kind("flat") if len(e.frames) >= LEAST_FRAMES), key=_brightness
    )
    return flats[len(flats) // 2].name if len(flats) >= _LEAST_LEVELS else None
