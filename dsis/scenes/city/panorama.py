"""The city as a panorama on a cylinder around the eye."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dsis.scenes.city.backdrop import paint_hills
from dsis.scenes.city.blocks import block
from dsis.scenes.city.cells import Cells, sort_into_cells
from dsis.scenes.city.light import SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD, sky_sets, sun_points
from dsis.scenes.city.lighting import Light
from dsis.scenes.city.plan import REACH_M, Plan, street_plan
from dsis.scenes.city.solids import Solid, table
from dsis.scenes.city.suburbs import suburb
from dsis.scenes.city.tracer import trace_columns
from dsis.scenes.sky import SUN_RADIANCE_RGB, SkyDome, paint
from dsis.scenes.strip import Strip

EYE_M = 74.0
LEFT_RAD = -0.42  # azimuth of column 0
FIELD_RAD = math.radians(36)  # of a 16:9 window
HORIZON = 0.30  # of the rows
HAZE_PER_M = np.array([0.26e-4, 0.40e-4, 0.66e-4])
HAZE_RGB = np.array([0.44, 0.53, 0.66])
EXPOSURE = 1.08  # the tops of clouds and glints clip, as in a photograph
SECTORS = 48
RASTER_M, CELL_M = 8200.0, 12.0
NEAREST_M, MARGIN_M = 60.0, 330.0  # of blocks; around the view, for shadows and mirrors


def prepared(strip: Strip) -> "City":
    """Return what renders the parts of a strip; 16/9 rows columns of it span 36 degrees."""
    return City.of(strip)


@dataclass(frozen=True)
class City:
    """All that the pixels of one panorama need.

    Attributes
    ----------
    seed, rows
        Of the strip.
    dome, plan, solids, cells, light
        Sky, streets, what stands there, where to find it, and what lights it.
    points
        Places within a pixel, row and column in 0..1: float64 (sample, 2).
    """

    seed: int
    rows: int
    dome: SkyDome
    plan: Plan
    solids: NDArray[np.float64]
    cells: Cells
    light: Light
    points: NDArray[np.float64]

    @classmethod
    def of(cls, strip: Strip) -> Self:
        """Build the city of a seed, as far as a strip shows it."""
        dome = SkyDome.of(strip.seed, SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD)
        light = Light(sun_points(strip.samples), np.array(SUN_RADIANCE_RGB),
                      sky_sets(strip.samples, strip.ambient), dome.table, HAZE_PER_M,
                      HAZE_RGB)  # fmt: skip
        plan = street_plan(strip.seed)
        solids = table(city(plan, LEFT_RAD + (strip.columns - 0.5) * _pixel_rad(strip.rows)))
        n = np.arange(strip.samples)
        across = (0.5 + n * 0.6180339887498949) % 1
        points = np.stack([(n + 0.5) / strip.samples, across], axis=1)
        cells = sort_into_cells(solids, RASTER_M, CELL_M)
        return cls(strip.seed, strip.rows, dome, plan, solids, cells, light, points)

    def part(self, first: int, last: int) -> NDArray[np.float32]:
        """Render the columns first..last-1: float32 (row, column, 3), linear, Rec.709 primaries."""
        pixel, horizon_row = _pixel_rad(self.rows), HORIZON * self.rows
        left_rad = LEFT_RAD + first * pixel
        azimuths = left_rad + (np.arange(last - first, dtype=np.float64) + 0.5) * pixel
        slopes = (horizon_row - np.arange(self.rows, dtype=np.float64) - 0.5) * pixel
        image = np.zeros((self.rows, last - first, 3), np.float32)
        above = math.ceil(horizon_row) + 1
        paint(self.dome, slopes[:above], azimuths, image[:above])
        paint_hills(image, slopes, azimuths, self.seed, HAZE_PER_M, HAZE_RGB)
        trace_columns(image, self.solids, self.cells, self.plan, self.light, self.points, EYE_M,
                      left_rad, horizon_row, pixel)  # fmt: skip
        image *= np.float32(EXPOSURE)
        return image


def _pixel_rad(rows: int) -> float:
    return FIELD_RAD * 9 / 16 / rows


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
