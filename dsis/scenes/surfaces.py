"""Surfaces of buildings: plastered walls with windows, tiles, gravel.

`pick(style, n)` makes one number out of a building's style for each of its traits.
"""

from dataclasses import dataclass

import numpy as np

from dsis.scenes.light import AMBIENT, GLINT, SUN, SUNWARD, rgb
from dsis.scenes.texture import Field, Texture, pulse, step
from dsis.scenes.view import Shade

STREET_M, STREET_EAVES_M = 17.0, 17.0  # what shades the lower storeys
PLASTER = np.array(
    [
        [0.72, 0.66, 0.52], [0.80, 0.77, 0.70], [0.62, 0.44, 0.26], [0.55, 0.50, 0.45],
        [0.70, 0.58, 0.38], [0.34, 0.15, 0.10], [0.66, 0.52, 0.44], [0.48, 0.55, 0.50],
        [0.86, 0.85, 0.82], [0.42, 0.40, 0.39],
    ],
    np.float32,
)  # fmt: skip
TILES = np.array(
    [
        [0.42, 0.16, 0.08], [0.30, 0.11, 0.07], [0.13, 0.13, 0.15], [0.24, 0.13, 0.09],
        [0.36, 0.19, 0.11], [0.17, 0.16, 0.16],
    ],
    np.float32,
)  # fmt: skip
LACQUER = np.array(
    [[0.6, 0.6, 0.6], [0.02, 0.02, 0.025], [0.3, 0.03, 0.03], [0.05, 0.09, 0.25], [0.2, 0.2, 0.2]],
    np.float32,
)
PANES = np.array(  # what a pane shows: a dark room, the sky, a curtain
    [
        [0.005, 0.006, 0.007], [0.003, 0.003, 0.004], [0.10, 0.13, 0.17], [0.02, 0.03, 0.04],
        [0.24, 0.30, 0.38], [0.05, 0.06, 0.07], [0.40, 0.37, 0.31], [0.006, 0.006, 0.007],
    ],
    np.float32,
)  # fmt: skip
MEAN_PANE = PANES.mean(axis=0)
LAMP = rgb(0.80, 0.52, 0.22)
COLOURS = {"brick": TILES, "car": LACQUER, "cabin": PANES}  # of walls; of all others, plaster


def pick(style: float, trait: int) -> float:
    """Return a number in 0..1 for a trait of a building of that style."""
    return (style * trait) % 1


def choose(colours: Field, style: float, trait: int) -> Field:
    """Return one of the rows of a table of colours."""
    chosen: Field = colours[int(pick(style, trait) * len(colours))]
    return chosen


