"""Recordings by plain numpy in which spikes hit samples: darks and flats of one camera."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.source import Source
from analysis.mismatch.spikes import Spikes, spikes_of
from dsis.cfa import Cfa
from dsis.recording import RecordedExposure, Sensor
from mismatch_recordings import InMemory, camera

Array = NDArray[np.float64]
ROWS, COLUMNS, BLACK, WHITE, READ, SLOPE = 128, 192, 64.0, 4095, 2.0, 0.5
MODEL = camera(segments=((SLOPE, READ**2, None),))
DARKS, FLATS = 3, (200.0, 600.0, 1500.0)
Change = Callable[[np.random.Generator, dict[str, Array]], None]


def made(
    seed: int,
    change: Change | None = None,
    *,
    frames: int = 12,
    cfa: str = "MONO",
    scene: bool = False,
    clean: Callable[[np.random.Generator, Array], Array] | None = None,
) -> InMemory:
    """Return darks and flats by plain numpy, changed before they become codes."""
    rng = np.random.default_rng(seed)
    pattern = rng.normal(0, 1, (ROWS, COLUMNS))
    levels = {f"dark-{i}": 0.0 * pattern for i in range(DARKS)}
    levels |= {f"flat-{i}": level * (1 + 0.01 * pattern) for i, level in enumerate(FLATS)}
    if scene:
        levels["scene"] = np.repeat(rng.uniform(5, 3000, (ROWS // 8, COLUMNS // 8)), 8, 0).repeat(
            8, 1
        )
    noise = clean or (lambda rng, mean: rng.normal(mean, np.sqrt(SLOPE * mean.clip(0) + READ**2)))
    stacks = {n: np.stack([noise(rng, mean) for _ in range(frames)]) for n, mean in levels.items()}
    if change is not None:
        change(rng, stacks)
    codes = {
        n: np.clip(np.rint(own + BLACK), 0, WHITE).astype(np.uint16) for n, own in stacks.items()
    }
    exposures = tuple(
        RecordedExposure(
            name,
            name.partition("-")[0],  # type: ignore[arg-type] # one of the kinds
            0.01 * (i + 1),
            None if name.startswith("dark") else float(i),
            tuple(Path(str(k)) for k in range(frames)),
        )
        for i, name in enumerate(stacks)
    )
    sensor = Sensor(name="s", cfa=Cfa(cfa), black_level=BLACK, white_level=WHITE, bit_depth=12)
    return InMemory(sensor, exposures, ROWS, COLUMNS, Path(), codes)


def spikes(count: int, mean_dn: float = 1500.0) -> Change:
    """Return what adds exactly so many spikes, anywhere."""

    def change(rng: np.random.Generator, stacks: dict[str, Array]) -> None:
        sizes = np.cumsum([own.size for own in stacks.values()])
        places = rng.choice(sizes[-1], count, replace=False)
        for own, end in zip(stacks.values(), sizes, strict=True):
            here = places[(places >= end - own.size) & (places < end)] - (end - own.size)
            own.reshape(-1)[here] += rng.exponential(mean_dn, here.size)

    return change


def found(recording: InMemory) -> Spikes | None:
    return spikes_of(recording, Source(recording), MODEL)


def samples(recording: InMemory) -> int:
    return sum(len(e.frames) for e in recording.exposures) * ROWS * COLUMNS
