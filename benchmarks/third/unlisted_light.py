"""Physics of light and optics that is on no list."""

from typing import ClassVar

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.effect import Effect, has_two_times
from third.strengths import Growth, of_known_pattern, of_wander


class Unlisted(Effect):
    """An effect that no name fits."""

    listed, has_neighbour = False, False


class FixedLight(Unlisted):
    """A fixed pattern of the light, or of what is added at a constant rate."""

    grows: ClassVar[Growth] = "gain"
    sign: ClassVar[int] = 1
    pattern: Array

    @override
    def camera_fits(self) -> bool:
        return self.grows == "gain" or has_two_times(self.bench)

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, self.grows)

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        if self.grows != "gain":
            return light
        return light * (1 + self.sign * self.size * self.pattern).astype(np.float32)

    @override
    def warmed(self, light: Array, exposure: Exposure) -> Array:
        if self.grows != "time":
            return light
        return light + (self.size * exposure.time_s * self.pattern).astype(np.float32)


class LeakStripe(FixedLight):
    """A slit in the housing: a slanted stripe of stray light at a constant rate, in darks too."""

    kind, grows = "leak_stripe", "time"

    @override
    def draw(self) -> None:
        y, x = self.camera.grid()
        angle = self.chance.uniform(0.3, 1.2)
        right = x - self.camera.columns * self.chance.uniform(0.3, 0.7)
        away = right * np.cos(angle) + (y - self.camera.rows / 2) * np.sin(angle)
        self.pattern = np.exp(-0.5 * (away / self.chance.uniform(2, 5)) ** 2)


class GhostRing(FixedLight):
    """A reflection between filter and sensor: a bright ring of some per cent of the light."""

    kind, most = "ghost_ring", 0.5

    @override
    def draw(self) -> None:
        y, x = self.camera.grid()
        down = y - self.camera.rows * self.chance.uniform(0.35, 0.65)
        right = x - self.camera.columns * self.chance.uniform(0.35, 0.65)
        away = np.hypot(down, right)
        self.pattern = np.exp(-0.5 * ((away - self.chance.uniform(10, 18)) / 1.8) ** 2)


class Scratch(FixedLight):
    """A scratched cover glass: a thin slanted line that lets less light through."""

    kind, most, sign = "scratch", 0.7, -1

    @override
    def draw(self) -> None:
        y, x = self.camera.grid()
        rows, columns = self.camera.rows, self.camera.columns
        angle = self.chance.uniform(0.4, 1.1)
        right = x - columns / 2
        away = right * np.cos(angle) + (y - rows / 2) * np.sin(angle)
        self.pattern = np.clip(1.2 - np.abs(away), 0, 1) * (np.abs(right) < columns * 0.3)


class MovingFringe(Unlisted):
    """Fringes of narrow-band light in the cover glass, steadily drifting, a share of the light."""

    kind, most = "moving_fringe", 0.2

    @override
    def draw(self) -> None:
        right = float(self.chance.uniform(0.02, 0.06))
        self.frequency = (right, float(self.chance.uniform(0.02, 0.06)))
        self.speed = float(self.chance.uniform(0.25, 0.9))

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        power = c.whole_frames * (size * c.whole_signal) ** 2 * self.camera.pixels / 2
        return float(np.sqrt(np.sum(power / c.whole_variance)))

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        y, x = self.camera.grid()
        moved = (self.speed * np.arange(len(light)))[:, None, None]
        across = self.frequency[0] * x + self.frequency[1] * y
        wave: Array = np.cos(2 * np.pi * across + moved)
        gains: Array = (1 + self.size * wave).astype(np.float32)
        return light * gains


class FieldFlicker(Unlisted):
    """Two interlaced fields whose light differs afresh in each frame, odd rows against even."""

    kind, most = "field_flicker", 0.1

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        power = size * size * c.whole_square * self.camera.pixels / 4 / c.whole_variance
        return of_wander(self.bench, power)

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        drawn = self.size * self.chance.normal(size=len(light)) / 2
        gains = drawn.astype(np.float32)[:, None, None]
        out = light.copy()
        out[:, ::2] *= 1 + gains
        out[:, 1::2] *= 1 - gains
        return out


class ShiftedFlatField(Unlisted):
    """Division by a flat taken with the lens elsewhere: dust spots, each with its negative twin."""

    kind, most = "shifted_flat_field", 0.5

    @override
    def draw(self) -> None:
        chance, (y, x) = self.chance, self.camera.grid()
        rows, columns = self.camera.rows, self.camera.columns
        pattern = np.zeros((rows, columns))
        down, right = chance.integers(6, 12, 2)
        for _ in range(5):
            at_y, at_x = chance.uniform(12, rows - 24), chance.uniform(12, columns - 24)
            width = chance.uniform(1.5, 3)
            here = (y - at_y) ** 2 + (x - at_x) ** 2
            there = (y - at_y - down) ** 2 + (x - at_x - right) ** 2
            pattern -= np.exp(-here / 2 / width**2)
            pattern += np.exp(-there / 2 / width**2)
        self.pattern = pattern

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, "gain")

    @override
    def filtered(self, volts: Array) -> Array:
        return volts * (1 + self.size * self.pattern).astype(np.float32)
