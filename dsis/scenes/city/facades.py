"""Walls with windows. Caches on disk: as `dsis.scenes.city.patterns`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel
from dsis.scenes.city.patterns import bars, fade, pick, smooth
from dsis.scenes.city.rays import Solid
from dsis.scenes.city.solids import BAY, BLIND, KIND, SEED, STOREY, WALL, Kind
from dsis.scenes.city.spot import COLOUR, GLASS, LIT, Vec

_HOUSE, _GLASS = int(Kind.HOUSE), int(Kind.GLASS)
SHOP_M, PARAPET_M = 4.2, 0.35


class Wall(NamedTuple):
    """A wall as a ray sees it.

    Attributes
    ----------
    u, v
        Place on the wall from its lower corner, metres.
    wide, tall
        Size of the wall, metres.
    pixel_u, pixel_v
        Size of a pixel on it, metres.
    view_u, view_v, sun_u, sun_v
        How far the view's ray and a ray towards the sun move along the wall for each metre of
        depth: windows lie back in the wall, so their reveals are seen and shade them.
    side
        1..4, as of `dsis.scenes.city.rays`.
    """

    u: float
    v: float
    wide: float
    tall: float
    pixel_u: float
    pixel_v: float
    view_u: float
    view_v: float
    sun_u: float
    sun_v: float
    side: int


class Grid(NamedTuple):
    """Windows in bays and storeys: place (p, q) counts them; lengths in metres, sizes in shares."""

    p: float
    q: float
    bay: float
    storey: float
    size_u: float
    size_v: float
    depth: float
    inside: float  # 1 where windows may be
    shop: bool


@kernel
def _sizes(kind: int, style: float, other: float) -> tuple[float, float, float, float]:
    """Return width, height, depth and lower edge of windows."""
    if kind == _HOUSE:
        return 0.36 + 0.16 * style, 0.50 + 0.12 * other, 0.24, 0.27
    if kind == _GLASS:
        return 0.93, 0.74 + 0.2 * style, 0.07, 0.03
    if style < 0.5:  # bands of windows
        return 0.95, 0.46, 0.2, 0.3
    return 0.62 + 0.2 * style, 0.52, 0.32, 0.26


@kernel
def _grid(s: Solid, wall: Wall, style: float, seed: int) -> Grid:
    """Divide a wall into bays and storeys; the ground floor of a house holds shops."""
    kind = int(s[KIND])
    foot = SHOP_M if kind == _HOUSE and s[STOREY] < 6 else 0.3
    margin = 0.5 if kind == _HOUSE else 0.15
    rise, run = wall.tall - foot - PARAPET_M, wall.wide - 2 * margin
    storey = rise / max(math.floor(rise / s[STOREY]), 1)
    bay = run / max(math.floor(run / s[BAY]), 1)
    size_u, size_v, depth, sill = _sizes(kind, style, pick(seed, 2, 5))
    across, up = (wall.u - margin) / bay, (wall.v - foot) / storey
    inside = 1.0 if 0 < across * bay < run and wall.v < wall.tall - 0.45 else 0.0
    if foot > 1 and wall.v < foot - 0.4:
        return Grid(across - 0.13, wall.v / foot - 0.05, bay, foot, 0.74, 0.74, 0.4, inside, True)
    p, q = across - 0.5 * (1 - size_u), up - sill
    return Grid(p, q, bay, storey, size_u, size_v, depth, inside, False)


@kernel
def _opening(g: Grid, wall: Wall, u: float, v: float, wider: float, taller: float) -> float:
    """Return the share of a pixel in windows widened on all sides, u and v metres away."""
    p, q = g.p + (u + wider) / g.bay, g.q + (v + taller) / g.storey
    return g.inside * (
        bars(p, g.size_u + 2 * wider / g.bay, wall.pixel_u / g.bay)
        * bars(q, g.size_v + 2 * taller / g.storey, wall.pixel_v / g.storey)
    )


@kernel
def _plaster(s: Solid, wall: Wall, g: Grid, style: float, seed: int) -> float:
    """Return how much lighter a wall is than its colour: dirt, mouldings, a cornice."""
    level = 1 + 0.06 * smooth(0.35 * wall.u, 0.22 * wall.v, seed) * fade(3.0, wall.pixel_u)
    level += 0.07 * smooth(1.9 * wall.u, 0.25 * wall.v, seed + 1) * fade(0.5, wall.pixel_u)
    level -= 0.16 * max(1 - wall.v / 2.5, 0.0)
    moulding = 0.0
    if wall.v > wall.tall - 0.5:
        moulding = 0.8
    elif s[KIND] == _HOUSE and s[STOREY] < 6:
        moulding = bars((wall.v - SHOP_M) / g.storey + 0.03, 0.05, wall.pixel_v / g.storey)
        moulding = 0.8 if SHOP_M - 0.4 < wall.v < SHOP_M else moulding
    return level * (1 + (0.16 if style < 0.6 else -0.24) * moulding)


@kernel
def _frame(g: Grid, wall: Wall, x: float, y: float) -> float:
    """Return the share of frames and bars at (x, y), 0..1 across a window."""
    rim = 0.07 / (g.bay * g.size_u)
    wide, tall = wall.pixel_u / (g.bay * g.size_u), wall.pixel_v / (g.storey * g.size_v)
    frame = max(1 - bars(2 * x - rim, 1 - 2 * rim, 2 * wide), 1 - bars(y - 0.04, 0.92, tall))
    return max(frame, bars(y - 0.62, 0.05, tall)) * fade(0.12, wall.pixel_u)


@kernel
def _pane(s: Solid, wall: Wall, g: Grid, style: float, seed: int) -> tuple[float, float, float]:
    """Return the grey and the blueness of what is seen in a window, and the share of bare glass."""
    kind = int(s[KIND])
    i, j = math.floor(g.p), math.floor(g.q)
    x = (g.p + g.depth * wall.view_u / g.bay - i) / g.size_u
    y = (g.q + g.depth * wall.view_v / g.storey - j) / g.size_v
    # what differs from window to window shows only where single windows do
    shown = fade(0.5, max(wall.pixel_u / g.bay, wall.pixel_v / g.storey))
    h = 0.5 + shown * (pick(i, j, seed + 11) - 0.5)
    if kind == _GLASS:
        return 0.02 + 0.1 * h**4, 0.01 + 0.02 * pick(seed, 6, 5), 1.0
    covered = _frame(g, wall, x, y) if kind == _HOUSE else 0.0
    if pick(i, j, seed + 13) < 0.3 and y > 1.6 * h - 0.45:
        covered = max(covered, 0.9 * shown)  # a blind
    room = 0.012 + 0.05 * h**3
    tone = 0.55 + 0.25 * pick(seed, 4, 5) if style < 0.75 else 0.12
    return room + covered * (tone - room), 0.0, 1 - 0.8 * covered


@kernel
def facade(s: Solid, wall: Wall, spot: NDArray[np.float64]) -> None:
    """Fill in what a wall shows: reflectance, glass, the share that its reveals leave in sun."""
    seed = int(s[SEED]) + 7919 * wall.side
    style = pick(seed, 1, 5)
    house = s[KIND] == _HOUSE
    g = _grid(s, wall, style, seed)
    level = _plaster(s, wall, g, style, seed)
    opening = _opening(g, wall, 0.0, 0.0, 0.0, 0.0)
    if house and wall.side < 3 and s[BLIND] > 0:  # a party wall: few windows
        opening *= 1.0 if pick(math.floor(g.p), math.floor(g.q), seed) > 0.8 else 0.0
    elif house and not g.shop and style > 0.66:  # shutters
        beside = 0.8 * (_opening(g, wall, 0.0, 0.0, 0.2 * g.bay, 0.0) - opening)
        tone = pick(seed, 3, 5)
        for c, paint in enumerate((0.10 + 0.2 * tone, 0.14 + 0.1 * tone, 0.12 + 0.05 * tone)):
            spot[COLOUR + c] = s[WALL + c] * level + beside * (paint - s[WALL + c] * level)
    elif house and not g.shop:  # stone around the windows
        beside = 0.35 * (_opening(g, wall, 0.0, 0.0, 0.14, 0.16) - opening)
        for c, paint in enumerate((0.75, 0.72, 0.66)):
            spot[COLOUR + c] = s[WALL + c] * level + beside * (paint - s[WALL + c] * level)
    if not house or g.shop or (wall.side < 3 and s[BLIND] > 0):
        for c in range(3):
            spot[COLOUR + c] = s[WALL + c] * level
    if opening <= 0.0:
        return
    view_u, view_v = g.depth * wall.view_u, g.depth * wall.view_v
    sun_u, sun_v = g.depth * wall.sun_u, g.depth * wall.sun_v
    pane = opening * _opening(g, wall, view_u, view_v, 0.0, 0.0)
    sunlit = _opening(g, wall, view_u + sun_u, view_v + sun_v, 0.0, 0.0)
    grey, blue, bare = _pane(s, wall, g, style, seed)
    tints: Vec = (grey, grey + 0.5 * blue, grey + blue)
    for c in range(3):
        reveal = 0.8 * (opening - pane) * s[WALL + c]
        spot[COLOUR + c] = (1 - opening) * spot[COLOUR + c] + reveal + pane * tints[c]
    spot[GLASS] = pane * bare
    spot[LIT] = 1 - opening * (1 - sunlit)
