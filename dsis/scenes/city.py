"""City: blocks of houses, towers and parks, seen from 62 m above the streets."""

import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from dsis.scenes import sky
from dsis.scenes.building import STREET_M, Building
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.tree import Tree
from dsis.scenes.view import Point, View

EYE_M = 62.0
PITCH_M = (98.0, 82.0)  # of the street grid
GRID_RAD = -0.3  # one street runs straight away from the eye, at this azimuth to the right
NEAREST_M, HOUSES_M, FARTHEST_M = 150.0, 800.0, 2900.0


class Thing(Protocol):
    """What stands in the city."""

    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    def occluder(self) -> list[Point]: ...
    def paint(self, view: View, texture: Texture, azimuth: float, lowest_row: float) -> None: ...


def paint(image: Field, seed: int) -> None:
    """Paint the city of a seed into float32 (row, column, 3)."""
    rows = image.shape[0]
    view = View(image, focal_px=2.75 * rows, horizon_row=0.28 * rows, eye_m=EYE_M)
    texture = Texture.of(np.random.Generator(np.random.PCG64(seed)))
    sky.paint(view, texture, cover=0.38)
    _hills(view, texture)
    _ground(view, texture)
    for thing, azimuth, lowest_row in reversed(list(_visible(view, _layout(seed, view)))):
        thing.paint(view, texture, azimuth, lowest_row)


def _visible(view: View, things: list[Thing]) -> Iterator[tuple[Thing, float, float]]:
    """Yield, from near to far, (thing, azimuth, row below which nearer things hide it)."""
    skyline = np.full(view.image.shape[1], np.inf)
    for thing in sorted(things, key=lambda thing: math.hypot(thing.x, thing.y)):
        distance = math.hypot(thing.x, thing.y)
        for azimuth in view.turns(math.atan2(thing.x, thing.y), 60 / distance):
            solid = [view.project(point, azimuth) for point in thing.occluder()]
            columns = [c for c, _ in solid] or [azimuth * view.focal_px]
            margin = 0 if solid else math.ceil(8 * view.focal_px / distance)
            first = max(math.floor(min(columns)) - 1 - margin, 0)
            last = max(math.ceil(max(columns)) + 1 + margin, 0)
            behind = skyline[first:last]
            if not behind.size:
                continue
            yield thing, azimuth, float(behind.max()) + 1
            inner = behind[2:-2]
            if solid:
                np.minimum(inner, max(r for _, r in solid) + 1, out=inner)


def _hills(view: View, texture: Texture) -> None:
    """Paint two wooded ridges behind the city."""
    azimuth = view.azimuths()
    rows = np.arange(view.image.shape[0], dtype=np.float32)[:, None]
    for height, distance, salt in ((0.022, 16000.0, 0.0), (0.013, 9000.0, 50.0)):
        profile = texture.fractal(azimuth * 5 + salt, np.float32([[salt]]), 7, 5 / view.focal_px)
        ridge = view.horizon_row - view.focal_px * height * (0.5 + 0.5 * profile)
        first, last = int(ridge.min()) - 1, int(view.horizon_row + 0.008 * view.focal_px)
        cover = np.clip(rows[first:last] + 1 - ridge, 0, 1)
        green = np.array([0.05, 0.08, 0.03], np.float32)
        slope = view.slopes(first, last)
        speck = texture.fractal(azimuth * 300 + salt, slope * 700, 4, 300 / view.focal_px)
        colour = (1 + np.float32(0.5) * speck)[..., None] * green
        air = np.full(cover.shape, distance, np.float32)
        view.blend(first, 0, sky.hazed(colour, air), cover)


def _ground(view: View, texture: Texture) -> None:
    """Paint streets and courts in deep shadow from the horizon down, in bands of rows."""
    azimuth = view.azimuths()
    start = math.ceil(view.horizon_row + view.focal_px * EYE_M / 9000)
    along = azimuth + np.float32(GRID_RAD)
    for first in range(start, view.image.shape[0], sky.ROWS_AT_ONCE):
        last = min(first + sky.ROWS_AT_ONCE, view.image.shape[0])
        distance = EYE_M / -view.slopes(first, last)
        a = distance * np.sin(along) / np.float32(PITCH_M[0])
        b = distance * np.cos(along) / np.float32(PITCH_M[1])
        pixel = distance * distance / np.float32(EYE_M * view.focal_px)  # along the view
        fa = (np.abs(np.sin(along)) * pixel + distance / view.focal_px) / PITCH_M[0]
        fb = (np.abs(np.cos(along)) * pixel + distance / view.focal_px) / PITCH_M[1]
        built = pulse(a, 1 - STREET_M / PITCH_M[0], fa) * pulse(b, 1 - STREET_M / PITCH_M[1], fb)
        kerb = pulse(a, 1 - 9 / PITCH_M[0], fa) * pulse(b, 1 - 9 / PITCH_M[1], fb)
        line = 1 - (1 - pulse(a + 0.5, 0.3 / PITCH_M[0], fa)) * (
            1 - pulse(b + 0.5, 0.3 / PITCH_M[1], fb)
        )
        stain = texture.fractal(a * 14, b * 14, 4, pixel / 7)
        grey = 0.012 + 0.024 * kerb + (line * 0.05) * pulse(a * 12 + b * 12, 0.5, 12 * (fa + fb))
        street = grey[..., None] * np.array([0.9, 1.0, 1.15], np.float32)
        court = np.array([0.008, 0.011, 0.005], np.float32)
        colour = (street + built[..., None] * (court - street)) * (1 + 0.4 * stain[..., None])
        roofs = (0.10 + 0.06 * stain)[..., None] * np.array([1.1, 0.95, 0.75], np.float32)
        colour += step(distance, FARTHEST_M * 0.7, FARTHEST_M)[..., None] * (roofs - colour)
        view.image[first:last] = sky.hazed(colour, np.broadcast_to(distance, stain.shape))


