"""Light that is not the same in every frame, and a black level that wanders."""

from typing import Any

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.effect import Effect
from third.fixed_patterns import SQRT3
from third.strengths import frame_floor, of_wander

FRAMES = 40  # of levels that do not clip: what a wander from frame to frame needs
LINE_TIME_S = 30e-6


class BlackLevelDrift(Effect):
    """An offset of each frame: normal, at times persisting; or uniform."""

    kind, group, order = "black_level_drift", "frame", 3

    @override
    def draw(self) -> None:
        self.persistence = float(self.chance.choice([0, 0, 0.5, 0.8]))

    @override
    def camera_fits(self) -> bool:
        return bool(self.cells.whole_frames.sum() > FRAMES)

    @override
    def z_of(self, size: float) -> float:
        return of_wander(self.bench, size * size / frame_floor(self.bench))

    @override
    def leave_floor(self) -> None:
        self.bench.floors.frame_offset = self.size

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        if self.neighbouring:
            offsets = self.chance.uniform(-1, 1, len(volts)) * SQRT3
        else:
            offsets = self._persisting(len(volts))
        return volts + (self.size * offsets).astype(np.float32)[:, None, None]

    def _persisting(self, frames: int) -> Array:
        rho, here, values = self.persistence, self.chance.normal(), []
        for _ in range(frames):
            here = rho * here + (1 - rho * rho) ** 0.5 * self.chance.normal()
            values.append(here)
        return np.array(values)

    @override
    def parameters(self) -> dict[str, Any]:
        persistence = 0 if self.neighbouring else self.persistence
        return {"sigma_dn": self.size, "persistence": persistence}


class Flicker(Effect):
    """A gain of each frame: normal, or uniform."""

    kind, group, order, most = "flicker", "frame", 3, 0.08

    @override
    def camera_fits(self) -> bool:
        return bool(self.cells.whole_frames.sum() > FRAMES)

    @override
    def z_of(self, size: float) -> float:
        gained = size * size * self.cells.whole_signal**2
        return of_wander(self.bench, gained / frame_floor(self.bench))

    @override
    def leave_floor(self) -> None:
        self.bench.floors.frame_gain = self.size

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        if self.neighbouring:
            gains = self.chance.uniform(-1, 1, len(light)) * SQRT3
        else:
            gains = self.chance.normal(size=len(light))
        return light * (1 + self.size * gains).astype(np.float32)[:, None, None]

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_percent": 100 * self.size}


class LineFlicker(Effect):
    """A lamp on mains, rows exposed one after another.

    The lamp is 1 + d cos(2 pi f t), and row y is exposed a line time after row y - 1. Frames start
    when they like; or at a steady rate, the wave having a harmonic.
    """

    kind, group, order, most = "line_flicker", "rowt", 2, 0.3

    @override
    def draw(self) -> None:
        self.cycles = float(self.chance.uniform(1.3, 9))

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        power = (size * c.whole_signal) ** 2 * self.camera.pixels / 4 / c.whole_variance
        return of_wander(self.bench, power, 2)

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        frames, rows = len(light), self.camera.rows
        frequency = self.cycles / (rows * LINE_TIME_S)
        if self.neighbouring:
            steady = np.arange(frames) * 1.618034 * 7 / frequency
            start = self.chance.uniform(0, 9) + steady
        else:
            start = self.chance.uniform(0, 1e3, frames)
        time = start[:, None] + LINE_TIME_S * np.arange(rows)
        wave = np.cos(2 * np.pi * frequency * time)
        if self.neighbouring:
            wave = wave + 0.2 * np.cos(4 * np.pi * frequency * time + 0.4)
        return light * (1 + self.size * wave).astype(np.float32)[:, :, None]

    @override
    def parameters(self) -> dict[str, Any]:
        return {"depth_percent": 100 * self.size, "cycles_per_frame": self.cycles}
