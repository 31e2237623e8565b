"""Effects on light that stay: fall-off, smooth gains, the two greens; what grows in the dark."""

from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.drawing import log_uniform
from third.effect import Effect, has_two_times
from third.strengths import EXPONENTIAL, deviance, of_known_pattern

PLACES = [
    *("top_left", "top_right", "bottom_left", "bottom_right"),
    *("top", "bottom", "left", "right"),
]


class Shading(Effect):
    """A fall with the square of the distance and at times a tilt; or cos^4 of a lens off axis."""

    kind, group, most = "shading", "smooth", 0.6

    @override
    def draw(self) -> None:
        camera, chance = self.camera, self.chance
        rows, columns = camera.rows, camera.columns
        y, x = camera.grid()
        down, right = y - (rows - 1) / 2, x - (columns - 1) / 2
        corner = np.hypot(rows, columns) / 2
        if self.neighbouring:
            off_y, off_x = chance.uniform(-0.25, 0.25, 2)
            square = ((y - (0.5 + off_y) * rows) ** 2 + (x - (0.5 + off_x) * columns) ** 2) / (
                corner**2
            )
            wide = 0.5
            self.pattern: Array = -(1 - (1 + wide * square) ** -2) / (2 * wide)
        else:
            self.tilts = chance.uniform(-0.7, 0.7, 2) if chance.random() < 0.4 else np.zeros(2)
            v, u = down / (rows / 2), right / (columns / 2)
            fall = (down**2 + right**2) / corner**2
            self.pattern = -fall + self.tilts[0] * v + self.tilts[1] * u

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, "gain")

    @override
    def parameters(self) -> dict[str, Any]:
        tilts = None if self.neighbouring else [100 * self.size * float(t) for t in self.tilts]
        return {"falloff_percent": 100 * self.size, "tilts_percent": tilts}

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        return light * (1 + self.size * self.pattern).astype(np.float32)


class SmoothPrnu(Effect):
    """Gains whose correlation falls exponentially with distance, or as a bell."""

    kind, group, most = "smooth_prnu", "smooth", 0.08

    @override
    def draw(self) -> None:
        self.length = float(self.chance.uniform(1.5, 7))
        self.spectrum = self._spectrum()

    def _spectrum(self) -> Array:
        rows, columns = 2 * self.camera.rows, 2 * self.camera.columns
        y = np.minimum(np.arange(rows), rows - np.arange(rows))[:, None]
        x = np.minimum(np.arange(columns), columns - np.arange(columns))[None]
        apart = np.hypot(y, x)
        if self.neighbouring:
            alike = np.exp(-((apart / (1.5 * self.length)) ** 2))
        else:
            alike = np.exp(-apart / self.length)
        return np.maximum(np.fft.fft2(alike).real, 0)

    @override
    def z_of(self, size: float) -> float:
        c, power = self.cells, self.spectrum[::2, ::2]
        information = np.sum(c.whole_frames * c.whole_square / c.whole_variance)
        noise = 1 / information + self.bench.floors.pixel_gain**2
        return float(np.sqrt(deviance(1 + size * size * power.ravel()[1:] / noise).sum()))

    @override
    def make_ready(self) -> None:
        camera = self.camera
        white = self.chance.normal(size=(2 * camera.rows, 2 * camera.columns))
        field = np.fft.ifft2(np.fft.fft2(white) * np.sqrt(self.spectrum)).real
        field = field[: camera.rows, : camera.columns]
        self.gains: Array = (1 + self.size * (field - field.mean())).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_percent": 100 * self.size, "length_pixels": self.length}

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        return light * self.gains


