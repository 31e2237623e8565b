"""Differential non-linearity of the converter: unequal code widths."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import gammaincinv

from dsis.cfa import Cfa
from dsis.compiled import kernel
from dsis.draw import Draw
from dsis.effects.effect import Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid

BLOCK_CODES = 64
_TOGETHER = 4096  # samples whose codes stay in the cache
_CELLS = 8  # of a code's width


class AdcDnl(Effect):
    """The width of each code is its own, fixed, 1 LSB on average; the code follows the edges.

    c = k where edge(k) <= v + black < edge(k + 1). Widths are random with the given standard
    deviation; each block of 64 adds up to 64 LSB, so that the integral non-linearity stays within a
    few LSB, and codes keep their order.
    """

    kind: Literal["adc_dnl"] = "adc_dnl"
    rms_lsb: Annotated[float, Field(ge=0, le=2, examples=[0.3])]

    stage: ClassVar[Stage] = Stage.CODE
    rank: ClassVar[int] = 50
    reference: ClassVar[str] = "IEEE Std 1241-2010, Terminology and test methods for ADCs"
    measures: ClassVar[frozenset[str]] = frozenset(
        {"level", "pixel_variance", "skewness", "kurtosis", "code_imbalance"}
    )
    confounders: ClassVar[str] = (
        "Light texture moves every level differently; quantisation leaves codes out altogether."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Return whole codes less black, by the converter's edges."""
        if not self.rms_lsb:
            return image
        black = np.float32(exposure.read_out.black_level_dn)
        white = int(exposure.read_out.white_level_dn)
        out = np.empty_like(image, order="C")
        flat = np.ascontiguousarray(image).reshape(-1)
        _convert(flat, black, *_reached(exposure.sensor, white, self.rms_lsb), out.reshape(-1))
        return out

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return the imbalance of codes where the noise covers a block of them.

        Their mean square is 1 + rms^2 for widths of mean 1, the share of it that varies rms^2. All
        else depends on which codes the noise covers.
        """
        if point.variance_dn2 < (BLOCK_CODES / 4) ** 2:
            return {}
        return {"code_imbalance": self.rms_lsb / (1 + self.rms_lsb**2) ** 0.5}


@lru_cache(maxsize=8)
def code_edges(sensor: Draw, white_code: int, rms_lsb: float) -> NDArray[np.float64]:
    """Return the lower edge of each code 0..white_code, and last the upper one: LSB, ascending.

    Widths are 64 times a symmetric Dirichlet vector whose components have the standard deviation
    asked for: normalised gamma variates.
    """
    blocks = white_code // BLOCK_CODES + 1
    line = PixelGrid(1, blocks * BLOCK_CODES, Cfa.MONO)
    shape = ((BLOCK_CODES - 1) / rms_lsb**2 - 1) / BLOCK_CODES
    gammas = gammaincinv(shape, sensor.uniform("adc_dnl", line)[0].astype(np.float64))
    parts = gammas.reshape(blocks, BLOCK_CODES)
    widths = (BLOCK_CODES * parts / parts.sum(1, keepdims=True)).reshape(-1)
    edges = np.concatenate(([0.0], np.cumsum(widths))) - 0.5
    edges.flags.writeable = False
    return edges


@lru_cache(maxsize=8)
def _reached(
    sensor: Draw, white_code: int, rms_lsb: float
) -> tuple[NDArray[np.float32], NDArray[np.int32], int]:
    """Return the least single-precision values that are not below the edges, the last one infinite.

    Then of each cell of a signal, an eighth of a code wide, a code that is not above its own; and
    how many edges lie between that and the end of the cell at most.
    """
    edges = code_edges(sensor, white_code, rms_lsb)
    nearest = edges.astype(np.float32)
    above = np.nextafter(nearest, np.float32(np.inf))
    reached = np.where(nearest < edges, above, nearest)
    # Rounding of a signal's place moves it by less than half a cell.
    ends = (np.arange((white_code + 1) * _CELLS + 1) - 0.5) / _CELLS - 0.5
    last = edges.size - 2
    before = np.clip(np.searchsorted(edges, ends, side="right") - 1, 0, last).astype(np.int32)
    steps = int((before[2:] - before[:-2]).max()) if before.size > 2 else last
    reached[-1] = np.inf
    reached.flags.writeable = False
    return reached, before[:-1].copy(), steps


@kernel
def _convert(
    signal: NDArray[np.float32],
    black: np.float32,
    edges: NDArray[np.float32],
    cells: NDArray[np.int32],
    steps: int,
    out: NDArray[np.float32],
) -> None:
    """Write codes less black; so many edges, `steps`, lie at most behind the code of a cell."""
    last, per_code, half = np.float32(cells.size - 1), np.float32(_CELLS), np.float32(0.5)
    codes = np.empty(_TOGETHER, np.int32)
    for start in range(0, signal.size, _TOGETHER):
        line, into = signal[start : start + _TOGETHER], out[start : start + _TOGETHER]
        for i in range(line.size):
            place = min(max((line[i] + black + half) * per_code, np.float32(0)), last)
            codes[i] = cells[np.uintp(np.int32(place))]
        # Step by step from there, without a branch: vector instructions.
        for _ in range(steps):
            for i in range(line.size):
                code = codes[i]
                codes[i] = code + np.int32(line[i] + black >= edges[np.uintp(code) + np.uintp(1)])
        for i in range(line.size):
            into[i] = np.float32(codes[i]) - black
