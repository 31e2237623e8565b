"""What stands on the land: woods, hedges, single trees, a village with its church, farms.

Every candidate has a place on a lattice of the world and its own counter-based deviates, so what
stands in a direction does not depend on how much of the land is asked for.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from dsis.draw import Draw
from dsis.scenes.landscape.relief import LAKE_M, Relief

BROADLEAF, CONIFER, POPLAR, BUSH, HOUSE = range(5)
# Columns of the table of things; lengths in m.
(X, Y, Z, HEIGHT, RADIUS, KIND, VARIANT, TONE, HALF_X, HALF_Y, EAVES, PITCH_X, PITCH_Y, COS, SIN,
 RANGE) = range(16)  # fmt: skip
COLUMNS = 16
VARIANTS, LOBES = 12, 10  # crowns per kind, spheres per crown
WOODS_M, LAST_TREE_M = 7.0, 3400.0
FIELD_P_M, FIELD_Q_M = 150.0, 260.0
VILLAGES, HOUSES = 9, 46  # around the eye; buildings in each, a church and farms among them
Numbers = NDArray[np.float64]
OFFSET: Final = 1 << 20  # lattice places as counters: not negative


def things(relief: Relief, seed: int, first_rad: float, last_rad: float) -> Numbers:
    """Return all that stands between two azimuths, float64 (thing, COLUMNS), nearest first."""
    draw = Draw(seed, ("scenes", "landscape"))
    sector = (first_rad, last_rad)
    houses = _villages(relief, draw)  # all around: none may stand in a tree of the sector
    trees = np.concatenate(
        [
            _woods(relief, draw, sector),
            _hedges(relief, draw, sector),
            _single_trees(relief, draw, sector),
            _foreground(relief, draw, sector),
        ]
    )
    inside = _within(houses[:, X], houses[:, Y], 300, 1e9, sector)
    table = np.concatenate([trees[_free(trees, houses)], houses[inside]])
    table[:, RANGE] = np.hypot(table[:, X], table[:, Y])
    return table[np.argsort(table[:, RANGE], kind="stable")]


def _lattice(
    draw: Draw, purpose: str, spacing: float, near: float, far: float, sector: tuple[float, float]
) -> tuple[Numbers, Numbers, Numbers]:
    """Return jittered places x, y within a sector of rings, and their deviates (4, place)."""
    count = int(far / spacing) + 2
    line = np.arange(-count, count + 1)
    i, j = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    inside = _within(i * spacing, j * spacing, near, far, sector)
    places = np.stack([i[inside] + OFFSET, j[inside] + OFFSET, np.zeros(inside.sum(), np.int64)])
    deviates = np.concatenate(
        [draw.scattered(f"{purpose} {n}", places.astype(np.int64)) for n in range(3)]
    )
    x = (i[inside] + 0.9 * (deviates[0] - 0.5)) * spacing
    y = (j[inside] + 0.9 * (deviates[1] - 0.5)) * spacing
    return x, y, deviates[2:]


def _within(
    x: NDArray[np.floating],
    y: NDArray[np.floating],
    near: float,
    far: float,
    sector: tuple[float, float],
) -> NDArray[np.bool_]:
    away = np.hypot(x, y)
    after = (np.arctan2(x, y) - sector[0]) % (2 * np.pi)
    inside: NDArray[np.bool_] = (away >= near) & (away < far) & (after <= sector[1] - sector[0])
    return inside


def _rows(x: Numbers, y: Numbers, z: Numbers, **columns: Numbers | float) -> Numbers:
    table = np.zeros((x.size, COLUMNS))
    table[:, X], table[:, Y], table[:, Z] = x, y, z
    names = {"height": HEIGHT, "radius": RADIUS, "kind": KIND, "variant": VARIANT, "tone": TONE,
             "half_x": HALF_X, "half_y": HALF_Y, "eaves": EAVES, "pitch_x": PITCH_X,
             "pitch_y": PITCH_Y, "turn": COS}  # fmt: skip
    for name, values in columns.items():
        table[:, names[name]] = values
    turn = table[:, COS].copy()
    table[:, COS], table[:, SIN] = np.cos(turn), np.sin(turn)
    return table


def _trees(
    relief: Relief, x: Numbers, y: Numbers, tall: Numbers, kind: Numbers, u: Numbers
) -> Numbers:
    """Return rows of trees; their girth follows from kind and height."""
    girth = np.choose(kind.astype(int), [0.40, 0.19, 0.13, 0.62]) * (0.85 + 0.3 * u)
    shape = kind * VARIANTS + np.floor(u * 997 % 1 * VARIANTS)
    z = relief.at(relief.height, x, y) - 0.1
    return _rows(
        x, y, z, height=tall, radius=tall * girth, kind=kind, variant=shape, tone=u * 113 % 1
    )


def _woods(relief: Relief, draw: Draw, sector: tuple[float, float]) -> Numbers:
    x, y, (a, b, c, d) = _lattice(draw, "woods", WOODS_M, 230, LAST_TREE_M, sector)
    wood = relief.at(relief.wood, x, y)
    taken = (wood > 0.02) & (a < 0.93) & (relief.at(relief.height, x, y) > LAKE_M + 1.2)
    x, y, b, c, d, wood = x[taken], y[taken], b[taken], c[taken], d[taken], wood[taken]
    stand = np.sin(x / 170 + 2) * np.sin(y / 210) + 0.6 * (c - 0.5)
    kind = np.where(stand > 0.15, CONIFER, BROADLEAF).astype(float)
    tall = (9 + 9 * np.minimum(4 * wood, 1) + 7 * b) * np.where(kind == CONIFER, 1.15, 0.9)
    return _trees(relief, x, y, tall, kind, d)


def _hedges(relief: Relief, draw: Draw, sector: tuple[float, float]) -> Numbers:
    """Return bushes and trees along the borders of fields and the shore."""
    x, y, (a, b, c, d) = _lattice(draw, "hedges", 3.6, 230, 2300, sector)
    p, q = borders(x, y)
    edge_p, edge_q = np.abs(p - np.round(p)) * FIELD_P_M, np.abs(q - np.round(q)) * FIELD_Q_M
    height = relief.at(relief.height, x, y)
    keep_p = np.sin(12.9 * np.round(p) + 78.2 * np.floor(q)) > -0.1  # which borders have a hedge
    keep_q = np.sin(31.7 * np.round(q) + 17.3 * np.floor(p)) > 0.2
    hedge = ((edge_p < 2.4) & keep_p) | ((edge_q < 2.4) & keep_q)
    shore = (height < LAKE_M + 2.6) & (a < 0.12)
    taken = (hedge | shore) & (height > LAKE_M + 0.5) & (relief.at(relief.wood, x, y) < 0)
    x, y, a, b, c, d = (v[taken] for v in (x, y, a, b, c, d))
    tree = b > 0.88
    kind = np.where(tree, np.where(c > 0.8, POPLAR, BROADLEAF), BUSH).astype(float)
    tall = np.where(tree, 9 + 10 * a, 2.2 + 2.6 * c * c)
    return _trees(relief, x, y, tall, kind, d)


def borders(x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
    """Return coordinates whose whole numbers are the borders of fields."""
    p = (0.8 * x - 0.6 * y) / FIELD_P_M + 0.3 * np.sin(x / 210 + 1) + 0.2 * np.sin(y / 330)
    q = (0.6 * x + 0.8 * y) / FIELD_Q_M + 0.2 * np.sin(y / 270 + 2)
    return p, q


def _single_trees(relief: Relief, draw: Draw, sector: tuple[float, float]) -> Numbers:
    x, y, (a, b, c, d) = _lattice(draw, "single", 85.0, 250, 2600, sector)
    taken = (a < 0.4) & (relief.at(relief.wood, x, y) < 0)
    taken &= relief.at(relief.height, x, y) > LAKE_M + 1
    x, y, b, c, d = (v[taken] for v in (x, y, b, c, d))
    kind = np.where(c > 0.85, POPLAR, BROADLEAF).astype(float)
    return _trees(relief, x, y, 7 + 11 * b, kind, d)


def _foreground(relief: Relief, draw: Draw, sector: tuple[float, float]) -> Numbers:
    """Return the trees and bushes on the meadow, a few in every part of the view."""
    part = np.arange(28)
    places = np.stack(np.broadcast_arrays(part[:, None], np.arange(4)[None], 0), 0).reshape(3, -1)
    a, b = draw.scattered("near", places)
    c, d = draw.scattered("near size", places)
    lone = places[1] == 0
    middle = draw.scattered("near group", np.stack([places[0], 0 * places[0], 0 * places[0]]))
    azimuth = (
        2 * np.pi / 28 * (places[0] + 0.15 + 0.7 * middle[0] + np.where(lone, 0, 0.3 * (a - 0.5)))
    )
    away = 50 + 70 * middle[1] + np.where(lone, 0, 14 * (b - 0.5))
    x, y = away * np.sin(azimuth), away * np.cos(azimuth)
    kind = np.where(lone, BROADLEAF, BUSH).astype(float)
    taken = _within(x, y, 0, 1e9, sector) & (lone | (c < 0.75)) & (middle[0] < 0.72)
    tall = np.where(lone, 7.5 + 6.5 * c, 1.3 + 1.5 * d)
    return _trees(relief, *(v[taken] for v in (x, y, tall, kind, d)))


def _villages(relief: Relief, draw: Draw) -> Numbers:
    """Return houses around a church in every part of the view, and farms."""
    places = np.stack(
        np.broadcast_arrays(np.arange(VILLAGES)[:, None], np.arange(HOUSES)[None], 0), 0
    ).reshape(3, -1)
    a, b = draw.scattered("house place", places)
    c, d = draw.scattered("house size", places)
    e, f = draw.scattered("house turn", places)
    g, h = draw.scattered("village", places * np.array([[1], [0], [0]]))
    number, part = places[1], 2 * np.pi / VILLAGES
    azimuth, away = part * (places[0] + 0.25 + 0.5 * g), 1250 + 500 * h
    church, nave, farm = number == 0, number == 1, number >= HOUSES - 6
    spread = np.where(church | nave, 0.0, 28 + 150 * np.sqrt(a))
    x = away * np.sin(azimuth) + 1.5 * spread * np.cos(2 * np.pi * b) + np.where(nave, 13.0, 0)
    y = away * np.cos(azimuth) + spread * np.sin(2 * np.pi * b)
    lone, reach = part * (places[0] + a), 330 + 900 * b
    x, y = np.where(farm, reach * np.sin(lone), x), np.where(farm, reach * np.cos(lone), y)
    z = relief.at(relief.height, x, y)
    half_x = np.where(church, 3.2, np.where(nave, 10.5, 5 + 4.5 * c))
    half_y = np.where(church, 3.2, np.where(nave, 5.2, 3.6 + 1.6 * d))
    eaves = np.where(church, 23.0, np.where(nave, 8.5, 3.2 + 2.8 * e))
    pitch_y = np.where(church, 4.6, np.where(nave, 1.3, 0.75 + 0.45 * f))
    turn = np.where(church | nave, 0.0, np.where(e < 0.5, 0, np.pi / 2) + 0.5 * (f - 0.5))
    table = _rows(
        x,
        y,
        z - 1.0,
        height=eaves + pitch_y * half_y,
        radius=np.hypot(half_x, half_y),
        kind=float(HOUSE),
        variant=number.astype(float),
        tone=np.where(church | nave, 0.02, c * 31 % 1),
        half_x=half_x,
        half_y=half_y,
        eaves=eaves,
        pitch_x=np.where(church, 4.6, 0.0),
        pitch_y=pitch_y,
        turn=turn,
    )
    return table[z > LAKE_M + 1.5]


def _free(trees: Numbers, houses: Numbers) -> NDArray[np.bool_]:
    """Return which trees do not stand in a house."""
    gap, nearest = KDTree(houses[:, :Z]).query(trees[:, :Z])
    free: NDArray[np.bool_] = gap > houses[nearest, RADIUS] + 0.6 * trees[:, RADIUS]
    return free
