"""Where rays meet solids. Caches on disk: as `dsis.scenes.city.patterns`."""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.cells import Cells
from dsis.scenes.city.patterns import pick
from dsis.scenes.city.solids import (
    BASE,
    COS,
    EAVES,
    HALF_X,
    HALF_Y,
    KIND,
    SEED,
    SIN,
    SLOPE_X,
    SLOPE_Y,
    TOP,
    Kind,
    X,
    Y,
)  # fmt: skip
from dsis.scenes.city.spot import Vec

Solid = NDArray[np.float64]
Hit = tuple[float, int, int]  # distance in metres, solid (-1: none) and face
_CROWN = int(Kind.CROWN)
LEAF_M = 0.27


@kernel
def leaf_size(s: Solid, pixel: float) -> float:
    """Return the size of a crown's tufts of leaves: no finer than a pixel of so many radians."""
    return max(LEAF_M, 1.2 * pixel * math.sqrt(s[X] * s[X] + s[Y] * s[Y]))


@kernel
def _leaves(s: Solid, p: Vec, d: Vec, most: float, leaf: float) -> float:
    """Return where a ray meets the leaves of a crown's lobe, or -1.

    The lobe is an ellipsoid of cells, each with a tuft of leaves or without; fewer at the rim.
    """
    rx, rz = s[HALF_X], 0.5 * (s[TOP] - s[BASE])
    px, py, pz = (p[0] - s[X]) / rx, (p[1] - s[Y]) / rx, (p[2] - s[BASE] - rz) / rz
    qx, qy, qz = d[0] / rx, d[1] / rx, d[2] / rz
    qq = qx * qx + qy * qy + qz * qz
    middle = -(px * qx + py * qy + pz * qz) / qq
    half = (1 - px * px - py * py - pz * pz) / qq + middle * middle
    if half <= 0:
        return -1.0
    half = math.sqrt(half)
    begin, end = max(middle - half, 1e-3), min(middle + half, most)
    step: float = max(0.55 * leaf, (end - begin) / 32)
    seed = int(s[SEED])
    t: float = begin + (
        1.1 * leaf if middle - half < 0 else 0.3 * step
    )  # not the leaf it comes from
    while t < end:
        u, v, w = (p[0] + t * d[0]) / leaf, (p[1] + t * d[1]) / leaf, (p[2] + t * d[2]) / leaf
        i, j, k = math.floor(u), math.floor(v), math.floor(w)
        out = (px + t * qx) ** 2 + (py + t * qy) ** 2 + (pz + t * qz) ** 2
        h = pick(i + (j << 20), k, seed)
        if h < 0.80 - 0.66 * out * out:
            e = 0.3 * h
            if (u - i - 0.35 - e) ** 2 + (v - j - 0.5) ** 2 + (w - k - 0.65 + e) ** 2 < 0.36:
                return t
        t += step
    return -1.0


@kernel
def _between(
    p: float, q: float, low: float, high: float, near: float, far: float, face: int,
    face_low: int, face_high: int,
) -> tuple[float, float, int]:  # fmt: skip
    """Clip near..far of a ray to low <= p + t q <= high; far < near: nothing is left."""
    if q == 0.0:
        return near, (far if low <= p <= high else -1.0), face
    enter, leave = ((low - p) / q, (high - p) / q) if q > 0 else ((high - p) / q, (low - p) / q)
    if enter > near:
        near, face = enter, (face_low if q > 0 else face_high)
    return near, min(far, leave), face


@kernel
def _below(
    room: float, rate: float, near: float, far: float, face: int, entered: int
) -> tuple[float, float, int]:
    """Clip near..far of a ray to t rate <= room."""
    if rate > 0:
        return near, min(far, room / rate), face
    if rate == 0.0:
        return near, (far if room >= 0 else -1.0), face
    if room / rate > near:
        return room / rate, far, entered
    return near, far, face


