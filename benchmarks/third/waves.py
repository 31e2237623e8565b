"""Waves over the frame that the read-out adds, their phase or sign new in each frame."""

from typing import Any

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.effect import Effect
from third.strengths import of_wander

STANDING = [(0.5, 0.5), (0.5, 0.0), (0.0, 0.5), (0.25, 0.5), (1 / 3, 1 / 3)]  # cycles a pixel


class PeriodicNoise(Effect):
    """A wave whose phase is new in each frame; or with a harmonic."""

    kind, group, order, neighbouring_share = "periodic_noise", "peak", 4, 0.2

    @override
    def draw(self) -> None:
        right = float(self.chance.uniform(0.04, 0.46))
        self.frequency = (right, float(self.chance.uniform(-0.46, 0.46)))

    @override
    def z_of(self, size: float) -> float:
        power = size * size * self.camera.pixels / 4 / self.cells.whole_variance
        return of_wander(self.bench, power, 2)

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        y, x = self.camera.grid()
        phases = self.chance.uniform(0, 2 * np.pi, len(volts)).astype(np.float32)[:, None, None]
        across = self.frequency[0] * x + self.frequency[1] * y
        angle = (2 * np.pi * across).astype(np.float32) + phases
        wave = np.cos(angle)
        if self.neighbouring:
            wave = wave + np.float32(0.25) * np.cos(2 * angle)
        return np.asarray(volts + np.float32(self.size) * wave)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"amplitude_dn": self.size, "frequency": self.frequency}


class BistablePattern(Effect):
    """A checkerboard or stripes, of either sign in each frame."""

    kind, group, order, has_neighbour = "bistable_pattern", "peak", 4, False

    @override
    def draw(self) -> None:
        self.frequency = STANDING[int(self.chance.integers(5))]

    def pattern(self) -> Array:
        """Return the wave at its full height."""
        y, x = self.camera.grid()
        across = self.frequency[0] * x + self.frequency[1] * y
        return np.asarray(np.cos(2 * np.pi * across).astype(np.float32))

    @override
    def z_of(self, size: float) -> float:
        power = float((self.pattern() ** 2).sum())
        return of_wander(self.bench, size * size * power / self.cells.whole_variance)

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        signs = self.chance.choice([-1, 1], len(volts)).astype(np.float32)
        wave = np.float32(self.size) * self.pattern()
        return np.asarray(volts + wave * signs[:, None, None])

    @override
    def parameters(self) -> dict[str, Any]:
        return {"amplitude_dn": self.size, "frequency": self.frequency}
