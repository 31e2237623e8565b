"""Laws of single pixels' read noise: heavy tails, unlike pixels, jumps."""

from typing import Any

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.drawing import log_uniform
from third.effect import Effect
from third.strengths import EXPONENTIAL, deviance


class HeavyTailedReadNoise(Effect):
    """Read noise of Student's law; or of an amplifier that is noisier in a twentieth of samples.

    The size is the excess kurtosis.
    """

    kind, group, least, most = "heavy_tailed_read_noise", "tails", 0.05, 6.0

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        seen = c.pixels * (c.frames - 1) * (size * c.read_share**2) ** 2 / 24
        return float(np.sqrt(np.sum(seen)))

    @override
    def read_noise(self, shape: tuple[int, ...]) -> Array | None:
        if self.neighbouring:  # kurtosis of a mixture: 3 p (1 - p) (k - 1)^2 / (1 + p (k - 1))^2
            often = 0.05
            more = min(np.sqrt(self.size / 3 / (often * (1 - often))), 0.9 / often)
            ratio = 1 + more / (1 - often * more)
            noise = self.chance.normal(size=shape)
            noisy = np.where(self.chance.random(shape) < often, ratio**0.5, 1)
            noise = noise * noisy / (1 + often * (ratio - 1)) ** 0.5
        else:
            freedom = 4 + 6 / self.size
            noise = self.chance.standard_t(freedom, shape) * np.sqrt((freedom - 2) / freedom)
        return np.asarray(noise, np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"excess_kurtosis": self.size, "tail_df": 4 + 6 / self.size}


class ReadNoiseSpread(Effect):
    """Pixels of unlike read noise: log-normal, or of gamma variances with the same spread."""

    kind, group, most = "read_noise_spread", "tails", 0.6

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        seen = np.sum((c.whole_frames - 1) * c.whole_read_share**2)
        spread = deviance(1 + np.expm1(4 * size * size) * seen / 2)
        return float(np.sqrt(self.camera.pixels * spread))

    @override
    def make_ready(self) -> None:
        shape = (self.camera.rows, self.camera.columns)
        spread = np.expm1(4 * self.size**2)
        if self.neighbouring:
            variances = self.chance.gamma(1 / spread, spread, shape)
        else:
            field = self.chance.normal(size=shape)
            variances = np.exp(2 * self.size * field - 2 * self.size**2)
        self.ratios = np.sqrt(variances).astype(np.float32)

    @override
    def read_noise(self, shape: tuple[int, ...]) -> Array | None:
        return self.chance.normal(size=shape).astype(np.float32) * self.ratios

    @override
    def parameters(self) -> dict[str, Any]:
        return {"log_sigma": self.size}


class Rts(Effect):
    """Few pixels that jump between two levels: equal shares; or shares and heights of their own."""

    kind, group = "rts", "tails"

    @override
    def draw(self) -> None:
        self.share = log_uniform(self.chance, 0.003, 0.03)
        self.switching = float(self.chance.uniform(0.08, 0.45))
        self.levels = str(self.chance.choice(["about", "about", "above"]))

    @override
    def camera_fits(self) -> bool:
        return bool(self.cells.whole_frames.max() >= 6)

    @override
    def size_fits(self) -> bool:
        return self.size < 0.1 * self.camera.full

    @override
    def z_of(self, size: float) -> float:
        c, heights = self.cells, EXPONENTIAL * size
        seen = sum(
            (frames - 1) * deviance(1 + heights * heights / 4 / variance)
            for frames, variance in zip(c.whole_frames, c.whole_variance, strict=True)
        )
        sure = np.maximum(0, seen - 2 * np.log(1 / self.share)).mean()
        return float(np.sqrt(self.camera.pixels * self.share * sure))

    @override
    def make_ready(self) -> None:
        chance, shape = self.chance, (self.camera.rows, self.camera.columns)
        self.pixels = np.argwhere(chance.random(shape) < self.share)
        count = len(self.pixels)
        if self.neighbouring:
            self.heights = chance.lognormal(-0.25, 0.7, count) * self.size
            self.duty = chance.uniform(0.25, 0.75, count)
        else:
            self.heights = chance.exponential(size=count) * self.size
            self.duty = np.full(count, 0.5)
        self.up = chance.random(count) < self.duty

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        out, (y, x) = volts.copy(), self.pixels.T
        base = 0.5 if self.levels == "about" else 0
        for frame in out:
            drawn = self.chance.random(len(self.up)) < 2 * self.switching
            self.up = np.where(drawn, self.chance.random(len(self.up)) < self.duty, self.up)
            frame[y, x] += self.heights * (self.up - base)
        return out

    @override
    def parameters(self) -> dict[str, Any]:
        sizes = {"pixel_fraction": self.share, "amplitude_dn": self.size}
        return {**sizes, "switch_probability": self.switching, "levels": self.levels}