def _layout(seed: int, view: View) -> list[Thing]:
    """Return what may be in view; the content of a block depends on the seed and block alone."""
    things: list[Thing] = []
    width = view.image.shape[1] / view.focal_px
    reach = math.ceil(FARTHEST_M / min(PITCH_M))
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            a, b = (i + 0.5) * PITCH_M[0], (j + 0.5) * PITCH_M[1]
            distance = math.hypot(a, b)
            margin = 65 / max(distance, 65)
            azimuth = (math.atan2(a, b) - GRID_RAD + margin) % math.tau
            if NEAREST_M < distance < FARTHEST_M and azimuth < width + 2 * margin:
                rng = np.random.Generator(np.random.PCG64([seed, i + 1000, j + 1000]))
                things += _block(rng, a, b, distance)
    return things


def _block(rng: np.random.Generator, a: float, b: float, distance: float) -> list[Thing]:
    """Return the buildings and trees of the block centred at (a, b) of the street grid."""
    u, v = (PITCH_M[0] - STREET_M) / 2, (PITCH_M[1] - STREET_M) / 2
    c, s = math.cos(GRID_RAD), math.sin(GRID_RAD)
    things: list[Thing] = []

    def place(da: float, db: float) -> tuple[float, float]:
        return c * (a + da) - s * (b + db), s * (a + da) + c * (b + db)

    def build(da, db, wide, deep, tall, roof, surface, quarter=False) -> None:
        x, y = place(da, db)
        yaw = GRID_RAD + (math.pi / 2 if quarter else 0)
        things.append(Building(x, y, yaw, wide, deep, 0, tall, roof, surface, rng.random()))

    def drive(da: float, db: float) -> None:
        x, y = place(da, db)
        style = rng.random()
        things.append(Building(x, y, GRID_RAD, 1.8, 4.4, 0.3, 0.95, "flat", "car", style))
        things.append(Building(x, y, GRID_RAD, 1.5, 2.2, 0.9, 1.5, "flat", "cabin", style))

    def plant(da: float, db: float, low: float, high: float) -> None:
        x, y = place(da, db)
        things.append(Tree(x, y, 0, rng.uniform(low, high), rng.random()))

    kind = rng.random()
    if kind < 0.09:  # a park
        for _ in range(24 if distance < HOUSES_M else 8):
            plant(rng.uniform(-u, u), rng.uniform(-v, v), 9, 19)
    elif kind < 0.19 and distance > 450:  # a tower
        surface = rng.choice(["glass", "house"])
        build(0, 5, rng.uniform(18, 34), rng.uniform(18, 30), rng.uniform(38, 105), "flat", surface)
        build(0, -24, 70, 14, rng.uniform(9, 16), "flat", "glass")
    elif kind < 0.24 and distance > 350:  # a church
        build(8, 0, 42, 18, 17, "gable", "house")
        build(-18, 0, 9, 9, rng.uniform(34, 42), "spire", "house")
    elif distance > HOUSES_M:  # rows of houses, in one piece
        for db in (-v + 7, v - 7):
            for da in (-u / 2, u / 2):
                roof = rng.choice(["gable", "flat"])
                build(da, db, u, 13, rng.uniform(12, 23), roof, "house")
    else:
        for db in (-v + 6, v - 6):
            da = -u
            while da < u - 8:
                wide = min(rng.uniform(11, 21), u - da)
                roof = rng.choice(["gable", "gable", "gable", "flat"])
                build(da + wide / 2, db, wide, 12, rng.uniform(11.5, 20), roof, "house")
                da += wide
        for da in (-u + 6, u - 6):
            for db in (-v / 2 + 3, v / 2 - 3):
                roof = rng.choice(["gable", "flat"])
                build(da, db, v - 6, 12, rng.uniform(11.5, 19), roof, "house", quarter=True)
        for _ in range(4):
            plant(rng.uniform(-u + 16, u - 16), rng.uniform(-8, 8), 9, 17)
    if distance < HOUSES_M:
        for db in np.arange(-v, v, 9.0):
            if rng.random() < 0.6:
                plant(-u - 3.5, float(db), 6, 10)
            lane = float(rng.choice([-2.2, 2.2, 5.6, -5.6]))
            if rng.random() < 0.5:
                drive(-u - STREET_M / 2 + lane, float(db))
    return things
