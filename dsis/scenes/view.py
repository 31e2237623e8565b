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
    """

    image: Field
    focal_px: float
    horizon_row: float
    eye_m: float

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

    def facet(self, corners: Sequence[Point], azimuth: float, shade: Shade) -> None:
        """Paint a convex plane facet, edges covered by area, if it faces the eye.

        Parameters
        ----------
        corners
            Counter-clockwise as seen from its front; the first edge is the facet's u axis, its
            v axis is perpendicular to that, towards the other corners.
        azimuth
            Of the object, in radians: tells the turn of the cylinder.
        shade
            Of (u, v, range) in metres and the widths of a pixel along u and v; gives the colour.
        """
        origin = np.array(corners[0])
        along, other = np.array(corners[1]) - origin, np.array(corners[-1]) - origin
        along /= np.linalg.norm(along)
        other -= along * (other @ along)
        up = other / np.linalg.norm(other)
        normal = np.cross(along, up)
        level = float(normal @ (origin - (0, 0, self.eye_m)))
        if level > -1e-3:  # seen from behind or edge on
            return
        spots = [self.project(corner, azimuth) for corner in corners]
        c, r = zip(*spots, strict=True)
        top, bottom, left, right = self.box(min(c) - 1, min(r) - 1, max(c) + 1, max(r) + 1)
        if top >= bottom or left >= right:
            return
        az, slope = self.azimuths(left, right), self.slopes(top, bottom)
        sin, cos = np.sin(az), np.cos(az)
        facing = float(normal[0]) * sin + float(normal[1]) * cos + float(normal[2]) * slope
        distance = level / np.minimum(facing, -1e-4)
        u = distance * (float(along[0]) * sin + float(along[1]) * cos + float(along[2]) * slope)
        v = distance * (float(up[0]) * sin + float(up[1]) * cos + float(up[2]) * slope)
        start = origin - (0, 0, self.eye_m)
        u -= float(along @ start)
        v -= float(up @ start)
        colour = shade(u, v, distance, *_footprint(u, v))
        self.blend(top, left, colour, _cover(spots, top, bottom, left, right))


def _footprint(u: Field, v: Field) -> tuple[float, float]:
    """Return the mean widths of a pixel along u and v."""
    sizes = []
    for axis in (u, v):
        down = abs(float(axis[-1].mean() - axis[0].mean())) / max(axis.shape[0] - 1, 1)
        across = abs(float(axis[:, -1].mean() - axis[:, 0].mean())) / max(axis.shape[1] - 1, 1)
        sizes.append(down + across)
    return sizes[0], sizes[1]


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
