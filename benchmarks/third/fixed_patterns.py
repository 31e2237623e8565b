"""Fixed patterns of pixels, rows and columns: gains of the light, offsets of the read-out."""

from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from third.camera import Array, Exposure
from third.effect import Effect
from third.strengths import Growth, of_fixed_field

SQRT3 = 3**0.5  # makes the variance of a uniform law from -1 to 1 one


class Prnu(Effect):
    """Gains of pixels: normal, or uniform."""

    kind, group, order, most = "prnu", "gainpix", 0, 0.1

    @override
    def z_of(self, size: float) -> float:
        return of_fixed_field(self.bench, size, "gain")

    @override
    def leave_floor(self) -> None:
        self.bench.floors.pixel_gain = self.size

    @override
    def make_ready(self) -> None:
        shape = (self.camera.rows, self.camera.columns)
        if self.neighbouring:
            field = self.chance.uniform(-1, 1, shape) * SQRT3
        else:
            field = self.chance.normal(size=shape)
        self.gains = (1 + self.size * field).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_percent": 100 * self.size}

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        return light * self.gains


class Dsnu(Effect):
    """Offsets of pixels: normal, or of two exponential sides."""

    kind, group, order = "dsnu", "offpix", 0

    @override
    def z_of(self, size: float) -> float:
        return of_fixed_field(self.bench, size, "offset")

    @override
    def leave_floor(self) -> None:
        self.bench.floors.pixel_offset = self.size

    @override
    def make_ready(self) -> None:
        shape = (self.camera.rows, self.camera.columns)
        if self.neighbouring:
            field = self.chance.laplace(size=shape) / 2**0.5
        else:
            field = self.chance.normal(size=shape)
        self.offsets = (self.size * field).astype(np.float32)

    @override
    def parameters(self) -> dict[str, Any]:
        return {"sigma_dn": self.size}

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        return volts + self.offsets


class FixedLines(Effect):
    """One number a row or a column, normal or uniform, the same in all frames."""

    order = 1
    by_row: ClassVar[bool] = True
    grows: ClassVar[Growth] = "offset"

    @override
    def z_of(self, size: float) -> float:
        together = self.camera.columns if self.by_row else self.camera.rows
        return of_fixed_field(self.bench, size, self.grows, together)

    @override
    def make_ready(self) -> None:
        count = self.camera.rows if self.by_row else self.camera.columns
        if self.neighbouring:
            lines = self.chance.uniform(-1, 1, count) * SQRT3
        else:
            lines = self.chance.normal(size=count)
        shape = (-1, 1) if self.by_row else (1, -1)
        self.lines = (self.size * lines).astype(np.float32).reshape(shape)

    @override
    def parameters(self) -> dict[str, Any]:
        if self.grows == "offset":
            return {"sigma_dn": self.size}
        return {"sigma_percent": 100 * self.size}

    @override
    def lit(self, light: Array, exposure: Exposure) -> Array:
        return light * (1 + self.lines) if self.grows == "gain" else light

    @override
    def read_out(self, volts: Array, exposure: Exposure) -> Array:
        return volts + self.lines if self.grows == "offset" else volts


class RowFpn(FixedLines):
    """Offsets of rows."""

    kind, group = "row_fpn", "rowfix"


class ColumnFpn(FixedLines):
    """Offsets of columns."""

    kind, group, by_row = "column_fpn", "colfix", False


class RowPrnu(FixedLines):
    """Gains of rows."""

    kind, group, grows, most = "row_prnu", "rowfix", "gain", 0.1


class ColumnPrnu(FixedLines):
    """Gains of columns."""

    kind, group, grows, most, by_row = "column_prnu", "colfix", "gain", 0.1, False
