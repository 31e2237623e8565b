"""Which pixels of a sensor an array holds: size, place on the sensor, channels."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa, pattern


@dataclass(frozen=True)
class PixelGrid:
    """The pixels that an array (row, column) or (row, column, 3) stands for.

    Attributes
    ----------
    rows, columns
        Size in pixels.
    cfa
        Colour filter array of a mosaic (row, column), by absolute sensor row and column; None for
        three full planes (row, column, 3): a camera with a sensor behind each filter.
    first_row, first_column
        Where the array lies on the sensor. A crop of a noisy frame is the noisy crop.
    sensor_rows, sensor_columns
        Size of the whole sensor, which shading and read-out order depend on; None: the sensor ends
        where the array ends.
    """

    rows: int
    columns: int
    cfa: Cfa | None = None
    first_row: int = 0
    first_column: int = 0
    sensor_rows: int | None = None
    sensor_columns: int | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of an array on this grid."""
        return (self.rows, self.columns) if self.cfa else (self.rows, self.columns, 3)

    @property
    def sensor_shape(self) -> tuple[int, int]:
        """Rows and columns of the whole sensor."""
        rows = self.sensor_rows or self.first_row + self.rows
        return rows, self.sensor_columns or self.first_column + self.columns

    def block(self, first: int, last: int) -> "PixelGrid":
        """Return the grid of the rows first..last-1 of this array, on the same sensor."""
        rows, columns = self.sensor_shape
        return replace(
            self,
            rows=last - first,
            first_row=self.first_row + first,
            sensor_rows=rows,
            sensor_columns=columns,
        )

    def row_numbers(self) -> NDArray[np.int64]:
        """Return the sensor row of each row of the array, ready to broadcast: (rows, 1[, 1])."""
        numbers = np.arange(self.first_row, self.first_row + self.rows)
        return numbers.reshape(-1, *(1,) * (len(self.shape) - 1))

    def column_numbers(self) -> NDArray[np.int64]:
        """Return the sensor column of each column, ready to broadcast: (1, columns[, 1])."""
        numbers = np.arange(self.first_column, self.first_column + self.columns)
        return numbers.reshape(1, -1, *(1,) * (len(self.shape) - 2))

    def channels(self) -> NDArray[np.uint8]:
        """Return the channel at (row parity, column parity, plane): uint8 (2, 2, planes)."""
        if self.cfa is None:
            return np.broadcast_to(np.arange(3, dtype=np.uint8), (2, 2, 3)).copy()
        return pattern(self.cfa)[:, :, np.newaxis].copy()
