"""The crown of a tree: spheres blown up by clumps, twigs and leaves, or the tiers of a conifer.

Inside a crown lengths are divided by its radius across and half its height upward, so it has the
radius 1 and the height 2, and its foot is the origin.
"""

import math

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.draw import Draw
from dsis.scenes.landscape.planting import (
    CONIFER,
    HEIGHT,
    KIND,
    LOBES,
    RADIUS,
    RANGE,
    VARIANT,
    VARIANTS,
    X,
    Y,
    Z,
)  # fmt: skip
from dsis.scenes.noise import flakes, noise

Numbers = NDArray[np.float64]
FOLIAGE_PER_M = 0.9  # extinction inside the spheres
BULGE = 0.45  # foliage may stand out of its sphere by so much of the sphere's radius


def crowns() -> Numbers:
    """Return the shapes of crowns, (4 kinds x VARIANTS, LOBES, 4): spheres x, y, z, radius.

    A crown has the radius 1 and the height 2; its foot is the origin.
    """
    draw = Draw(0, ("scenes", "crowns"))
    lobe = np.arange(LOBES)
    shapes = np.zeros((4, VARIANTS, LOBES, 4))
    place = np.stack(np.broadcast_arrays(np.arange(4 * VARIANTS)[:, None], lobe[None], 0), 0)
    a, b = draw.scattered("place", place.reshape(3, -1)).reshape(2, 4, VARIANTS, LOBES)
    c, d = draw.scattered("size", place.reshape(3, -1)).reshape(2, 4, VARIANTS, LOBES)
    turn = 2.4 * lobe + 1.2 * a  # golden angle: around the stem
    share = (lobe + 0.5) / LOBES
    for kind, (low, high, out, size) in enumerate(
        [
            (0.80, 1.70, 0.70, 0.37),
            (0.25, 1.8, 0.0, 0.4),
            (0.3, 1.75, 0.22, 0.5),
            (0.3, 1.35, 0.7, 0.5),
        ]
    ):
        z = low + (high - low) * share
        bulge = np.sqrt(np.maximum(1 - ((z - 1.1) / 1.05) ** 2, 0.05))
        if kind == CONIFER:
            bulge = 1.02 - 0.5 * z
        radial = out * bulge * (0.45 + 0.55 * b)
        shapes[kind, ..., 0] = radial[kind] * np.cos(turn[kind])
        shapes[kind, ..., 1] = radial[kind] * np.sin(turn[kind])
        shapes[kind, ..., 2] = z + 0.16 * (c[kind] - 0.5)
        shapes[kind, ..., 3] = size * (0.72 + 0.56 * d[kind]) * (bulge if kind == CONIFER else 1)
    shapes[CONIFER, ..., 3] = 0.75 * (1.05 - 0.5 * shapes[CONIFER, ..., 2])
    return shapes.reshape(4 * VARIANTS, LOBES, 4)


@kernel
def _clump(x: float, y: float, z: float, tree: Numbers, footprint: float, salt: float) -> float:
    """Return by how many metres foliage bulges here: clumps, twigs, leaves."""
    radius = tree[RADIUS]
    if tree[KIND] == CONIFER:
        radius *= max(1.05 - z / tree[HEIGHT], 0.1)
    size = 0.34 * tree[RADIUS]
    share = radius / tree[RADIUS]
    total = -0.05 * tree[RADIUS]
    for octave in range(3):
        keep = min(max(2.0 - 2.0 * footprint / size, 0.0), 1.0)
        if keep == 0.0:
            return float(total * share)
        strength = (0.62 if octave else 0.75) * size * keep
        total += strength * noise(x / size + salt, y / size, z / size)
        size = size * 0.40
    keep = min(max(2.0 - 2.0 * footprint / 0.13, 0.0), 1.0)
    if keep > 0.0:
        total += 0.22 * keep * flakes(x / 0.13 + salt, y / 0.13, z / 0.13)
    return float(total * share)


@kernel
def _inside(x: float, y: float, z: float, tree: Numbers, shape: Numbers, found: Numbers) -> float:
    """Return the depth in m below the bare crown's surface; write its outward normal."""
    radius, scale = tree[RADIUS], 2.0 / tree[HEIGHT]
    u, v, w = x / radius, y / radius, z * scale
    if tree[KIND] == CONIFER:
        out = math.sqrt(u * u + v * v)
        tier = w * 3.6 + 0.6 * math.sin(3.0 * math.atan2(v, u) + tree[VARIANT])
        tier -= math.floor(tier)
        found[1], found[2], found[3] = u / (out + 0.05), v / (out + 0.05), 0.75 - 0.7 * tier
        return float(radius * ((1.04 - 0.52 * w) * (1.0 - 0.5 * tier) - out) if w > 0.16 else -1.0)
    deepest, best = -1e9, 0
    for n in range(LOBES):
        away = (u - shape[n, 0]) ** 2 + (v - shape[n, 1]) ** 2 + (w - shape[n, 2]) ** 2
        inside = shape[n, 3] - math.sqrt(away)
        if inside > deepest:
            deepest, best = inside, n
    found[1], found[2] = (u - shape[best, 0]) / radius, (v - shape[best, 1]) / radius
    found[3] = (w - shape[best, 2]) * scale
    return float(deepest * min(radius, 1.0 / scale))


