"""Physics of the read-out and of the camera's own processing that is on no list."""

import numpy as np
from scipy.fft import dctn, idctn
from typing_extensions import override

from third.camera import Array, Exposure
from third.strengths import of_neighbours
from third.unlisted_light import Unlisted

STRUCK = 3  # exposures with a burst, or with a frame that came twice


class WarmingReadNoise(Unlisted):
    """The amplifier warms up during each exposure: read noise grows from frame to frame."""

    kind, most = "warming_read_noise", 1.5

    @override
    def camera_fits(self) -> bool:
        return bool(self.cells.whole_frames.max() >= 6)

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        growth = (2 * size * c.read_share) ** 2
        return float(np.sqrt(np.sum(c.pixels * np.maximum(c.frames - 1, 0) * growth / 12 / 2)))

    @override
    def read_noise(self, shape: tuple[int, ...]) -> Array | None:
        time = np.linspace(-0.5, 0.5, shape[0])
        variance = np.maximum(1 + 2 * self.size * time, 0.05)
        noise = self.chance.normal(size=shape).astype(np.float32)
        return noise * np.sqrt(variance).astype(np.float32)[:, None, None]


class EmiBurst(Unlisted):
    """A switching supply strikes: ringing in some rows of a frame of up to three exposures."""

    kind = "emi_burst"

    @override
    def draw(self) -> None:
        self.frequency = self.chance.uniform(0.15, 0.4)
        self.struck_rows = int(self.chance.integers(5, 12))

    @override
    def make_ready(self) -> None:
        frames = [exposure.frames for exposure in self.camera.exposures]
        long = [i for i, count in enumerate(frames) if count >= 4]
        struck = self.chance.choice(long, min(STRUCK, len(long)), replace=False)
        self.frame = {int(i): int(self.chance.integers(frames[int(i)])) for i in struck}

    @override
    def z_of(self, size: float) -> float:
        power = STRUCK * self.struck_rows * self.camera.columns / 2
        return float(size * np.sqrt(power / np.mean(self.cells.whole_variance)))

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        number = self.camera.exposures.index(exposure)
        if number not in self.frame:
            return volts
        out, rows, columns = volts.copy(), self.struck_rows, self.camera.columns
        first = int(self.chance.integers(0, self.camera.rows - rows))
        x = np.arange(columns)
        for row in range(rows):
            angle = 2 * np.pi * self.frequency * (x + columns * row)
            ringing = self.size * np.sin(angle + self.chance.uniform(0, 0.5))
            fading = np.exp(-(((row - rows / 2) / (rows / 2.5)) ** 2))
            out[self.frame[number], first + row] += (ringing * fading).astype(np.float32)
        return out


class RepeatedFrame(Unlisted):
    """The grabber lost frames and delivered the one before once more."""

    kind, sized = "repeated_frame", False

    @override
    def camera_fits(self) -> bool:
        return bool(self.cells.whole_frames.max() >= 5)

    @override
    def z_of(self, size: float) -> float:
        return float(np.sqrt(3 * self.camera.pixels))

    @override
    def make_ready(self) -> None:
        long = [i for i, exposure in enumerate(self.camera.exposures) if exposure.frames >= 5]
        struck = self.chance.choice(long, min(STRUCK, len(long)), replace=False)
        self.struck = [int(i) for i in struck]

    @override
    def delivered(self, codes: Array, exposure: Exposure) -> Array:
        out = codes.copy()
        if self.camera.exposures.index(exposure) in self.struck:
            frame = int(self.chance.integers(1, len(out)))
            out[frame] = out[frame - 1]
        return out


class BlockCompression(Unlisted):
    """Blocks of 8 x 8 went through a cosine transform with coarse high frequencies."""

    kind, least, most = "block_compression", 0.2, 50.0

    @override
    def camera_fits(self) -> bool:
        return not self.camera.mosaic

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        step = size * np.sqrt(np.median(c.whole_variance))
        lost = np.minimum(step * step / 12 / c.whole_variance, 0.8)
        return float(np.sqrt(np.sum(c.whole_frames * self.camera.pixels * 0.5 * lost**2 / 2)))

    @override
    def filtered(self, volts: Array) -> Array:
        step = self.size * np.sqrt(np.median(self.cells.whole_variance))
        down, right = self.camera.rows // 8, self.camera.columns // 8
        out = volts.copy()
        blocks = out[:, : 8 * down, : 8 * right].reshape(-1, down, 8, right, 8)
        waves = dctn(blocks, axes=(2, 4), norm="ortho")
        number = np.arange(8)
        high = (number[:, None] + number[None] >= 6)[:, None, :]
        waves = np.where(high[None, None], np.round(waves / step) * step, waves)
        back = idctn(waves, axes=(2, 4), norm="ortho")
        out[:, : 8 * down, : 8 * right] = back.reshape(-1, 8 * down, 8 * right)
        return out


class StuckBit(Unlisted):
    """One converter of a bank of 16 has bit 1 stuck high."""

    kind, sized = "stuck_bit", False

    @override
    def camera_fits(self) -> bool:
        return self.camera.low.intercept > 0.8

    @override
    def z_of(self, size: float) -> float:
        samples = np.sum(self.cells.pixels * self.cells.frames)
        return float(np.sqrt(2 * samples / 16 * np.log(2)))

    @override
    def delivered(self, codes: Array, exposure: Exposure) -> Array:
        out = codes.copy()
        out[:, :, 5::16] |= 2
        return out


class TemporalFilter(Unlisted):
    """Recursive noise reduction over frames: shot and read noise alike, slowly fading."""

    kind, most = "temporal_filter", 0.5

    @override
    def camera_fits(self) -> bool:
        return self.cells.whole_frames.max() >= 8 and not self.camera.count("scene")

    @override
    def z_of(self, size: float) -> float:
        return of_neighbours(self.bench, size * self.cells.read_share)  # image_lag leaves it

    @override
    def filtered(self, volts: Array) -> Array:
        half = (self.camera.rows // 2, self.camera.columns // 2)
        sites = volts.mean(0).reshape(half[0], 2, half[1], 2).mean((0, 2))
        mean = np.tile(sites, half).astype(np.float32)
        kept, new = np.float32(self.size), np.float32(1 - self.size)
        out = volts.copy()
        settled = np.float32(np.sqrt((1 - self.size) / (1 + self.size)))
        out[0] = mean + (volts[0] - mean) * settled
        for frame in range(1, len(volts)):
            out[frame] = kept * out[frame - 1] + new * volts[frame]
        return out
