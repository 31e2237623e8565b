"""Effects of amplifiers and read-out paths on the mean: taps, settling, a second gain."""

from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from third.camera import Array
from third.effect import Effect
from third.strengths import Growth, of_bent_levels, of_known_pattern


class TapMismatch(Effect):
    """Two amplifiers of unlike gain: halves with a seam, or even and odd lines of a grey camera."""

    kind, group, most, has_neighbour = "tap_mismatch", "parity", 0.1, False

    @override
    def draw(self) -> None:
        camera, chance = self.camera, self.chance
        rows, columns = camera.rows, camera.columns
        alternating = [] if camera.mosaic else ["even_odd_columns", "even_odd_rows"]
        self.regions = str(chance.choice(["left_right", "top_bottom", *alternating]))
        self.seam = 0.5
        if "_odd" not in self.regions:
            self.seam = float(chance.choice([0.5, 0.5, chance.uniform(0.25, 0.75)]))
        y, x = np.mgrid[0:rows, 0:columns]
        second = {
            "left_right": x >= round(self.seam * columns),
            "top_bottom": y >= round(self.seam * rows),
            "even_odd_columns": x % 2 == 1,
            "even_odd_rows": y % 2 == 1,
        }[self.regions]
        self.pattern: Array = np.where(second, 1 - second.mean(), -second.mean())
        self.sign = float(chance.choice([-1, 1]))

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, "gain")

    @override
    def amplified(self, charge: Array) -> Array:
        return charge * (1 + self.sign * self.size * self.pattern).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        gain = 100 * self.size * self.sign
        return {"gain_percent": gain, "regions": self.regions, "seam": self.seam}


class LineSettling(Effect):
    """Lines or frames that begin off: it fades exponentially, or as 1 / d^2."""

    kind, group = "line_settling", "smooth"

    @override
    def draw(self) -> None:
        camera, chance = self.camera, self.chance
        self.edge = str(chance.choice(["left", "right", "top", "bottom"]))
        self.length = float(chance.uniform(2, 15))
        y, x = camera.grid()
        away = {
            "left": x,
            "right": camera.columns - 1 - x,
            "top": y,
            "bottom": camera.rows - 1 - y,
        }[self.edge] / self.length
        self.pattern: Array = 1 / (1 + away) ** 2 if self.neighbouring else np.exp(-away)
        self.grows: Growth = "offset" if str(chance.choice(["off", "gain"])) == "off" else "gain"
        self.sign = float(chance.choice([-1, 1]))

    @override
    def size_fits(self) -> bool:
        return self.grows == "offset" or self.size < 0.3

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, self.grows)

    @override
    def amplified(self, charge: Array) -> Array:
        settling: Array = (self.sign * self.size * self.pattern).astype(np.float32)
        return charge + settling * (1 if self.grows == "offset" else charge)

    @override
    def parameters(self) -> dict[str, Any]:
        name = "offset_dn" if self.grows == "offset" else "gain"
        return {name: self.size * self.sign, "length_pixels": self.length, "edge": self.edge}


class DualGain(Effect):
    """A second read-out path that camera.toml does not know."""

    kind, group, sized, has_neighbour = "dual_gain", "seg", False, False
    needs: ClassVar[dict[str, Any]] = {"segments": 2}

    @override
    def camera_fits(self) -> bool:
        below, above = levels_beside_switch(self)
        return below >= 2 and above >= 2 and 10 < self.z_of(0) < 400

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        freedom = c.pixels * (c.frames - 1)
        weight = freedom / (2 * c.variance**2)
        line = c.variance
        for _ in range(5):
            design = np.array([np.ones_like(c.signal), c.signal]).T * np.sqrt(weight)[:, None]
            found, *_ = np.linalg.lstsq(design, c.variance * np.sqrt(weight), rcond=None)
            line = np.maximum(found[0] + found[1] * c.signal, 0.2 * c.variance)
            weight = freedom / (2 * line**2)
        return float(np.sqrt(np.sum(weight * (c.variance - line) ** 2)))

    @override
    def parameters(self) -> dict[str, Any]:
        return {"switch_dn": self.camera.switch_dn}


class DualGainMismatch(Effect):
    """A second read-out path of another gain: the mean steps or kinks where it takes over."""

    kind, group, most, has_neighbour = "dual_gain_mismatch", "mean", 0.1, False
    needs: ClassVar[dict[str, Any]] = {"segments": 2}

    @override
    def camera_fits(self) -> bool:
        below, above = levels_beside_switch(self)
        return self.camera.light_known and below >= 3 and above >= 3

    @override
    def draw(self) -> None:
        self.mean = str(self.chance.choice(["steps", "kinks"]))
        self.sign = float(self.chance.choice([-1, 1]))
        self.switch = self.camera.switch_dn or 0.0
        self.knee = self.switch if self.mean == "kinks" else 0

    @override
    def z_of(self, size: float) -> float:
        signal = self.cells.signal
        error = np.where(signal >= self.switch, size * (signal - self.knee), 0)
        return of_bent_levels(self.bench, error)

    @override
    def switched(self, volts: Array, light: Array) -> Array:
        gain = self.sign * self.size
        other = volts * (1 + gain) - gain * self.knee
        return np.where(light >= self.switch, other, volts).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"gain_error_percent": 100 * self.size * self.sign, "mean": self.mean}


def levels_beside_switch(effect: Effect) -> tuple[int, int]:
    """Return how many flats have a level below the switch, and above it."""
    c, switch = effect.cells, effect.camera.switch_dn or 0.0
    below, above = c.signal < switch, c.signal >= switch
    return len(set(c.exposure[~c.dark & below])), len(set(c.exposure[~c.dark & above]))
