"""Shading: light falls off from the centre of the sensor to its corners, or to one side."""

from collections.abc import Mapping
from functools import lru_cache
from operator import not_
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dsis.cfa import BLUE, RED, Cfa, pattern
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, ReadOut, Stage
from dsis.grid import PixelGrid
from dsis.lines import Line, lit

Surface = tuple[tuple[float, ...], ...]
_CHANNELS = ("R", "Gr", "Gb", "B")


class Shading(Effect):
    """A fixed smooth fall-off of light: to the corners, and to one side where light is uneven.

    S'(y, x) = S(y, x) max(1 - f s + e s (1 - s) + a v + b u + c (v^2 - 1/3) + d (u^2 - 1/3), 0),
    from the sensor's centre: s = r^2 / R^2, r the distance and R the corner's, v = y / Y and
    u = x / X, Y and X half the height and width. On a whole sensor the mean falls by f S / 3, for
    the mean of s is 1/3; tilts a, down, and b, to the right, leave it where light ends nowhere, and
    so do bows c and d, which rise to both ends where they are positive. The ring e is light between
    centre and corner beside what the square of the distance has: below 0 of the fourth power of the
    cosine (-0.43 f where the corner is 30 degrees off the axis), above 0 of edges of a lens that
    shade the corners alone; it moves the mean by e (1/3 - mean of s^2), some 0.18 e. A lamp beside
    the axis gives a fall and a tilt, and so does a part of a sensor, whose centre is another; an
    integrating sphere or a lamp behind a slit, bows.

    Light of no such shape has a `field` besides, as it was measured: 100 g(k, l) are the
    coefficients that follow, by which sum_kl g(k, l) L_k(v) L_l(u) is added, L the polynomials of
    Legendre. Of each colour its own: of a mosaic R, Gr, Gb and B, in this order.
    """

    kind: Literal["shading"] = "shading"
    falloff_percent: Annotated[float, Field(ge=0, le=100, examples=[4.0])]
    tilt_down_percent: Annotated[float, Field(ge=-100, le=100)] = 0.0
    tilt_right_percent: Annotated[float, Field(ge=-100, le=100)] = 0.0
    bow_down_percent: Annotated[float, Field(ge=-100, le=100)] = 0.0
    bow_right_percent: Annotated[float, Field(ge=-100, le=100)] = 0.0
    ring_percent: Annotated[float, Field(ge=-400, le=400)] = 0.0
    field: Annotated[tuple[Surface, ...], Field(exclude_if=not_)] = ()

    stage: ClassVar[Stage] = Stage.LIGHT
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (homogeneity of the light)"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",
            "pixel_variance",
            "variance_spread",
            "kurtosis",
            "fixed_smooth_variance",
        }
    )
    confounders: ClassVar[str] = (
        "prnu and line patterns are not smooth; amp_glow grows with the exposure time and is there "
        "in darkness."
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if len(self.field) not in (0, 1, len(_CHANNELS)):
            fact = f"field has {len(self.field)} surfaces, must have 1, or 4 of a mosaic"
            raise ValueError(fact)
        if any(len({len(row) for row in own}) != 1 or not own[0] for own in self.field):
            raise ValueError("field must hold rows of equally many coefficients")
        return self

    def unfit_for(self, read_out: ReadOut) -> str:
        """Refuse fields of other colours than the camera's."""
        count = 1 if read_out.cfa is Cfa.MONO else len(_CHANNELS)
        if len(self.field) in (0, count):
            return ""
        return f"has a field of {len(self.field)} surfaces, but cfa {read_out.cfa} has {count}"

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Multiply by the light that reaches each pixel."""
        if self.field:
            return np.asarray(image * _coloured(self, exposure.grid, exposure.read_out.cfa))
        if self.ring_percent:
            return np.asarray(image * _whole(self, exposure.grid))
        down, across, ends = _light(self, exposure.grid)
        if not ends:
            return lit(image, down, across)
        light: Image = np.maximum(down + across, np.float32(0))
        made: Image = image * light
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what mean and shot noise lose, and the variance of the whole sensor's light."""
        if self.ring_percent or self.field:
            whole = _uncut(self, PixelGrid(point.rows, point.columns, Cfa.MONO))
            if self.field:
                whole = whole + np.mean(
                    [_surface(own, point.rows, point.columns) for own in self.field], axis=0
                )
            gained = float(whole.mean()) - 1
            return {
                "level": gained * point.signal_dn,
                "pixel_variance": gained * point.shot_variance_dn2,
                "fixed_smooth_variance": float(whole.var()) * point.signal_dn**2,
            }
        f, h2, w2 = self.falloff_percent / 100, point.rows**2, point.columns**2
        down, right = self.bow_down_percent / 100, self.bow_right_percent / 100
        lost = f * (h2 + w2 - 2) / (3 * (h2 + w2)) + down / (3 * h2) + right / (3 * w2)
        bows = ((down - f * h2 / (h2 + w2)) ** 2 * (h2 - 1) * (h2 - 4) / h2**2) + (
            (right - f * w2 / (h2 + w2)) ** 2 * (w2 - 1) * (w2 - 4) / w2**2
        )
        tilts = ((self.tilt_down_percent / 100) ** 2 * (h2 - 1) / h2 / 3) + (
            (self.tilt_right_percent / 100) ** 2 * (w2 - 1) / w2 / 3
        )
        return {
            "level": -lost * point.signal_dn,
            "pixel_variance": -lost * point.shot_variance_dn2,
            "fixed_smooth_variance": (bows * 4 / 45 + tilts) * point.signal_dn**2,
        }


@lru_cache(maxsize=16)
def _light(effect: Shading, grid: PixelGrid) -> tuple[Line, Line, bool]:
    """Return the light of rows and of columns, to be added, and whether it ends somewhere."""
    rows, columns = grid.sensor_shape
    y, x = _from_centre(grid)
    fall = effect.falloff_percent / 100 / ((rows / 2) ** 2 + (columns / 2) ** 2)
    v, u = y / (rows / 2), x / (columns / 2)
    down = 1 - fall * y**2 + effect.tilt_down_percent / 100 * v
    across = -fall * x**2 + effect.tilt_right_percent / 100 * u
    down += effect.bow_down_percent / 100 * (v**2 - 1 / 3)
    across += effect.bow_right_percent / 100 * (u**2 - 1 / 3)
    lines = down.astype(np.float32), across.astype(np.float32)
    for line in lines:
        line.flags.writeable = False
    return *lines, bool(down.min() + across.min() < 0)


@lru_cache(maxsize=2)
def _whole(effect: Shading, grid: PixelGrid) -> Image:
    """Return the light of every pixel: float32 (row, column), or (row, column, 1) of colours."""
    light = np.maximum(_uncut(effect, grid), 0).astype(np.float32)
    light.flags.writeable = False
    return light


def _uncut(effect: Shading, grid: PixelGrid) -> NDArray[np.float64]:
    """Return the light of every pixel as if it could be below nothing."""
    down, across, _ = _light(effect, grid)
    rows, columns = grid.sensor_shape
    y, x = _from_centre(grid)
    s = (y**2 + x**2) / ((rows / 2) ** 2 + (columns / 2) ** 2)
    return np.asarray(down.astype(np.float64) + across + effect.ring_percent / 100 * s * (1 - s))


@lru_cache(maxsize=2)
def _coloured(effect: Shading, grid: PixelGrid, cfa: Cfa) -> Image:
    """Return the light of every pixel of each colour: (row, column), or (row, column, colour)."""
    even = _uncut(effect, grid)
    rows, columns = grid.row_numbers().ravel(), grid.column_numbers().ravel()
    shape = grid.sensor_shape
    even = even.reshape(grid.rows, grid.columns)
    planes = [even + _at(own, shape, rows, columns) for own in effect.field]
    if grid.cfa is None:
        red, first, second, blue = planes if len(planes) > 1 else planes * len(_CHANNELS)
        light = np.stack([red, (first + second) / 2, blue], 2)
    elif len(planes) == 1:
        light = planes[0]
    else:
        light = np.empty(grid.shape)
        for own, (y, x) in zip(planes, _sites(cfa), strict=True):
            some = np.ix_(rows % 2 == y, columns % 2 == x)
            light[some] = own[some]
    made = np.maximum(light, 0).astype(np.float32)
    made.flags.writeable = False
    return made


def _sites(cfa: Cfa) -> list[tuple[int, int]]:
    """Return the first row and column of R, Gr, Gb and B."""
    colours = pattern(cfa)
    (red_y, red_x), (blue_y, blue_x) = (
        np.argwhere(colours == one)[0].tolist() for one in (RED, BLUE)
    )
    return [(red_y, red_x), (red_y, blue_x), (blue_y, red_x), (blue_y, blue_x)]


def _surface(own: Surface, rows: int, columns: int) -> NDArray[np.float64]:
    return _at(own, (rows, columns), np.arange(rows), np.arange(columns))


def _at(
    own: Surface, shape: tuple[int, int], rows: NDArray[np.integer], columns: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Return what a field adds to the light of some rows and columns of a sensor."""
    made = np.asarray(own, np.float64) / 100
    down, across = (
        np.polynomial.legendre.legvander((at - (size - 1) / 2) / (size / 2), count - 1)
        for at, size, count in zip((rows, columns), shape, made.shape, strict=True)
    )
    return np.asarray(down @ made @ across.T)


def _from_centre(grid: PixelGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far rows and columns are from the sensor's centre, pixels, to be added."""
    rows, columns = grid.sensor_shape
    y = np.asarray(grid.row_numbers() - (rows - 1) / 2, np.float64)
    return y, np.asarray(grid.column_numbers() - (columns - 1) / 2, np.float64)
