"""What samples share: memory of the read-out and of the converter, a filter of one colour."""

from typing import Any

import numpy as np
from scipy.special import ndtri
from typing_extensions import override

from third.camera import Array
from third.charge import apart, curvature, exchanged
from third.effect import Effect
from third.strengths import QUANTILES, of_neighbours


class ReadoutMemory(Effect):
    """A share of the noise of a sample read before; or a second echo of it as well."""

    kind, group, most = "readout_memory", "corr", 0.35

    @override
    def draw(self) -> None:
        self.lag = int(self.chance.choice([1, 2, 2, 3, 4, 8]))
        self.along = str(self.chance.choice(["rows", "rows", "columns"]))
        self.sign = float(self.chance.choice([-1, 1]))
        self.neighbouring = self.neighbouring and self.lag <= 2

    @override
    def z_of(self, size: float) -> float:
        return of_neighbours(self.bench, size / (1 + size * size))

    @override
    def remembered(self, volts: Array, expected: Array) -> Array:
        noise, axis, out = volts - expected, 2 if self.along == "rows" else 1, volts.copy()
        before, here = apart(axis, self.lag)
        out[here] += np.float32(self.sign * self.size) * noise[before]
        if self.neighbouring:
            before, here = apart(axis, 2 * self.lag)
            out[here] += np.float32(self.size**2) * noise[before]
        return out

    @override
    def parameters(self) -> dict[str, Any]:
        fraction = self.sign * self.size
        return {"fraction": fraction, "lag_pixels": self.lag, "along": self.along}


class AdcMemory(Effect):
    """What the converter's last stage kept of the sample before, by its place in a period."""

    kind, group, has_neighbour = "adc_memory", "corr", False
    most = 60.0

    @override
    def draw(self) -> None:
        c, chance = self.cells, self.chance
        self.period = int(2 ** chance.integers(4, max(5, self.camera.bits - 4)))
        self.at = float(chance.integers(0, self.period))
        self.sign = float(chance.choice([-1, 1]))
        noise = np.sqrt(c.variance)[:, None] * ndtri(QUANTILES)[None]
        codes = c.signal[:, None] + noise + self.camera.black - self.at
        self.spread = np.mod(codes / self.period, 1).var(1)

    @override
    def size_fits(self) -> bool:
        return self.size < self.period / 2

    @override
    def z_of(self, size: float) -> float:
        c = self.cells
        seen = c.pixels * (c.frames - 1) * size * size * self.spread / c.variance
        return float(np.sqrt(np.sum(seen)))

    @override
    def remembered(self, volts: Array, expected: Array) -> Array:
        out, step = volts.copy(), np.float32(self.sign * self.size)
        out[:, :, 1:] += step * self._residue(volts[:, :, :-1])
        out[:, 1:, 0] += step * self._residue(volts[:, :-1, -1])
        return out

    def _residue(self, volts: Array) -> Array:
        codes = volts + np.float32(self.camera.black - self.at)
        return np.asarray(np.mod(codes / np.float32(self.period), 1) - np.float32(0.5))

    @override
    def parameters(self) -> dict[str, Any]:
        step = self.sign * self.size
        return {"step_dn": step, "period_codes": self.period, "at_code": self.at}


class SpatialFiltering(Effect):
    """A filter of sites of one colour; or, along both axes, one that reaches diagonals."""

    kind, group, most = "spatial_filtering", "corr", 0.15

    @override
    def draw(self) -> None:
        self.along = str(self.chance.choice(["both", "both", "rows", "columns"]))
        self.neighbouring = self.neighbouring and self.along == "both"
        self.diagonal = 0.4 if self.neighbouring else 0.0

    @override
    def z_of(self, size: float) -> float:
        return of_neighbours(self.bench, *exchanged(size, self.along))

    @override
    def filtered(self, volts: Array) -> Array:
        out, step = volts.copy(), 2 if self.camera.mosaic else 1
        for row in range(step):
            for column in range(step):
                out[:, row::step, column::step] = self._one(volts[:, row::step, column::step])
        return out

    def _one(self, plane: Array) -> Array:
        down, right = float(self.along != "rows"), float(self.along != "columns")
        out: Array = plane + np.float32(self.size) * curvature(plane, down, right)
        if self.diagonal:
            share = np.float32(self.diagonal * self.size)
            falling = share * (plane[:, 1:, 1:] - plane[:, :-1, :-1])
            out[:, :-1, :-1] += falling
            out[:, 1:, 1:] -= falling
            rising = share * (plane[:, 1:, :-1] - plane[:, :-1, 1:])
            out[:, :-1, 1:] += rising
            out[:, 1:, :-1] -= rising
        return out

    @override
    def parameters(self) -> dict[str, Any]:
        return {"fraction": self.size, "along": self.along, "diagonal": self.diagonal}
