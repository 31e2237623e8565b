"""The cylindrical view: where points of the world fall, and painting onto the picture.

World coordinates are x (right), y (ahead), z (up) in metres, the eye above the origin. Azimuth
runs linearly over the columns, so that a sliding window is a camera turning about its nodal point,
exactly; rows are linear in the slope z / range.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float32]
Point = tuple[float, float, float]
Shade = Callable[[Field, Field, Field, float, float], Field]
DILATION_PX = 0.5  # facets grow by this much, so that no background shines through at shared edges


@dataclass(frozen=True)
class View:
    """A strip of the cylinder and its picture.

    Attributes
    ----------
    image
        float32 (row, column, 3), linear light; painted in place.
    focal_px
        Pixels per radian of azimuth, and per unit of slope.
    horizon_row
        Row of slope 0.
    eye_m
        Height of the eye.
    air
        Density of the haze, 1 = that of the city.
    """

    image: Field
    focal_px: float
    horizon_row: float
    eye_m: float
    air: float = 1.0

    def azimuths(self, first: int = 0, last: int | None = None) -> Field:
        """Return the azimuth of the centres of columns first..last-1 in radians: (1, column)."""
        last = self.image.shape[1] if last is None else last
        return ((np.arange(first, last) + 0.5) / self.focal_px).astype(np.float32)[None, :]

    def slopes(self, first: int = 0, last: int | None = None) -> Field:
        """Return the slope, positive above the horizon, of rows first..last-1: (row, 1)."""
        last = self.image.shape[0] if last is None else last
        rows = np.arange(first, last) + 0.5
        return ((self.horizon_row - rows) / self.focal_px).astype(np.float32)[:, None]

    def project(self, point: Point, azimuth: float) -> tuple[float, float]:
        """Return (column, row) of a point, on the turn of the cylinder nearest to `azimuth`."""
        x, y, z = point
        offset = math.remainder(math.atan2(x, y) - azimuth, math.tau)
        slope = (z - self.eye_m) / max(math.hypot(x, y), 1.0)
        return self.focal_px * (azimuth + offset), self.horizon_row - self.focal_px * slope

    def turns(self, azimuth: float, half_width: float) -> list[float]:
        """Return the azimuths, turns apart, at which an object of that half width is in view."""
        end = self.image.shape[1] / self.focal_px + half_width
        start = azimuth + math.tau * math.ceil((-half_width - azimuth) / math.tau)
        return [start + math.tau * n for n in range(1 + int(max(end - start, -1) // math.tau))]

    def box(
        self, left: float, top: float, right: float, bottom: float
    ) -> tuple[int, int, int, int]:
        """Return (first row, last row, first column, last column) of an area, cut to the picture.

        The last row and column are exclusive; an area out of sight has last <= first.
        """
        rows, columns = self.image.shape[:2]
        return (
            max(math.floor(top), 0),
            min(math.ceil(bottom), rows),
            max(math.floor(left), 0),
            min(math.ceil(right), columns),
        )

    def blend(self, first_row: int, first_column: int, colour: Field, cover: Field) -> None:
        """Paint `colour` (row, column, 3) over the picture where `cover` (row, column) is."""
        rows, columns = cover.shape
        under = self.image[first_row : first_row + rows, first_column : first_column + columns]
        under += cover[..., None] * (colour - under)

    def facet(
        self, corners: Sequence[Point], azimuth: float, shade: Shade, lowest_row: float = math.inf
    ) -> None:
        """Paint a convex plane facet, edges covered by area, if it faces the eye.

        Parameters
        ----------
        corners
            Counter-clockwise as seen from its front; the first edge is the facet's u axis, its
            v axis is perpendicular to that, towards the other corners.
        azimuth
            Of the object, in radians: tells the turn of the cylinder.
        lowest_row
            What lies below this row is hidden by nearer things and need not be painted.
        shade
            Of (u, v, range) in metres and the widths of a pixel along u and v; gives the colour.
        """
        origin = (corners[0][0], corners[0][1], corners[0][2] - self.eye_m)
        along = _unit(_minus(corners[1], corners[0]))
        other = _minus(corners[-1], corners[0])
        lean = _dot(other, along)
        up = _unit(_minus(other, (lean * along[0], lean * along[1], lean * along[2])))
        normal = (
            along[1] * up[2] - along[2] * up[1],
            along[2] * up[0] - along[0] * up[2],
            along[0] * up[1] - along[1] * up[0],
        )
        level = _dot(normal, origin)
        if level > -1e-3:  # seen from behind or edge on
            return
        spots = [self.project(corner, azimuth) for corner in corners]
        c, r = zip(*spots, strict=True)
        top, bottom, left, right = self.box(min(c) - 1, min(r) - 1, max(c) + 1, min(max(r) + 1, lowest_row))
        if top >= bottom or left >= right:
            return
        az, slope = self.azimuths(left, right), self.slopes(top, bottom)
        sin, cos = np.sin(az), np.cos(az)

        def rise(axis: Point) -> Field:
            seen: Field = np.float32(axis[0]) * sin + np.float32(axis[1]) * cos
            return seen + np.float32(axis[2]) * slope if axis[2] else seen

        distance = level / np.minimum(rise(normal), np.float32(-1e-4))
        u = distance * rise(along) - np.float32(_dot(along, origin))
        v = distance * rise(up) - np.float32(_dot(up, origin))
        colour = shade(u, v, distance, _footprint(u), _footprint(v))
        self.blend(top, left, colour, _cover(spots, top, bottom, left, right))


def _minus(p: Point, q: Point) -> Point:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(p: Point, q: Point) -> float:
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _unit(p: Point) -> Point:
    length = math.sqrt(_dot(p, p))
    return p[0] / length, p[1] / length, p[2] / length


def _footprint(axis: Field) -> float:
    """Return the width of a pixel along a facet's axis, in the middle of the facet."""
    rows, columns = axis.shape
    down = axis[-1, columns // 2] - axis[0, columns // 2]
    across = axis[rows // 2, -1] - axis[rows // 2, 0]
    return float(abs(down)) / max(rows - 1, 1) + float(abs(across)) / max(columns - 1, 1)


def _cover(
    spots: Sequence[tuple[float, float]], top: int, bottom: int, left: int, right: int
) -> Field:
    """Return the share of each pixel that a convex polygon covers, by distance to its edges."""
    columns = (np.arange(left, right) + 0.5).astype(np.float32)[None, :]
    rows = (np.arange(top, bottom) + 0.5).astype(np.float32)[:, None]
    inside: Field = np.full((bottom - top, right - left), 1e9, np.float32)
    for (c0, r0), (c1, r1) in zip(spots, [*spots[1:], spots[0]], strict=True):
        length = math.hypot(c1 - c0, r1 - r0)
        if length > 1e-6:
            a, b = (r1 - r0) / length, (c0 - c1) / length
            edge = a * (columns - c0) + b * (rows - r0)
            np.minimum(inside, edge, out=inside)
    covered: Field = np.clip(inside + 0.5 + DILATION_PX, 0, 1)
    return covered
