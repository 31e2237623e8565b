"""City: blocks of houses and towers, seen from 62 m above the streets."""

import math
from dataclasses import dataclass

import numpy as np

from dsis.scenes import sky, tree
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.view import Point, View

EYE_M = 62.0
PITCH_M = (98.0, 82.0)  # of the street grid
STREET_M = 17.0
GRID_RAD = 0.52  # how far the grid is turned
NEAREST_M, HOUSES_M, FARTHEST_M = 150.0, 900.0, 3200.0
SUN = sky.sun_direction(-1.75, 0.62)
PLASTER = np.array(
    [
        [0.72, 0.66, 0.52], [0.80, 0.77, 0.70], [0.62, 0.44, 0.26], [0.55, 0.50, 0.45],
        [0.70, 0.58, 0.38], [0.36, 0.17, 0.11], [0.66, 0.52, 0.44], [0.48, 0.55, 0.50],
        [0.86, 0.85, 0.82], [0.42, 0.40, 0.39],
    ],
    np.float32,
)  # fmt: skip
ROOFS = np.array(
    [[0.34, 0.13, 0.07], [0.27, 0.10, 0.06], [0.13, 0.13, 0.15], [0.40, 0.18, 0.10]], np.float32
)
GLASS = np.array(
    [
        [0.010, 0.012, 0.014], [0.006, 0.007, 0.008], [0.10, 0.13, 0.17], [0.03, 0.04, 0.05],
        [0.22, 0.27, 0.34], [0.05, 0.06, 0.07], [0.45, 0.42, 0.36], [0.012, 0.012, 0.012],
    ],
    np.float32,
)  # fmt: skip
LAMP = np.array([0.75, 0.48, 0.20], np.float32)
GLINT = np.array([3.6, 3.1, 2.3], np.float32)


@dataclass(frozen=True)
class Building:
    """A box with a roof; lengths in metres, `style` in 0..1 tells everything else."""

    x: float
    y: float
    wide: float
    deep: float
    eaves: float
    roof: str  # flat, gable, spire
    style: float
    base: float = 0.0


def paint(image: Field, seed: int) -> None:
    """Paint the city for a seed into float32 (row, column, 3)."""
    rows = image.shape[0]
    view = View(image, focal_px=2.75 * rows, horizon_row=0.27 * rows, eye_m=EYE_M)
    texture = Texture.of(np.random.Generator(np.random.PCG64(seed)))
    sky.paint(view, texture, cover=0.45)
    _hills(view, texture)
    _ground(view, texture)
    things = _layout(seed, image.shape[1] / view.focal_px)
    things.sort(key=lambda thing: -math.hypot(thing.x, thing.y))
    for thing in things:
        azimuth = math.atan2(thing.x, thing.y) % math.tau
        for turn in view.turns(azimuth, 60 / math.hypot(thing.x, thing.y)):
            if thing.roof == "tree":
                foot = (thing.x, thing.y, thing.base)
                tree.paint(view, texture, foot, turn, thing.eaves, thing.style)
            else:
                _building(view, texture, thing, turn)


def _hills(view: View, texture: Texture) -> None:
    """Paint two wooded ridges behind the city."""
    azimuth = view.azimuths()
    rows = np.arange(view.image.shape[0], dtype=np.float32)[:, None]
    for height, distance, salt in ((0.020, 16000.0, 0.0), (0.013, 8000.0, 50.0)):
        profile = texture.fractal(azimuth * 5 + salt, np.float32([[salt]]), 7, 5 / view.focal_px)
        ridge = view.horizon_row - view.focal_px * height * (0.5 + 0.5 * profile)
        first, last = int(ridge.min()) - 1, int(view.horizon_row) + 2
        cover = np.clip(rows[first:last] + 1 - ridge, 0, 1)
        green = np.array([0.05, 0.08, 0.03], np.float32)
        slope = view.slopes(first, last)
        speck = texture.fractal(azimuth * 300 + salt, slope * 700, 4, 300 / view.focal_px)
        colour = (1 + np.float32(0.5) * speck)[..., None] * green
        air = np.full(cover.shape, distance, np.float32)
        view.blend(first, 0, sky.hazed(colour, air), cover)


