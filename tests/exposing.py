"""What one effect makes of an image, and what a camera with effects records: values and arrays
that the tests of closed forms share. Statistics are written out in numpy, tolerances are five
standard errors.
"""

import numpy as np

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect, Exposure, ReadOut, registry
from dsis.grid import PixelGrid
from dsis.noise import Segments

Z_MAX = 5.0
P_MIN = 1e-6  # of a Kolmogorov-Smirnov test: about five standard errors
BLACK_DN, WHITE_DN = 200.0, 16383.0
SIDE = 256


def effect(kind: str, **parameters: object) -> Effect:
    return registry()[kind](**parameters)


def camera(
    *effects: Effect,
    slope: float = 0.0,
    intercept: float = 0.0,
    cfa: Cfa = Cfa.MONO,
    switch: float | None = None,
) -> Camera:
    last = Segment(slope=slope, intercept=intercept)
    first = (Segment(upper_dn=switch, slope=slope, intercept=intercept),) if switch else ()
    return Camera(
        name="test",
        cfa=cfa,
        black_level=BLACK_DN,
        white_level=WHITE_DN,
        bit_depth=14,
        noise=BaseNoise(segment=(*first, last)),
        effect=effects,
    )


def apply(
    one: Effect,
    image: np.ndarray,
    frame: int = 0,
    *,
    grid: PixelGrid | None = None,
    expected: float | None = None,
    time_s: float = 0.0,
) -> np.ndarray:
    """Return what the effect alone makes of an image, in float64."""
    image = image.astype(np.float32)
    grid = grid or PixelGrid(*image.shape, Cfa.MONO)
    clean = image if expected is None else np.full_like(image, expected)
    segments = Segments.of([(-np.inf, 1.0, 4.0), (1000.0, 1.0, 16.0)])
    read_out = ReadOut(grid.cfa or Cfa.MONO, segments, BLACK_DN, WHITE_DN)
    exposure = Exposure(grid, frame, Draw(3), Draw(4), clean, read_out, lambda _: image, time_s)
    return one.apply(image, exposure).astype(np.float64)


def recorded(
    one: Camera, level: float, frames: int, shape: tuple[int, int] = (64, 64), time_s: float = 0.0
) -> np.ndarray:
    grid = PixelGrid(*shape, one.cfa)
    clean = np.full(shape, level, np.float32)
    return np.stack(
        [one.expose(clean, Draw(5), Draw(6), t, grid, exposure_time_s=time_s)
         for t in range(frames)]
    ).astype(np.float64)  # fmt: skip


def white(sigma: float = 10.0, side: int = SIDE, mean: float = 0.0) -> np.ndarray:
    return np.random.default_rng(0).normal(mean, sigma, (side, side))


def flat(level: float, side: int = SIDE) -> np.ndarray:
    return np.full((side, side), level)
