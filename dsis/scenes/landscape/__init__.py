"""Landscape: meadow, lakes, fields, villages, wooded hills and mountains under cumulus clouds.

Traced without chance: every pixel has the same sub-pixel points and directions of the sky.
"""

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from dsis.scenes import sky
from dsis.scenes.landscape import planting
from dsis.scenes.landscape.crown import crowns
from dsis.scenes.landscape.grass import AZIMUTH, blades
from dsis.scenes.landscape.light import Around, Lattice
from dsis.scenes.landscape.planting import RADIUS, RANGE, X, Y
from dsis.scenes.landscape.relief import SUN_AZIMUTH_RAD, Relief
from dsis.scenes.landscape.shading import shade
from dsis.scenes.landscape.visible import SKY, grow, land, stand
from dsis.scenes.landscape.water import mirror
from dsis.scenes.strip import Strip

FIELD_RAD: Final = math.radians(46.0)  # azimuth across a frame of 16:9
TOP_SLOPE = 0.184  # of the upper edge
SUN_ELEVATION_RAD = math.radians(34.0)
EXPOSURE = 0.95  # the tops of clouds all but clip, glints do, as in a photograph
MARGIN_RAD = 0.5  # what stands so far aside may still cast its shadow into the picture
Numbers = NDArray[np.float64]


def prepared(strip: Strip) -> "Landscape":
    """Return what renders the parts of a strip; column 0 is at the azimuth 0."""
    return Landscape.of(strip)


@dataclass(frozen=True)
class Landscape:
    """All that the pixels of one panorama need."""

    focal_px: float
    rows: int
    samples: int
    dome: sky.SkyDome
    relief: Relief
    around: Around
    blades: Numbers
    rays: Numbers
    ray_light: Numbers

    @classmethod
    def of(cls, strip: Strip) -> Self:
        """Make the land of a seed, as far as a strip shows it."""
        seed, focal_px = strip.seed, strip.rows * 16 / 9 / FIELD_RAD
        dome = sky.SkyDome.of(seed, SUN_AZIMUTH_RAD, SUN_ELEVATION_RAD)
        relief = Relief.of(seed)
        last = min(strip.columns / focal_px, 2 * np.pi)
        table = planting.things(relief, seed, -MARGIN_RAD, last + MARGIN_RAD)
        rays, ray_light = _sky_rays(dome, strip.samples, strip.ambient)
        meadow = blades(relief, seed, -0.05, strip.columns / focal_px + 0.05)
        lattice = Lattice.of(table)
        around = (lattice.start, lattice.item, lattice.top, table, crowns())
        return cls(
            focal_px, strip.rows, strip.samples, dome, relief, around, meadow, rays, ray_light
        )

    def part(self, first: int, last: int) -> NDArray[np.float32]:
        """Render the columns first..last-1: float32 (row, column, 3), linear, Rec.709 primaries."""
        rows, columns = self.rows, last - first
        image = np.empty((rows, columns, 3), np.float32)
        azimuths, slopes = self._directions(first, last, 0.5, 0.5)
        sky.paint(self.dome, slopes, azimuths, image)
        shape = (columns, rows)
        seen = (np.empty(shape), np.empty(shape, np.int64), np.empty((*shape, 3)), np.empty(shape))
        colour, total, share = np.empty((*shape, 3)), np.zeros((*shape, 3)), np.zeros(shape)
        white = self.dome.sun_irradiance_rgb.astype(np.float64) / np.pi
        sun, things, shapes = self.dome.sun_direction, self.around[3], self.around[4]
        pixel_rad = 1 / self.focal_px
        for n in range(self.samples):
            across, down = (0.5 + 0.7548776662 * n) % 1, (0.5 + 0.5698402910 * n) % 1
            azimuths, slopes = self._directions(first, last, across, down)
            numbers = self._near(azimuths)
            low, high = np.searchsorted(
                self.blades[:, AZIMUTH], [azimuths[0] - 0.05, azimuths[-1] + 0.05]
            )
            land(seen, azimuths, slopes, self.relief.height, self.relief.lean_x, self.relief.lean_y)
            stand(seen, azimuths, slopes, pixel_rad, things, numbers, shapes)
            grow(seen, azimuths, slopes, pixel_rad, self.blades, int(low), int(high))
            horizon = self._horizon(azimuths)
            lights = (sun, white, self.rays[n], self.ray_light[n])
            shade(
                colour, seen, azimuths, slopes, pixel_rad, self.around, self.blades,
                self.relief.wood, lights, horizon,
            )  # fmt: skip
            spread = math.sqrt(3.0) * (2 * (n + 0.5) / self.samples - 1)
            mirror(
                colour, seen, azimuths, slopes, pixel_rad, self.dome.table, sun, white, spread,
                horizon,
            )  # fmt: skip
            solid = seen[1] != SKY
            total[solid] += colour[solid]
            share += solid
        total /= self.samples
        clear = 1 - share / self.samples
        image *= clear.T[..., None].astype(np.float32)
        image += total.transpose(1, 0, 2).astype(np.float32)
        image *= np.float32(EXPOSURE)
        return image

    def _directions(
        self, first: int, last: int, across: float, down: float
    ) -> tuple[Numbers, Numbers]:
        """Return azimuths of the columns and slopes of the rows, at a place within a pixel."""
        azimuths = (np.arange(first, last) + across) / self.focal_px
        slopes = TOP_SLOPE - (np.arange(self.rows) + down) / self.focal_px
        return np.asarray(azimuths, np.float64), np.asarray(slopes, np.float64)

    def _near(self, azimuths: Numbers) -> NDArray[np.int64]:
        """Return the numbers of things that these azimuths may see."""
        things = self.around[3]
        turn = np.arctan2(things[:, X], things[:, Y]) - azimuths.mean()
        turn = (turn + np.pi) % (2 * np.pi) - np.pi
        wide = np.arcsin(np.minimum(1.35 * things[:, RADIUS] / things[:, RANGE], 1))
        found: NDArray[np.int64] = np.flatnonzero(np.abs(turn) < wide + np.ptp(azimuths))
        return found

    def _horizon(self, azimuths: Numbers) -> Numbers:
        """Return the clear sky's radiance at the horizon, (column, 3)."""
        row = self.dome.table[0].astype(np.float64)
        place = azimuths / (2 * np.pi) * len(row)
        low = np.floor(place).astype(int)
        share = (place - low)[:, None]
        found: Numbers = row[low % len(row)] * (1 - share) + row[(low + 1) % len(row)] * share
        return found


def _sky_rays(dome: sky.SkyDome, samples: int, ambient: int) -> tuple[Numbers, Numbers]:
    """Return directions (sample, ray, 3), even over the sky, and their light (sample, ray, 3)."""
    count = samples * ambient
    number = np.arange(count)
    sine = (number + 0.5) / count
    turn = number * np.pi * (3 - np.sqrt(5.0))
    level = np.sqrt(1 - sine * sine)
    rays = np.stack([level * np.sin(turn), level * np.cos(turn), sine], axis=1)
    size = dome.table.shape
    row = np.minimum(np.round(sine * (size[0] - 1)).astype(int), size[0] - 1)
    column = np.round(turn / (2 * np.pi) * size[1]).astype(int) % size[1]
    light = dome.table[row, column] * (2.0 / ambient)
    order = number.reshape(ambient, samples).T
    return rays[order], light.astype(np.float64)[order]