@dataclass(frozen=True)
class Wall:
    """An upright wall; lengths in metres.

    Attributes
    ----------
    texture
        Shape of the dirt, and which pane shows what.
    kind
        "house", "glass", "dormer" have windows; "plain", "brick", "car", "cabin" have none.
    style
        0..1, the building's.
    side
        0..3: which of the building's walls.
    base, eaves
        Heights of its foot and its top.
    length
        Its horizontal extent.
    sunny
        Cosine of the sun's incidence; negative: the wall is in its own shade.
    """

    texture: Texture
    kind: str
    style: float
    side: int
    base: float
    eaves: float
    length: float
    sunny: float

    def shade(self, u: Field, v: Field, pixel_u: float, pixel_v: float) -> Field:
        """Return the colour at `u` along, `v` up the wall: see `dsis.scenes.view.Shade`."""
        z, salt = v + np.float32(self.base), np.float32(100 * self.style + self.side)
        plaster = choose(COLOURS.get(self.kind, PLASTER), self.style, 997)
        sun = max(self.sunny, 0.0)
        roofs = STREET_EAVES_M + 6 * pick(self.style, 31) + self.texture.cell(u / 9 + salt, 0 * u)
        shadow = roofs - STREET_M * SUNWARD[2] / max(sun, 0.05)  # of the houses opposite
        lit = sun * step(z - shadow, -0.2, 0.2 + pixel_v)
        sky = 0.10 + 0.90 * step(z, -3.0, 24.0)  # how much of it a street leaves free
        sky *= 1 - 0.5 * step(z, self.eaves - 0.9, self.eaves - 0.3 + pixel_v)
        light = lit[..., None] * SUN + sky[..., None] * AMBIENT
        dirt = 1 + np.float32(0.06) * self.texture.fractal(u / 5 + salt, z / 7, 3, pixel_v / 5)
        albedo = plaster * dirt[..., None]
        if self.kind not in ("house", "glass", "dormer"):
            return albedo * light
        return self._with_windows(albedo, light, u, v, pixel_u, pixel_v)

    def _with_windows(
        self, albedo: Field, light: Field, u: Field, v: Field, pixel_u: float, pixel_v: float
    ) -> Field:
        """Return the colour of the wall with frames and panes."""
        glazed = self.kind == "glass"
        storeys = max(round((self.eaves - self.base - 0.4) / (3.1 + 0.8 * pick(self.style, 71))), 1)
        storey = (self.eaves - self.base - 0.4) / storeys
        bay = 2.2 + 1.3 * pick(self.style, 37)
        bays = 1 if self.kind == "dormer" else max(round(self.length / bay), 1)
        wide, tall = (0.9, 0.72) if glazed else (0.36 + 0.16 * pick(self.style, 17), 0.56)
        axis, floors = u * np.float32(bays / self.length), (v - 0.4) / np.float32(storey)
        fu, fv = pixel_u * bays / self.length, pixel_v / storey
        under_eaves = step(self.eaves - self.base - v, 0.25, 0.3 + pixel_v)
        frame = pulse(axis, wide + 0.12, fu) * pulse(floors, tall + 0.1, fv) * under_eaves
        glass = pulse(axis, wide, fu) * pulse(floors, tall, fv) * under_eaves
        if not glazed:
            glass = glass * (1 - pulse(axis, 0.03, fu))  # the bar between the casements
        timber = np.float32(0.25 if glazed else 0.85)
        colour = (albedo + 0.8 * frame[..., None] * (timber - albedo)) * light
        colour += glass[..., None] * (self._panes(axis, floors, v, max(fu, fv), fv) - colour)
        return colour

    def _panes(
        self, axis: Field, floors: Field, v: Field, footprint: float, footprint_v: float
    ) -> Field:
        """Return the colour of the panes; where a pixel holds several, of their mean."""
        salt = int(1e4 * self.style) + 31 * self.side
        one = np.float32(1 - min(max(1.6 * footprint - 0.4, 0.0), 1.0))
        shown = 3.999 * (1 + self.texture.cell(axis, floors, salt))
        pane: Field = MEAN_PANE + one * (PANES.take(shown.astype(np.int32), axis=0) - MEAN_PANE)
        if self.kind == "glass":
            pane = pane * (0.35 + 0.65 * step(v, 0, 60))[..., None]
        pane = pane * (1 - np.float32(0.7) * pulse(floors + 0.36, 0.2, footprint_v))[..., None]
        odd = self.texture.cell(axis + 13, floors + 5, salt)
        pane += (one * (odd > 0.98))[..., None] * (LAMP - pane)
        if self.sunny > 0 and pick(self.style, 53) < 0.9:
            pane += (one * (odd < -0.97))[..., None] * (GLINT - pane)
        return pane


def tiles(texture: Texture, style: float, sunny: float, *, windows: bool) -> Shade:
    """Return the shade of a pitched roof: rows of tiles, stains, roof windows."""
    colour = choose(TILES, style, 613)
    light = max(sunny, 0.0) * SUN + np.float32(1.2) * AMBIENT
    salt = np.float32(90 * style)
    pane = GLINT if pick(style, 83) < 0.03 and sunny > 0 else PANES[2]

    def shade(u: Field, v: Field, pixel_u: float, pixel_v: float) -> Field:
        rows = 1 - np.float32(0.3) * pulse(v / 0.42, 0.3, pixel_v / 0.42)
        stain = 1 + 0.25 * texture.fractal(u / 2.5 + salt, v / 4 + salt, 5, pixel_v / 2.5)
        tiled: Field = (rows * stain)[..., None] * (colour * light)
        if windows:
            a, b = u / 3.4, v / 3.1 - 0.2
            cover = pulse(a, 0.3, pixel_u / 3.4) * pulse(b, 0.38, pixel_v / 3.1)
            cover = cover * (texture.cell(a, b, int(salt)) > 0.4)
            tiled += cover[..., None] * (pane - tiled)
        return tiled

    return shade


def flat_roof(texture: Texture, kind: str, style: float, wide: float, deep: float) -> Shade:
    """Return the shade of a flat roof: gravel inside a parapet, or the lacquer of a car."""
    light = SUNWARD[2] * SUN + np.float32(1.4) * AMBIENT
    salt = np.float32(90 * style)

    def shade(u: Field, v: Field, pixel_u: float, pixel_v: float) -> Field:
        del pixel_u
        if kind == "car":
            return np.broadcast_to(AMBIENT * choose(LACQUER, style, 997), (*v.shape, 3))
        patch = texture.fractal(u / 5 + salt, v / 5 + salt, 5, pixel_v / 5)
        border = np.minimum(np.minimum(u, wide - u), np.minimum(v, deep - v))
        rim = step(0.5 - border, 0, 0.05 + pixel_v)
        grey = 0.14 + 0.16 * pick(style, 7) + 0.05 * patch + 0.25 * rim
        gravel: Field = grey[..., None] * light
        return gravel

    return shade