@kernel
def _enter(
    found: Numbers, ax: float, ay: float, slope: float, tree: Numbers, shape: Numbers, bulge: float
) -> float:
    """Write where a ray enters the spheres, blown up, and the normal; return where it leaves."""
    radius, scale = tree[RADIUS], 2.0 / tree[HEIGHT]
    enter, leave, first = 1e9, -1e9, 0
    du, dv, dw = ax / radius, ay / radius, slope * scale
    square = du * du + dv * dv + dw * dw
    for n in range(LOBES):
        ou, ov = -tree[X] / radius - shape[n, 0], -tree[Y] / radius - shape[n, 1]
        ow = -tree[Z] * scale - shape[n, 2]
        middle = -(ou * du + ov * dv + ow * dw) / square
        pu, pv, pw = ou + middle * du, ov + middle * dv, ow + middle * dw
        left = (shape[n, 3] * bulge) ** 2 - (pu * pu + pv * pv + pw * pw)
        if left > 0.0:
            half = math.sqrt(left / square)
            leave = max(leave, middle + half)
            if middle - half < enter:
                enter, first = middle - half, n
    found[0], found[4] = enter, 0.0
    x, y, z = enter * ax - tree[X], enter * ay - tree[Y], enter * slope - tree[Z]
    found[1] = (x / radius - shape[first, 0]) / radius
    found[2] = (y / radius - shape[first, 1]) / radius
    found[3] = (z * scale - shape[first, 2]) * scale
    return float(leave)


@kernel
def meet(
    found: Numbers, ax: float, ay: float, slope: float, tree: Numbers, shape: Numbers, pixel: float
) -> None:
    """Write range, normal and depth in the foliage (-1..1) of the first leaf on a ray from the eye.

    The range is 1e9 where there is none. `pixel` is the width of a pixel there in m.
    """
    radius = tree[RADIUS]
    bulge = 1.0 + BULGE * min(max(radius / pixel - 3.0, 0.0) / 3.0, 1.0)
    if tree[KIND] == CONIFER:
        bulge = 1.6  # the spheres lie inside the cone
    leave = _enter(found, ax, ay, slope, tree, shape, bulge)
    if leave < 0.0:
        found[0] = 1e9
        return
    if radius < 4.0 * pixel:
        return
    salt = 3.7 * tree[VARIANT] + 0.37 * tree[RANGE]
    step = max(0.045 * radius, 0.6 * pixel)
    along, outside, inside_at = found[0], found[0], -1.0
    found[0] = 1e9
    for _ in range(64):
        x, y, z = along * ax - tree[X], along * ay - tree[Y], along * slope - tree[Z]
        inside = _inside(x, y, z, tree, shape, found)
        if inside > -0.45 * radius:
            fold = _clump(x, y, z, tree, pixel, salt)
            if inside + fold > 0.0:
                inside_at = along
                found[0], found[4] = along, min(max(3.0 * fold / radius, -1.0), 1.0)
            else:
                outside = along
            inside += 0.2 * radius
        else:
            outside = along
        if inside_at > 0.0:
            if inside_at - outside < 0.16 * step:
                return
            along = 0.5 * (inside_at + outside)
        else:
            along += max(step, -0.6 * inside)
            if along > leave:
                return


@kernel
def optical_depth(
    point: tuple[float, float, float],
    ray: tuple[float, float, float],
    begin: float,
    end: float,
    tree: Numbers,
    shape: Numbers,
    coarse: bool,
) -> float:
    """Return the optical depth of a crown, one sphere if `coarse`, between two places on a ray."""
    radius, scale = tree[RADIUS], 2.0 / tree[HEIGHT]
    ou, ov, ow = (
        (point[0] - tree[X]) / radius,
        (point[1] - tree[Y]) / radius,
        (point[2] - tree[Z]) * scale,
    )
    du, dv, dw = ray[0] / radius, ray[1] / radius, ray[2] * scale
    square = du * du + dv * dv + dw * dw
    total = 0.0
    for n in range(1 if coarse else LOBES):
        if coarse:
            cu, cv, cw, size = 0.0, 0.0, 1.05, 0.82
        else:
            cu, cv, cw, size = shape[n, 0], shape[n, 1], shape[n, 2], shape[n, 3]
        middle = -((ou - cu) * du + (ov - cv) * dv + (ow - cw) * dw) / square
        pu, pv, pw = ou - cu + middle * du, ov - cv + middle * dv, ow - cw + middle * dw
        left = size * size - (pu * pu + pv * pv + pw * pw)
        if left > 0.0:
            half = math.sqrt(left / square)
            total += max(min(middle + half, end) - max(middle - half, begin), 0.0)
    return FOLIAGE_PER_M * total
