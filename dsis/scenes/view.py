"""The cylindrical view: where points of the world fall, and painting facets onto the picture.

World coordinates are x (right), y (ahead), z (up) in metres, the eye above the origin. Azimuth
grows linearly with the column, so a sliding window is a camera that turns about its nodal point,
without any error; rows are linear in slope (height over range).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dsis.scenes.light import hazed
from dsis.scenes.texture import Field

Point = tuple[float, float, float]
# Of the position (u, v) on a facet and the widths of a pixel along u and v, all in metres: colour.
Shade = Callable[[Field, Field, float, float], Field]
DILATION_PX = 0.5  # facets grow by this much, lest the background shine through at shared edges


@dataclass(frozen=True)
class View:
    """A strip of the cylinder and its picture.

    Attributes
    ----------
    image
        float32 (row, column, 3), linear light; painted in place.
    focal_px
        Pixels per radian of azimuth and per unit of slope.
    horizon_row
        Row of slope 0.
    eye_m
        Height of the eye.
    air
        Density of the haze.
    """

    image: Field
    focal_px: float
    horizon_row: float
    eye_m: float
    air: float

    def azimuths(self, first: int = 0, last: int | None = None) -> Field:
        """Return the azimuths of columns first..last-1 in radians: (1, column)."""
        columns = np.arange(self.image.shape[1])[first:last]
        return ((columns + 0.5) / self.focal_px).astype(np.float32)[None, :]

    def slopes(self, first: int = 0, last: int | None = None) -> Field:
        """Return the slopes, positive above the horizon, of rows first..last-1: (row, 1)."""
        rows = np.arange(self.image.shape[0])[first:last]
        return ((self.horizon_row - rows - 0.5) / self.focal_px).astype(np.float32)[:, None]

    def project(self, point: Point, azimuth: float) -> tuple[float, float]:
        """Return (column, row) of a point, on the turn of the cylinder next to `azimuth`."""
        x, y, z = point
        aside = math.remainder(math.atan2(x, y) - azimuth, math.tau)
        slope = (z - self.eye_m) / max(math.hypot(x, y), 1.0)
        return self.focal_px * (azimuth + aside), self.horizon_row - self.focal_px * slope

    def turns(self, azimuth: float, half_width: float) -> list[float]:
        """Return the azimuths, full turns apart, at which an object of that width is in view."""
        end = self.image.shape[1] / self.focal_px + half_width
        start = azimuth + math.tau * math.ceil((-half_width - azimuth) / math.tau)
        return [start + math.tau * n for n in range(math.ceil((end - start) / math.tau))]

    def box(
        self, columns: tuple[float, float], rows: tuple[float, float]
    ) -> tuple[int, int, int, int]:
        """Return (first row, last row, first column, last column) of an area cut to the picture.

        The last ones are exclusive; an area out of sight has a last one <= the first.
        """
        height, width = self.image.shape[:2]
        top, bottom = max(math.floor(rows[0]), 0), min(math.ceil(rows[1]), height)
        return top, bottom, max(math.floor(columns[0]), 0), min(math.ceil(columns[1]), width)

    def blend(self, row: int, column: int, colour: Field, distance: Field, cover: Field) -> None:
        """Paint a colour, seen through so much air, where `cover` (row, column) says."""
        rows, columns = cover.shape
        under = self.image[row : row + rows, column : column + columns]
        under += cover[..., None] * (hazed(colour, distance, self.air) - under)

    def facet(
        self, corners: Sequence[Point], azimuth: float, shade: Shade, lowest_row: float
    ) -> None:
        """Paint a convex plane facet that faces the eye; its edges cover pixels by area.

        Parameters
        ----------
        corners
            Counter-clockwise as seen from its front; u runs along the first edge, v across it.
        azimuth
            Of the object in radians: tells the turn of the cylinder.
        shade
            Colour of the facet.
        lowest_row
            What lies below is hidden by nearer things and need not be painted.
        """
        origin = (corners[0][0], corners[0][1], corners[0][2] - self.eye_m)
        along = _unit(_minus(corners[1], corners[0]))
        edge = _minus(corners[-1], corners[0])
        lean = _dot(edge, along)
        up = _unit(_minus(edge, (lean * along[0], lean * along[1], lean * along[2])))
        normal = _cross(along, up)
        offset = _dot(normal, origin)
        if offset > -1e-3:  # seen from behind or edge on
            return
        spots = [self.project(corner, azimuth) for corner in corners]
        c, r = zip(*spots, strict=True)
        top, bottom, left, right = self.box(
            (min(c) - 1, max(c) + 1), (min(r) - 1, min(max(r) + 1, lowest_row))
        )
        if top >= bottom or left >= right:
            return
        az, slope = self.azimuths(left, right), self.slopes(top, bottom)
        sin, cos = np.sin(az), np.cos(az)

        def seen_along(axis: Point) -> Field:
            level: Field = axis[0] * sin + axis[1] * cos
            return level + axis[2] * slope if axis[2] else level

        distance = offset / np.minimum(seen_along(normal), -1e-4)
        u = distance * seen_along(along) - _dot(along, origin)
        v = distance * seen_along(up) - _dot(up, origin)
        middle = (sum(c) / len(c) / self.focal_px, self.horizon_row - sum(r) / len(r))
        pixel_u, pixel_v = (
            _footprint(axis, normal, offset, middle, self.focal_px) for axis in (along, up)
        )
        colour = shade(u, v, pixel_u, pixel_v)
        self.blend(top, left, colour, distance, _coverage(spots, az * self.focal_px, top, bottom))


def _minus(p: Point, q: Point) -> Point:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(p: Point, q: Point) -> float:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p: Point, q: Point) -> Point:
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def _unit(p: Point) -> Point:
    length = math.sqrt(_dot(p, p))
    return p[0] / length, p[1] / length, p[2] / length


def _footprint(
    axis: Point, normal: Point, offset: float, middle: tuple[float, float], focal_px: float
) -> float:
    """Return the width of a pixel along an axis of a facet, in the facet's middle.

    It is the sum of the steps to the next column and to the next row; `middle` is (azimuth, rows
    above the horizon).
    """

    def along_axis(columns: float, rows: float) -> float:
        az = middle[0] + columns / focal_px
        ray = (math.sin(az), math.cos(az), (middle[1] + rows) / focal_px)
        return offset * _dot(axis, ray) / min(_dot(normal, ray), -1e-4)

    here = along_axis(0, 0)
    return abs(along_axis(1, 0) - here) + abs(along_axis(0, 1) - here)


def _coverage(spots: Sequence[tuple[float, float]], columns: Field, top: int, bottom: int) -> Field:
    """Return the share of each pixel that a convex polygon covers, by distance to its edges."""
    rows = (np.arange(top, bottom) + 0.5).astype(np.float32)[:, None]
    inside: Field = np.full((rows.shape[0], columns.shape[1]), np.inf, np.float32)
    for (c0, r0), (c1, r1) in zip(spots, [*spots[1:], spots[0]], strict=True):
        length = math.hypot(c1 - c0, r1 - r0)
        if length > 1e-6:
            a, b = (r1 - r0) / length, (c0 - c1) / length
            np.minimum(inside, a * (columns - c0) + b * (rows - r0), out=inside)
    covered: Field = np.clip(inside + (0.5 + DILATION_PX), 0, 1)
    return covered
