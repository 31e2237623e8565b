"""Colours of the city: diffuse reflectances, linear, Rec.709 primaries."""

import numpy as np

from dsis.scenes.city.solids import Cover, Rgb

PLASTER: tuple[Rgb, ...] = (
    (0.62, 0.56, 0.45), (0.70, 0.66, 0.58), (0.55, 0.44, 0.28), (0.60, 0.50, 0.36),
    (0.48, 0.47, 0.44), (0.84, 0.82, 0.78), (0.56, 0.36, 0.27), (0.64, 0.58, 0.38),
    (0.42, 0.44, 0.46), (0.58, 0.46, 0.40), (0.50, 0.54, 0.48), (0.33, 0.16, 0.11),
    (0.38, 0.20, 0.13), (0.66, 0.60, 0.50),
)  # fmt: skip
CONCRETE: tuple[Rgb, ...] = (
    (0.45, 0.44, 0.42), (0.58, 0.57, 0.55), (0.78, 0.78, 0.77), (0.36, 0.33, 0.30),
    (0.50, 0.42, 0.34), (0.30, 0.18, 0.13),
)  # fmt: skip
TILES: tuple[Rgb, ...] = (
    (0.34, 0.135, 0.075), (0.40, 0.17, 0.09), (0.29, 0.12, 0.08), (0.36, 0.19, 0.12),
    (0.25, 0.14, 0.10), (0.42, 0.21, 0.11),
)  # fmt: skip
SLATE: tuple[Rgb, ...] = ((0.075, 0.08, 0.095), (0.11, 0.115, 0.13), (0.09, 0.08, 0.08))
METAL: tuple[Rgb, ...] = ((0.30, 0.33, 0.36), (0.24, 0.27, 0.30), (0.20, 0.36, 0.30))
GRAVEL: tuple[Rgb, ...] = (
    (0.30, 0.29, 0.27), (0.20, 0.195, 0.19), (0.42, 0.41, 0.39), (0.12, 0.12, 0.125),
    (0.32, 0.24, 0.19), (0.55, 0.54, 0.52), (0.78, 0.78, 0.76),
)  # fmt: skip
LACQUER: tuple[Rgb, ...] = (
    (0.85, 0.85, 0.84), (0.03, 0.03, 0.035), (0.30, 0.31, 0.32), (0.10, 0.10, 0.11),
    (0.30, 0.025, 0.02), (0.03, 0.07, 0.22), (0.80, 0.80, 0.78), (0.16, 0.17, 0.18),
)  # fmt: skip
LEAVES: tuple[Rgb, ...] = (
    (0.125, 0.180, 0.045), (0.155, 0.205, 0.060), (0.095, 0.145, 0.042), (0.180, 0.200, 0.060),
    (0.110, 0.165, 0.065), (0.140, 0.170, 0.040),
)  # fmt: skip
STEEL: Rgb = (0.62, 0.63, 0.63)
CANVAS: tuple[Rgb, ...] = (
    (0.70, 0.68, 0.60), (0.50, 0.07, 0.05), (0.08, 0.16, 0.30), (0.10, 0.30, 0.20),
)  # fmt: skip
CLOTHES: tuple[Rgb, ...] = (
    (0.05, 0.05, 0.06), (0.45, 0.44, 0.42), (0.30, 0.05, 0.04), (0.06, 0.10, 0.22),
    (0.55, 0.50, 0.40), (0.10, 0.10, 0.10),
)  # fmt: skip
COVERS = {
    Cover.TILES: TILES, Cover.SLATE: SLATE, Cover.METAL: METAL, Cover.GRAVEL: GRAVEL,
}  # fmt: skip


def one_of(rng: np.random.Generator, colours: tuple[Rgb, ...]) -> Rgb:
    """Return one of some colours, a little lighter or darker, warmer or cooler."""
    red, green, blue = colours[int(rng.integers(len(colours)))]
    level, warmth = rng.uniform(0.85, 1.1), rng.uniform(-0.05, 0.05)
    return red * level * (1 + warmth), green * level, blue * level * (1 - warmth)
