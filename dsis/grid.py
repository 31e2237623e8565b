"""Which pixels of a sensor an array holds: size, place on the sensor, channels."""

from dataclasses import dataclass

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
    """

    rows: int
    columns: int
    cfa: Cfa | None = None
    first_row: int = 0
    first_column: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of an array on this grid."""
        return (self.rows, self.columns) if self.cfa else (self.rows, self.columns, 3)

    def channels(self) -> NDArray[np.uint8]:
        """Return the channel at (row parity, column parity, plane): uint8 (2, 2, planes)."""
        if self.cfa is None:
            return np.broadcast_to(np.arange(3, dtype=np.uint8), (2, 2, 3)).copy()
        return pattern(self.cfa)[:, :, np.newaxis].copy()