class ChannelImbalance(Effect):
    """The greens of rows with red against those of rows with blue."""

    kind, group, most, has_neighbour = "channel_imbalance", "parity", 0.1, False
    needs: ClassVar[dict[str, Any]] = {"mosaic": True}
    also_right = ("tap_mismatch",)

    @override
    def draw(self) -> None:
        cfa, pattern = self.camera.cfa, np.zeros((2, 2))
        for row in (0, 1):
            pair = cfa[2 * row : 2 * row + 2]
            pattern[row, pair.index("G")] = 0.5 if "R" in pair else -0.5
        self.pattern = np.tile(pattern, (self.camera.rows // 2, self.camera.columns // 2))
        self.sign = float(self.chance.choice([-1, 1]))

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, "gain")

    @override
    def parameters(self) -> dict[str, Any]:
        return {"gain_percent": 100 * self.size * self.sign}

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        return light * (1 + self.sign * self.size * self.pattern).astype(np.float32)


class AmpGlow(Effect):
    """Light of an amplifier from a side or a corner: it falls exponentially, or as a square."""

    kind, group = "amp_glow", "smooth"

    @override
    def draw(self) -> None:
        y, x = self.camera.grid()
        rows, columns = self.camera.rows, self.camera.columns
        self.place = str(self.chance.choice(PLACES))
        down = y if "top" in self.place else rows - 1 - y if "bottom" in self.place else 0 * y
        right = x if "left" in self.place else columns - 1 - x if "right" in self.place else 0 * x
        self.extent = float(self.chance.uniform(0.1, 0.4))
        away = np.hypot(down, right) / (self.extent * max(rows, columns))
        self.pattern: Array = 1 / (1 + away * 1.2) ** 2 if self.neighbouring else np.exp(-away)

    @override
    def camera_fits(self) -> bool:
        return has_two_times(self.bench)

    @override
    def z_of(self, size: float) -> float:
        return of_known_pattern(self.bench, size, self.pattern, "time")

    @override
    def warmed(self, light: Array, exposure: Exposure) -> Array:
        return light + (self.size * exposure.time_s * self.pattern).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"dn_per_s": self.size, "place": self.place, "extent": self.extent}


class DarkCurrent(Effect):
    """The same rate in all pixels."""

    kind, group, has_neighbour = "dark_current", "timelevel", False

    @override
    def camera_fits(self) -> bool:
        return has_two_times(self.bench)

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        pixels, frames, times = c.pixels[c.dark], c.frames[c.dark], c.time[c.dark]
        wander = self.bench.floors.frame_offset**2 / frames
        weight = 1 / (c.variance[c.dark] / (pixels * frames) + wander)
        mean = (weight * times).sum() / weight.sum()
        return float(size * np.sqrt((weight * (times - mean) ** 2).sum()))

    @override
    def warmed(self, light: Array, exposure: Exposure) -> Array:
        return light + np.float32(self.size * exposure.time_s)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"dn_per_s": self.size}


class HotPixels(Effect):
    """Few pixels with a dark current of their own: exponential, or log-normal."""

    kind, group = "hot_pixels", "hot"

    @override
    def draw(self) -> None:
        self.share = log_uniform(self.chance, 0.002, 0.02)

    @override
    def camera_fits(self) -> bool:
        return has_two_times(self.bench)

    @override
    def z_of(self, size: float) -> float:
        c, floors = self.cells, self.bench.floors
        fixed = floors.pixel_offset**2 + floors.pixel_gain**2 * c.whole_square
        noise = c.whole_variance + c.whole_frames * fixed / 3
        information = np.sum(c.whole_frames * c.whole_time**2 / noise)
        heights = EXPONENTIAL * size
        seen = np.maximum(0, heights * heights * information - 2 * np.log(1 / self.share))
        return float(np.sqrt(self.camera.pixels * self.share * seen.mean()))

    @override
    def make_ready(self) -> None:
        shape = (self.camera.rows, self.camera.columns)
        hot = self.chance.random(shape) < self.share
        if self.neighbouring:
            rates = self.chance.lognormal(-0.5, 1.0, shape)
        else:
            rates = self.chance.exponential(size=shape)
        self.rates: Array = (hot * rates * self.size).astype(np.float32)

    @override
    def warmed(self, light: Array, exposure: Exposure) -> Array:
        return light + self.rates * np.float32(exposure.time_s)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"pixel_fraction": self.share, "mean_dn_per_s": self.size}