def _ground(view: View, texture: Texture) -> None:
    """Paint streets and courts from the horizon down, in bands of rows."""
    azimuth = view.azimuths()
    start = math.ceil(view.horizon_row + view.focal_px * EYE_M / 12000)
    for first in range(start, view.image.shape[0], sky.ROWS_AT_ONCE):
        last = min(first + sky.ROWS_AT_ONCE, view.image.shape[0])
        distance = EYE_M / -view.slopes(first, last)
        a = distance * np.sin(azimuth + np.float32(GRID_RAD)) / np.float32(PITCH_M[0])
        b = distance * np.cos(azimuth + np.float32(GRID_RAD)) / np.float32(PITCH_M[1])
        deep = distance * distance / np.float32(EYE_M * view.focal_px)  # a pixel, along the view
        built = pulse(a, 1 - STREET_M / PITCH_M[0], deep / 98) * pulse(
            b, 1 - STREET_M / PITCH_M[1], deep / 82
        )
        stain = texture.fractal(a * 14, b * 14, 4, deep / 7)
        street = np.array([0.030, 0.031, 0.033], np.float32)
        court = np.array([0.012, 0.014, 0.008], np.float32)
        far = step(distance, FARTHEST_M * 0.7, FARTHEST_M)[..., None]
        colour = (street + built[..., None] * (court - street)) * (1 + 0.4 * stain[..., None])
        roofs = (0.12 + 0.07 * stain)[..., None] * np.array([1.1, 0.95, 0.75], np.float32)
        colour += far * (roofs - colour)
        air = np.broadcast_to(distance, stain.shape)
        view.image[first:last] = sky.hazed(colour, air)


def _layout(seed: int, width_rad: float) -> list[Building]:
    """Return everything that may be in view; a block's content depends on seed and block alone."""
    things: list[Building] = []
    reach = math.ceil(FARTHEST_M / min(PITCH_M))
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            x, y = _turned((i + 0.5) * PITCH_M[0], (j + 0.5) * PITCH_M[1])
            distance = math.hypot(x, y)
            margin = 65 / max(distance, 65)
            azimuth = (math.atan2(x, y) + margin) % math.tau
            if NEAREST_M < distance < FARTHEST_M and azimuth < width_rad + 2 * margin:
                rng = np.random.Generator(np.random.PCG64([seed, i + 1000, j + 1000]))
                things += _block(rng, (i + 0.5) * PITCH_M[0], (j + 0.5) * PITCH_M[1], distance)
    return things


def _turned(a: float, b: float) -> tuple[float, float]:
    """Return world (x, y) of a point of the street grid."""
    c, s = math.cos(GRID_RAD), math.sin(GRID_RAD)
    return c * a - s * b, s * a + c * b


def _block(rng: np.random.Generator, a: float, b: float, distance: float) -> list[Building]:
    """Return the buildings and trees of one block, centred at (a, b) of the street grid."""
    half = ((PITCH_M[0] - STREET_M) / 2, (PITCH_M[1] - STREET_M) / 2)
    kind, things = rng.random(), []

    def add(da: float, db: float, wide: float, deep: float, tall: float, roof: str) -> None:
        x, y = _turned(a + da, b + db)
        things.append(Building(x, y, wide, deep, tall, roof, rng.random()))

    if kind < 0.10:  # a park
        for _ in range(26 if distance < HOUSES_M else 10):
            da, db = (rng.uniform(-h, h) for h in half)
            add(da, db, 0, 0, rng.uniform(9, 19), "tree")
    elif kind < 0.2 and distance > 450:  # a tower
        add(0, 0, rng.uniform(18, 34), rng.uniform(18, 30), rng.uniform(38, 105), "flat")
        add(0, -24, 70, 14, rng.uniform(9, 16), "flat")
    elif kind < 0.25 and distance > 350:  # a church
        add(0, 0, 42, 18, 17, "gable")
        add(-26, 0, 9, 9, rng.uniform(34, 42), "spire")
    elif distance > HOUSES_M:  # rows of houses, in one piece
        for db in (-half[1] + 7, half[1] - 7):
            for da in (-half[0] / 2, half[0] / 2):
                add(da, db, half[0], 13, rng.uniform(12, 24), rng.choice(["gable", "flat"]))
    else:
        for db in (-half[1] + 6, half[1] - 6):
            da = -half[0]
            while da < half[0] - 8:
                wide = min(rng.uniform(11, 21), half[0] - da)
                roof = rng.choice(["gable", "gable", "gable", "flat"])
                add(da + wide / 2, db, wide, 12, rng.uniform(11.5, 20), roof)
                da += wide
        for da in (-half[0] + 6, half[0] - 6):
            for db in (-half[1] / 3, half[1] / 3):
                add(da, db, 12, 2 * half[1] / 3 - 8, rng.uniform(11, 19), "flat")
        for da in np.arange(-half[0], half[0], 11.0):
            if rng.random() < 0.5:
                add(float(da), -half[1] - 4, 0, 0, rng.uniform(7, 11), "tree")
    return things


