"""An exposure that is to be simulated: its plan and its clean signal."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dsis.effects import Image
from dsis.grid import PixelGrid
from dsis.recording import ExposurePlan


@dataclass(frozen=True)
class Shot:
    """One exposure of a simulated recording.

    Attributes
    ----------
    plan
        Name, kind, exposure time, number of frames, light.
    clean
        Gives the clean signal on a grid when the exposure's turn comes: float32 (row, column), DN
        above black, before all effects.
    """

    plan: ExposurePlan
    clean: Callable[[PixelGrid], Image]


def flat(
    name: str,
    signal_dn: ArrayLike,
    *,
    frames: int,
    exposure_time_s: float,
    light: float | None = None,
) -> Shot:
    """Return an exposure to uniform light.

    `signal_dn` is the clean signal, DN above black: one number, or a number for each of rows 0, 1
    and columns 0, 1 (array (2, 2)).
    """
    plan = ExposurePlan(name, "flat", exposure_time_s, frames, light)
    return Shot(plan, lambda grid: tiled(np.asarray(signal_dn), grid))


def dark(name: str, *, frames: int, exposure_time_s: float) -> Shot:
    """Return an exposure without light."""
    plan = ExposurePlan(name, "dark", exposure_time_s, frames)
    return Shot(plan, lambda grid: tiled(np.zeros(()), grid))


def tiled(levels: NDArray[np.generic], grid: PixelGrid) -> Image:
    """Return levels of shape (), (1, 1) or (2, 2) repeated over the pixels of a sensor."""
    sites = np.asarray(levels, np.float32)
    first = sites.flat[0]
    if (sites == first).all():
        return np.full((grid.rows, grid.columns), first)
    sites = np.broadcast_to(sites, (2, 2))
    light = np.empty((grid.rows, grid.columns), np.float32)
    for y in (0, 1):
        for x in (0, 1):
            light[y::2, x::2] = sites[y, x]
    return light