@kernel
def _solid(s: Solid, p: Vec, d: Vec, most: float) -> tuple[float, int]:
    """Return where a ray enters a solid nearer than `most`, or -1, and through which face.

    Faces: 0 from below; 1, 2 the walls at -x and +x; 3, 4 at -y and +y; 5..8 the roofs above them;
    9 the top.
    """
    cos, sin = s[COS], s[SIN]
    gx, gy = p[0] - s[X], p[1] - s[Y]
    px, py = cos * gx + sin * gy, cos * gy - sin * gx
    qx, qy = cos * d[0] + sin * d[1], cos * d[1] - sin * d[0]
    hx, hy = s[HALF_X], s[HALF_Y]
    near, far, face = _between(px, qx, -hx, hx, 1e-4, most, -1, 1, 2)
    if near < far:
        near, far, face = _between(py, qy, -hy, hy, near, far, face, 3, 4)
    if near < far:
        near, far, face = _between(p[2], d[2], s[BASE], s[TOP], near, far, face, 0, 9)
    room, slope = s[EAVES] - p[2], s[SLOPE_X]
    if near < far and slope > 0:
        least = room + slope * hx
        near, far, face = _below(least + slope * px, d[2] - slope * qx, near, far, face, 5)
        near, far, face = _below(least - slope * px, d[2] + slope * qx, near, far, face, 6)
    slope = s[SLOPE_Y]
    if near < far and slope > 0:
        least = room + slope * hy
        near, far, face = _below(least + slope * py, d[2] - slope * qy, near, far, face, 7)
        near, far, face = _below(least - slope * py, d[2] + slope * qy, near, far, face, 8)
    return (near, face) if near < far and face >= 0 else (-1.0, 0)


@kernel
def _in_cell(
    table: Solid, cells: Cells, cell: int, lowest: float, p: Vec, d: Vec, hit: Hit, pixel: float
) -> Hit:
    """Return the nearer of a hit and what a ray, no lower than `lowest` here, meets in a cell."""
    most, which, face = hit
    for item in range(cells.starts[cell], cells.starts[cell + 1]):
        k = cells.items[item]
        s = table[k]
        if s[TOP] >= lowest:
            if s[KIND] == _CROWN:
                t, f = _leaves(s, p, d, most, leaf_size(s, pixel)), 9
            else:
                t, f = _solid(s, p, d, most)
            if t > 0.0:
                most, which, face = t, k, f
    return most, which, face


@kernel
def trace(
    table: Solid, cells: Cells, p: Vec, d: Vec, most: float, pixel: float, any_will_do: bool
) -> Hit:
    """Return the distance, solid and face that a ray from p along d meets before `most`.

    Solid -1: none. Leaves are no finer than `pixel`, in radians from the eye. The ray walks through
    the cells in its way and looks into those that hold something as high as it.
    """
    t = 0.0
    if d[2] > 0:
        most = min(most, (cells.ceiling_m - p[2]) / d[2])
    elif d[2] < 0 and p[2] > cells.ceiling_m:
        t = (cells.ceiling_m - p[2]) / d[2]
    size, n = cells.size_m, cells.across
    gx, gy = (p[0] + t * d[0] + cells.reach_m) / size, (p[1] + t * d[1] + cells.reach_m) / size
    i, j = math.floor(gx), math.floor(gy)
    gap_x, gap_y = size / max(abs(d[0]), 1e-30), size / max(abs(d[1]), 1e-30)
    next_x = t + (i + 1 - gx if d[0] > 0 else gx - i) * gap_x
    next_y = t + (j + 1 - gy if d[1] > 0 else gy - j) * gap_y
    hit = (most, -1, 0)
    while t < hit[0] and 0 <= i < n and 0 <= j < n:
        leave = min(next_x, next_y)
        lowest = p[2] + d[2] * (leave if d[2] < 0 else t)
        if lowest <= cells.tops[i, j]:
            hit = _in_cell(table, cells, i * n + j, lowest, p, d, hit, pixel)
            if hit[1] >= 0 and (any_will_do or hit[0] <= leave):
                break
        t = leave
        if next_x < next_y:
            i += 1 if d[0] > 0 else -1
            next_x += gap_x
        else:
            j += 1 if d[1] > 0 else -1
            next_y += gap_y
    return hit


@kernel
def outward(s: Solid, face: int, p: Vec) -> Vec:
    """Return the normal of a solid's face at a place, in the world."""
    if s[KIND] == _CROWN:
        rx, rz = s[HALF_X], 0.5 * (s[TOP] - s[BASE])
        x, y, z = (p[0] - s[X]) / rx, (p[1] - s[Y]) / rx, (p[2] - s[BASE] - rz) / rz + 0.15
        long = 1 / math.sqrt(x * x + y * y + z * z + 1e-12)
        return x * long, y * long, z * long
    if face in (0, 9):
        return 0.0, 0.0, 1.0 if face == 9 else -1.0
    side = -1.0 if face % 2 == 1 else 1.0
    along_x, level, z = face <= 2 or face in {5, 6}, 1.0, 0.0
    if face >= 5:
        slope = s[SLOPE_X] if along_x else s[SLOPE_Y]
        z = 1 / math.sqrt(1 + slope * slope)
        level = slope * z
    level *= side
    if along_x:
        return s[COS] * level, s[SIN] * level, z
    return -s[SIN] * level, s[COS] * level, z