def _building(view: View, texture: Texture, house: Building, azimuth: float) -> None:
    """Paint the walls and the roof of one building, and what stands on it."""
    c, s = math.cos(GRID_RAD), math.sin(GRID_RAD)
    w, d = house.wide / 2, house.deep / 2
    plan = [(-w, -d), (w, -d), (w, d), (-w, d)]
    foot = [(house.x + c * a - s * b, house.y + s * a + c * b) for a, b in plan]
    top = house.eaves
    rise = {"flat": 0.0, "gable": d * (0.6 + 0.5 * house.style), "spire": 3.2 * w}[house.roof]
    ridge: list[Point] = []
    for a in (-w, w) if house.roof == "gable" else (0.0, 0.0):
        ridge.append((house.x + c * a, house.y + s * a, top + rise))
    for k in range(4):
        (x0, y0), (x1, y1) = foot[k], foot[(k + 1) % 4]
        wall: list[Point] = [(x0, y0, house.base), (x1, y1, house.base), (x1, y1, top), (x0, y0, top)]
        if house.roof == "gable" and k % 2:
            wall.insert(3, ridge[1 if k == 1 else 0])
        normal = ((y1 - y0), (x0 - x1), 0.0)
        length = math.hypot(normal[0], normal[1])
        sunny = (normal[0] * SUN[0] + normal[1] * SUN[1]) / length
        view.facet(wall, azimuth, _facade(texture, house, sunny, length, k))
    if house.roof == "flat":
        view.facet([(x, y, top) for x, y in foot], azimuth, _flat_roof(texture, house))
    for k in range(4):
        (x0, y0), (x1, y1) = foot[k], foot[(k + 1) % 4]
        eave: list[Point] = [(x0, y0, top), (x1, y1, top)]
        peak = [ridge[1], ridge[0]] if k == 0 else [ridge[0], ridge[1]]
        if house.roof == "spire":
            view.facet([*eave, ridge[0]], azimuth, _tiles(texture, house, k))
        elif house.roof == "gable" and k in (0, 2):
            view.facet([*eave, *peak], azimuth, _tiles(texture, house, k))


