"""A raster over the plan that tells a ray which solids it may meet."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.city.solids import COS, HALF_X, HALF_Y, SIN, TOP, X, Y

CEILING_M = 150.0  # nothing is taller; the same for every part of the city, so that all round alike


class Cells(NamedTuple):
    """Square cells; cell (i, j) holds items[starts[i n + j]:starts[i n + j + 1]].

    Attributes
    ----------
    reach_m
        The raster covers -reach_m..reach_m in x and y.
    size_m
        Side of a cell.
    across
        n, cells along a side.
    tops
        Height of the tallest solid in each cell, metres: float64 (n, n); no solid: -1.
    ceiling_m
        Nothing is taller.
    """

    reach_m: float
    size_m: float
    across: int
    starts: NDArray[np.int64]
    items: NDArray[np.int64]
    tops: NDArray[np.float64]
    ceiling_m: float


def sort_into_cells(table: NDArray[np.float64], reach_m: float, size_m: float) -> Cells:
    """Enter each solid in every cell that its bounding box touches, in the table's order."""
    count = int(np.ceil(2 * reach_m / size_m))
    wide = np.abs(table[:, COS]) * table[:, HALF_X] + np.abs(table[:, SIN]) * table[:, HALF_Y]
    deep = np.abs(table[:, SIN]) * table[:, HALF_X] + np.abs(table[:, COS]) * table[:, HALF_Y]

    def cell(place: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.clip((place + reach_m) // size_m, 0, count - 1).astype(np.int64)

    margin = 1e-6
    x0, x1 = cell(table[:, X] - wide - margin), cell(table[:, X] + wide + margin)
    y0, y1 = cell(table[:, Y] - deep - margin), cell(table[:, Y] + deep + margin)
    across, along = x1 - x0 + 1, y1 - y0 + 1
    each = across * along
    item = np.repeat(np.arange(len(table)), each)
    nth = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    where = (x0[item] + nth // along[item]) * count + y0[item] + nth % along[item]
    order = np.argsort(where, kind="stable")
    starts = np.searchsorted(where[order], np.arange(count * count + 1))
    tops = np.full(count * count, -1.0)
    np.maximum.at(tops, where, table[item, TOP])
    return Cells(
        reach_m, size_m, count, starts.astype(np.int64), item[order].astype(np.int64),
        tops.reshape(count, count), CEILING_M,
    )  # fmt: skip
