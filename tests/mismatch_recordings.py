"""Recordings in memory, for what is proven on locked frames."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.observe import observe
from analysis.mismatch.prove import hold
from analysis.mismatch.prove.held import Held
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.effects import Effect
from dsis.grid import PixelGrid
from dsis.recording import ExposurePlan, RecordedExposure, Recording, Sensor
from dsis.simulate import Shot, dark, flat
from dsis.simulate.simulator import simulated_frames

ROWS, COLUMNS = 96, 128
LEVELS = (100.0, 250.0, 500.0, 900.0, 1600.0, 2600.0)
FEW_LEVELS = (250.0, 900.0, 2600.0)
"""Enough for what shows at every level: a simulation takes as long as it has exposures."""
TWO_LEVELS = (250.0, 2600.0)
"""The fewest that tell what grows with the signal from what does not."""
FRAMES = 8
TRAINING, LOCKED = (0, 1, 2, 4, 5, 6), (3, 7)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class InMemory(Recording):
    """A recording whose frames are held in memory."""

    stacks: dict[str, NDArray[np.uint16]] | None = None

    def frame(self, exposure: RecordedExposure, index: int) -> NDArray[np.uint16]:
        assert self.stacks is not None
        return self.stacks[exposure.name][index]


def camera(
    *effects: Effect,
    cfa: str = "MONO",
    segments: tuple[tuple[float, float, float | None], ...] = ((0.5, 20.0, None),),
    black: float = 64.0,
) -> Camera:
    parts = tuple(Segment(slope=m, intercept=t, upper_dn=end) for m, t, end in segments)
    return Camera(
        name="planted",
        cfa=Cfa(cfa),
        black_level=black,
        white_level=4095.0,
        bit_depth=12,
        noise=BaseNoise(segment=parts),
        effect=effects,
    )


def recorded(
    true: Camera,
    seed: int,
    *,
    rows: int = ROWS,
    columns: int = COLUMNS,
    frames: int = FRAMES,
    levels: tuple[float, ...] = LEVELS,
    lit: bool = True,
    scene: NDArray[np.float32] | None = None,
) -> InMemory:
    """Return a recording of two dark times and flats."""
    shots = [
        dark("dark-0", frames=frames, exposure_time_s=0.005),
        dark("dark-1", frames=frames, exposure_time_s=0.05),
    ]
    shots += [
        flat(
            f"flat-{i}",
            level,
            frames=frames,
            exposure_time_s=0.01 * (i + 1),
            light=level if lit else None,
        )
        for i, level in enumerate(levels)
    ]
    if scene is not None:
        shots.append(Shot(ExposurePlan("scene", "scene", 0.01, frames), lambda _: scene.copy()))
    grid = PixelGrid(rows, columns, true.cfa)
    made = list(simulated_frames(true, shots, grid, seed=seed))
    stacks = {
        shot.plan.name: np.stack(made[k * frames : (k + 1) * frames])
        for k, shot in enumerate(shots)
    }
    exposures = tuple(
        RecordedExposure(
            shot.plan.name,
            shot.plan.kind,
            shot.plan.exposure_time_s,
            shot.plan.light,
            tuple(Path(str(i)) for i in range(frames)),
        )
        for shot in shots
    )
    sensor = Sensor(
        name="planted",
        cfa=true.cfa,
        black_level=true.black_level,
        white_level=true.white_level,
        bit_depth=true.bit_depth,
    )
    return InMemory(sensor, exposures, rows, columns, Path(), stacks)


def state_of_all(recording: InMemory, model: Camera) -> State:
    """Return the state of all frames beside a model, with the maps that they show."""
    assert recording.stacks is not None
    stacks = recording.stacks
    numbers = {e.name: tuple(range(len(e.frames))) for e in recording.exposures}
    layout = layout_of(recording, numbers, lambda name, which: stacks[name][list(which)])
    seen = observe(layout, stacks.__getitem__, keep=True)
    return State.of(Setting(layout, seen, None, 0, 1, 16, 16, 2, 2, 4), model, lambda: None)


def responding(
    seed: int,
    levels: tuple[float, ...],
    response: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    *,
    side: int = 64,
    frames: int = 8,
) -> InMemory:
    """Return numpy's own recording of a 12-bit sensor that answers its charge, DN, by a law.

    Shot noise of slope 0.5, read noise of 6 DN^2 after the response, black at 64.
    """
    rng = np.random.default_rng(seed)
    made = recorded(camera(), seed, rows=side, columns=side, frames=frames, levels=levels)
    stacks = {}
    flats = {f"flat-{i}": level for i, level in enumerate(levels)}
    for name, level in ({"dark-0": 0.0, "dark-1": 0.0} | flats).items():
        shape = (frames, side, side)
        charge = level + np.sqrt(0.5 * level) * rng.standard_normal(shape)
        noisy = 64.0 + response(charge) + np.sqrt(6.0) * rng.standard_normal(shape)
        stacks[name] = np.clip(np.rint(noisy), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, side, side, made.folder, stacks)


def held_of(recording: Recording, locked: tuple[int, ...] = LOCKED) -> Held:
    names = [e.name for e in recording.exposures]
    frames = len(recording.exposures[0].frames)
    training = tuple(i for i in range(frames) if i not in locked)
    return hold(recording, dict.fromkeys(names, training), dict.fromkeys(names, locked))


def signals(levels: tuple[float, ...] = LEVELS) -> dict[str, Array]:
    made = {f"flat-{i}": np.full((2, 2), level) for i, level in enumerate(levels)}
    return made | {"dark-0": np.zeros((2, 2)), "dark-1": np.zeros((2, 2))}


def setting_of(recording: InMemory, *, nulls: int = 8) -> Setting:
    """Return what stays the same of a recording; a draft is of eight simulations."""
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    return Setting(layout, seen, None, 1, 1, nulls, 8, 2, 2, 2)


def state_of(recording: InMemory, model: Camera) -> State:
    """Return the state of a camera beside a recording."""
    return State.of(setting_of(recording), model, lambda: None)