def _facade(texture: Texture, house: Building, sunny: float, length: float, side: int):
    """Return the shade of a wall; `sunny` is the cosine between its normal and the level sun."""
    style, salt = house.style, int(1e4 * house.style) + 31 * side
    plaster = PLASTER[int(style * 997) % len(PLASTER)]
    glazed = house.eaves > 30 and house.roof == "flat" and style < 0.6
    storey = 3.1 + 0.8 * ((style * 71) % 1)
    bays = max(round(length / (2.1 + 1.3 * ((style * 37) % 1))), 1)
    duty_u, duty_v = (0.9, 0.72) if glazed else (0.36 + 0.16 * ((style * 17) % 1), 0.56)
    direct = max(sunny, 0.0) * math.hypot(SUN[0], SUN[1])
    shadow_m = 15 + 5 * style - STREET_M * SUN[2] / max(direct, 0.05)
    glinting = sunny > 0 and (style * 53) % 1 < 0.18

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        v = v + np.float32(house.base)
        floors = (v - np.float32(0.6)) / np.float32(storey)
        axis = u * np.float32(bays / length)
        fu, fv = pixel_u * bays / length, pixel_v / storey
        edge = shadow_m + 1.2 * texture.cell(u / 9 + salt, u * 0)
        lit = direct * step(v - edge, -0.3, 0.3 + pixel_v)
        open_sky = 0.12 + 0.88 * step(v, -2.0, 26.0)
        under_eaves = 1 - 0.45 * pulse((v - house.eaves + 0.9) / 60 + 0.5, 1 / 60, pixel_v / 60)
        dirt = 1 + 0.07 * texture.fractal(u / 5 + salt, v / 7, 3, pixel_v / 5)
        pane_u, pane_v = pulse(axis, duty_u, fu), pulse(floors, duty_v, fv)
        below_roof = step(house.eaves - 0.7 - v, 0, 0.05 + pixel_v)
        glass = pane_u * pane_v * below_roof
        trim = pulse(axis, duty_u + 0.12, fu) * pulse(floors, duty_v + 0.10, fv) * below_roof
        bars = pulse(axis, 0.03, fu) if not glazed else np.float32(0)
        albedo = plaster * dirt[..., None]
        frame = np.float32(0.25 if glazed else 0.78)
        albedo += (trim * np.float32(0.8))[..., None] * (frame - albedo)
        light = lit[..., None] * sky.SUN + (open_sky * under_eaves)[..., None] * sky.AMBIENT
        colour = albedo * light
        # One pane or another: fades to the mean pane where a pixel holds several.
        several = min(max(1.6 * max(fu, fv) - 0.4, 0.0), 1.0)
        pick = texture.cell(axis, floors, salt)
        pane = GLASS.take(((pick + 1) * 3.999).astype(np.int32), axis=0)
        pane = pane + np.float32(several) * (GLASS.mean(axis=0) - pane)
        mirror = (0.35 + 0.65 * step(v, 0, 40))[..., None] if glazed else np.float32(1)
        pane = pane * mirror * (1 - 0.7 * pulse(floors + 0.36, 0.2, fv)[..., None])
        other = texture.cell(axis + 13, floors + 5, salt)
        pane = np.where((other > 0.97)[..., None], LAMP * (1 - np.float32(several)), pane)
        if glinting:
            flash = np.float32(1 - several) * (other < -0.9)
            pane = pane + flash[..., None] * (GLINT - pane)
        glass = (glass * (1 - bars))[..., None]
        return sky.hazed(colour + glass * (pane - colour), distance)

    return shade


def _tiles(texture: Texture, house: Building, side: int):
    """Return the shade of a pitched roof: rows of tiles, stains, roof lights."""
    colour = ROOFS[int(house.style * 613) % len(ROOFS)]
    sunward = (0.25, 1.0, 0.9, 0.2)[(side + 1) % 4]

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        salt = np.float32(90 * house.style)
        rows = 1 - 0.22 * pulse(v / 0.42, 0.3, pixel_v / 0.42)
        stain = 1 + 0.22 * texture.fractal(u / 2.5 + salt, v / 4 + salt, 5, pixel_v / 2.5)
        light = sky.SUN * np.float32(sunward) + sky.AMBIENT
        tiled = (rows * stain)[..., None] * (2.0 * colour * light)
        windows = pulse(u / 3.4, 0.3, pixel_u / 3.4) * pulse(v / 3.1 - 0.2, 0.38, pixel_v / 3.1)
        windows = windows * (texture.cell(u / 3.4, v / 3.1 - 0.2, int(salt)) > 0.35)
        pane = sky.clear(np.full(v.shape, 0.1, np.float32)) * np.float32(0.5)
        return sky.hazed(tiled + windows[..., None] * (pane - tiled), distance)

    return shade


def _flat_roof(texture: Texture, house: Building):
    """Return the shade of a flat roof: gravel, parapet, patches."""

    def shade(u: Field, v: Field, distance: Field, pixel_u: float, pixel_v: float) -> Field:
        salt = np.float32(90 * house.style)
        patch = texture.fractal(u / 5 + salt, v / 5 + salt, 5, pixel_v / 5)
        border = np.minimum(np.minimum(u, house.wide - u), np.minimum(v, house.deep - v))
        rim = step(0.5 - border, 0, 0.05 + pixel_v)
        grey = 0.16 + 0.12 * house.style + 0.05 * patch + 0.25 * rim
        light = (sky.SUN * np.float32(SUN[2]) + sky.AMBIENT) * np.float32(1.3)
        return sky.hazed(grey[..., None] * light, distance)

    return shade
