"""Offsets of lines that are new in each frame: white, persisting from row to row, one over f."""

from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.effect import Effect
from third.fixed_patterns import SQRT3
from third.strengths import deviance, of_wander

SPARE = 200  # samples beyond the rows, for a window that runs over them


class MovingLines(Effect):
    """One number a row or a column, normal or uniform, new in each frame."""

    order = 2
    by_row: ClassVar[bool] = True

    @override
    def z_of(self, size: float) -> float:
        camera = self.camera
        lines, along = camera.rows, camera.columns
        if not self.by_row:
            lines, along = along, lines
        return of_wander(self.bench, size * size * along / self.cells.whole_variance, lines - 1)

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        shape = (len(volts), self.camera.rows if self.by_row else self.camera.columns)
        if self.neighbouring:
            lines = self.chance.uniform(-1, 1, shape) * SQRT3
        else:
            lines = self.chance.normal(size=shape)
        lines = (self.size * lines).astype(np.float32)
        return volts + (lines[:, :, None] if self.by_row else lines[:, None, :])

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_dn": self.size}


class RowNoise(MovingLines):
    """Offsets of rows."""

    kind, group = "row_noise", "rowt"

    @override
    def leave_floor(self) -> None:
        self.bench.floors.row_noise = self.size


class ColumnNoise(MovingLines):
    """Offsets of columns."""

    kind, group, by_row = "column_noise", "colt", False

    @override
    def leave_floor(self) -> None:
        self.bench.floors.column_noise = self.size


class RowBanding(Effect):
    """Offsets of rows that forget exponentially; or noise of a reference, averaged over rows."""

    kind, group, order = "row_banding", "rowt", 2

    @override
    def draw(self) -> None:
        self.length = float(self.chance.uniform(3, 12))

    @override
    def z_of(self, size: float) -> float:
        c, rows, columns = self.cells, self.camera.rows, self.camera.columns
        wave = 2 * np.pi * np.arange(1, rows) / rows
        stays = np.exp(-1 / self.length)
        power = size * size * (1 - stays * stays) / (1 + stays * stays - 2 * stays * np.cos(wave))
        seen = [
            (frames - 1) * deviance(1 + power * columns / variance).sum()
            for frames, variance in zip(c.whole_frames, c.whole_variance, strict=True)
        ]
        return float(np.sqrt(sum(seen)))

    @override
    def leave_floor(self) -> None:
        self.bench.floors.row_noise = self.size * (2 * self.length) ** 0.5

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        rows = self.camera.rows
        white = self.chance.normal(size=(len(volts), rows + SPARE))
        if self.neighbouring:
            width = max(2, round(2 * self.length))
            window = np.ones(width) / width**0.5
            bands = np.array([np.convolve(row, window, "valid")[:rows] for row in white])
        else:
            stays = np.exp(-1 / self.length)
            bands, here = np.empty((len(volts), rows)), white[:, 0]
            for row in range(rows):
                here = stays * here + (1 - stays * stays) ** 0.5 * white[:, row + 1]
                bands[:, row] = here
        return volts + (self.size * bands).astype(np.float32)[:, :, None]

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_dn": self.size, "length_rows": self.length}


class PinkNoise(Effect):
    """Noise of one over f along the read-out of a frame; or of a power beside it."""

    kind, group, order = "pink_noise", "rowt", 2

    @override
    def draw(self) -> None:
        self.along = str(self.chance.choice(["rows", "rows", "columns"]))
        self.exponent = float(self.chance.choice([0.85, 1.2])) if self.neighbouring else 1.0

    def power(self) -> Array:
        """Return the shares of frequencies in the variance, of twice as many samples as pixels."""
        samples = 2 * self.camera.pixels
        frequency = np.arange(1, samples // 2 + 1) / samples
        power = frequency**-self.exponent
        return np.asarray(power / power.sum())

    @override
    def z_of(self, size: float) -> float:
        c, shares = self.cells, self.power()
        power = size * size * shares * self.camera.pixels
        places = np.unique(np.geomspace(1, len(shares), 400).astype(int)) - 1
        weight = np.gradient(places.astype(float))
        seen = [
            frames * (weight * deviance(1 + power[places] / variance)).sum()
            for frames, variance in zip(c.whole_frames - 1, c.whole_variance, strict=True)
        ]
        return float(np.sqrt(sum(seen)))

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        camera, frames = self.camera, len(volts)
        samples = 2 * camera.pixels
        amplitude = np.r_[0, np.sqrt(self.power())].astype(np.complex64)
        shape = (frames, samples // 2 + 1)
        real = self.chance.normal(size=shape)
        waves = (real + 1j * self.chance.normal(size=shape)) * amplitude / 2**0.5
        noise = np.fft.irfft(waves, samples, axis=1)[:, : camera.pixels] * samples / 2**0.5
        if self.along == "rows":
            noise = noise.reshape(frames, camera.rows, camera.columns)
        else:
            noise = noise.reshape(frames, camera.columns, camera.rows).transpose(0, 2, 1)
        return volts + (self.size * noise).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_dn": self.size, "along": self.along, "exponent": self.exponent}
