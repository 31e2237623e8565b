"""The city as a panorama on a cylinder around the eye."""

import math
from collections.abc import Callable
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import over_rows
from dsis.scenes.city.backdrop import paint_hills
from dsis.scenes.city.blocks import block
from dsis.scenes.city.cells import sort_into_cells
from dsis.scenes.city.light import SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD, sky_sets, sun_points
from dsis.scenes.city.lighting import Light
from dsis.scenes.city.plan import REACH_M, Plan, street_plan
from dsis.scenes.city.solids import Solid, table
from dsis.scenes.city.suburbs import suburb
from dsis.scenes.city.tracer import trace_columns
from dsis.scenes.sky import SUN_RADIANCE_RGB, SkyDome, paint

EYE_M = 74.0
LEFT_RAD = -0.42  # azimuth of column 0
FIELD_RAD = math.radians(36)  # of a 16:9 window
HORIZON = 0.30  # of the rows
HAZE_PER_M = np.array([0.26e-4, 0.40e-4, 0.66e-4])
HAZE_RGB = np.array([0.44, 0.53, 0.66])
EXPOSURE = 1.08  # the tops of clouds and glints clip, as in a photograph
SECTORS = 48
COLUMNS_AT_ONCE = 16
RASTER_M, CELL_M = 8200.0, 12.0
NEAREST_M, MARGIN_M = 60.0, 330.0  # of blocks; around the view, for shadows and mirrors


def render(
    seed: int,
    rows: int,
    columns: int,
    *,
    samples: int = 4,
    ambient: int = 4,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.float32]:
    """Render the city of a seed.

    Parameters
    ----------
    seed
        Not negative; another seed is another city.
    rows, columns
        Size in pixels. 16/9 rows columns span 36 degrees; column 0 is the left end, so a wider
        panorama shows more of the same.
    samples, ambient
        Points per pixel, and directions of ambient light per point.
    threads
        Number of threads; the bytes do not depend on it.
    progress
        Called with (columns done, columns).

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), linear light, Rec.709 primaries, finite and not negative; a white diffuse
        surface that faces the sun is 1.0, glints are brighter.
    """
    pixel = FIELD_RAD * 9 / 16 / rows
    horizon_row = HORIZON * rows
    azimuths = LEFT_RAD + (np.arange(columns, dtype=np.float64) + 0.5) * pixel
    slopes = (horizon_row - np.arange(rows, dtype=np.float64) - 0.5) * pixel
    dome = SkyDome.of(seed, SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD)
    image = np.zeros((rows, columns, 3), np.float32)
    above = math.ceil(horizon_row) + 1
    paint(dome, slopes[:above], azimuths, image[:above], threads)
    paint_hills(image, slopes, azimuths, seed, HAZE_PER_M, HAZE_RGB)
    light = Light(sun_points(samples), np.array(SUN_RADIANCE_RGB), sky_sets(samples, ambient),
                  dome.table, HAZE_PER_M, HAZE_RGB)  # fmt: skip
    plan = street_plan(seed)
    solids = table(city(plan, float(azimuths[-1])))
    cells = sort_into_cells(solids, RASTER_M, CELL_M)
    n = np.arange(samples)
    points = np.stack([(n + 0.5) / samples, (0.5 + n * 0.6180339887498949) % 1], axis=1)
    lock, done = Lock(), [0]

    def work(first: int, last: int) -> None:
        for start in range(first, last, COLUMNS_AT_ONCE):
            end = min(start + COLUMNS_AT_ONCE, last)
            trace_columns(image, solids, cells, plan, light, points, EYE_M, LEFT_RAD, horizon_row,
                          pixel, start, end)  # fmt: skip
            with lock:
                done[0] += end - start
                if progress:
                    progress(done[0], columns)

    over_rows(work, columns, threads)
    image *= np.float32(EXPOSURE)
    return image


def city(plan: Plan, last_rad: float) -> list[Solid]:
    """Return all that may be seen, cast a shadow or be mirrored up to an azimuth."""
    solids: list[Solid] = []
    for i in range(plan.a_low.size):
        for j in range(plan.b_low.size):
            a, b = (plan.a_low[i] + plan.a_high[i]) / 2, (plan.b_low[j] + plan.b_high[j]) / 2
            x, y = plan.world(a, b)
            distance = math.hypot(x, y)
            margin = math.asin(min(MARGIN_M / max(distance, 1.0), 1.0))
            turn = (math.atan2(x, y) - LEFT_RAD + margin) % (2 * math.pi)
            in_view = turn < last_rad - LEFT_RAD + 2 * margin or margin > 1.5
            if NEAREST_M < distance < REACH_M and in_view:
                solids += block(plan, i, j)
    step = 2 * math.pi / SECTORS
    for sector in range(SECTORS):
        if (sector - 1) * step < last_rad - LEFT_RAD:
            first = LEFT_RAD + (sector - 0.5) * step
            solids += suburb(plan.seed, sector, first, first + step)
    return solids
