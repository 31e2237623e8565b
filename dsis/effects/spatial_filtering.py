"""Spatial filtering: the camera smooths its raw data."""

from collections.abc import Iterator, Mapping
from operator import not_
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dsis.cfa import Cfa
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage

_BOTH: Literal["both"] = "both"
_ROWS, _COLUMNS = ((0, 1), (0, -1)), ((1, 0), (-1, 0))
_DIAGONALS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
_LARGEST = 0.8  # share that a pixel may give to its neighbours


class SpatialFiltering(Effect):
    """A fixed kernel over each pixel and its nearest neighbours of the same colour.

    v'(p) = v(p) + f sum_n (v(n) - v(p)), after all read-out noise, over the neighbours n along rows
    and columns, or along one of them: two sites away in a mosaic, one on a monochrome sensor and in
    full planes. Those on the diagonals, if any, count `diagonal` times as much: 1 is a box. All
    noise, darks included, becomes correlated: of four neighbours by
    2 f (1 - 4 f) / ((1 - 4 f)^2 + 4 f^2) at that lag.
    """

    kind: Literal["spatial_filtering"] = "spatial_filtering"
    fraction: Annotated[float, Field(ge=0, le=0.2, examples=[0.02])]
    along: Annotated[Literal["both", "rows", "columns"], Field(exclude_if=_BOTH.__eq__)] = _BOTH
    diagonal: Annotated[float, Field(ge=0, le=2, exclude_if=not_)] = 0.0

    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = -50
    draws: ClassVar[bool] = False
    reference: ClassVar[str] = "EMVA Standard 1288, release 3.1 (no preprocessing in the camera)"
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "pixel_variance",
            "row_variance",
            "column_variance",
            "frame_variance",
            "correlation_0_1",
            "correlation_1_0",
            "correlation_1_1",
            "correlation_0_2",
            "correlation_2_0",
            "spectral_peak",
            "row_spectrum_peak",
            "variance_spread",
        }
    )
    confounders: ClassVar[str] = (
        "crosstalk leaves read noise and darks white and couples neighbours of other colours."
    )

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.diagonal and self.along != _BOTH:
            msg = f"diagonal: {self.diagonal:g} needs along = {_BOTH!r}, not {self.along!r}"
            raise ValueError(msg)
        given = sum(share for _, share in self._shares)
        if self.diagonal and given > _LARGEST:
            msg = f"diagonal: {self.diagonal:g} makes a pixel give away {given:g}, above {_LARGEST}"
            raise ValueError(msg)
        return self

    @property
    def _shares(self) -> Iterator[tuple[tuple[int, int], float]]:
        """Neighbours (row, column from the pixel, of its colour), and the share of each."""
        near = {"both": (*_ROWS, *_COLUMNS), "rows": _ROWS, "columns": _COLUMNS}[self.along]
        yield from ((place, self.fraction) for place in near)
        if self.diagonal:
            yield from ((place, self.fraction * self.diagonal) for place in _DIAGONALS)

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Smooth each colour in itself."""
        step = 1 if exposure.grid.cfa in {None, Cfa.MONO} else 2
        made = image.copy()
        for (down, right), share in self._shares:
            if (down, right) < (0, 0):
                continue  # the neighbour exchanges with this one
            (y, v), (x, u) = (_apart(step * lag) for lag in (down, right))
            flow = np.float32(share) * (image[v, u] - image[y, x])
            made[y, x] += flow
            made[v, u] -= flow
        return made

    def reach_pixels(self) -> int:
        """Return how far away a pixel may matter."""
        return 2

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the kernel makes of all noise of one colour; lags count its own sites."""
        kernel = dict(self._shares)
        kernel[0, 0] = 1 - sum(kernel.values())
        noise = point.shot_variance_dn2 + point.read_variance_dn2
        return point.filtered(noise, kernel)  # rounding comes later and stays white


def _apart(lag: int) -> tuple[slice, slice]:
    """Return where pixels lie that have a neighbour so far along an axis, and these neighbours."""
    if lag < 0:
        return _apart(-lag)[::-1]
    return slice(None, -lag or None), slice(lag, None)
