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
_LEAST_LSB = 1e-9  # of a smaller spread all codes are as wide, in single precision


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
        if self.rms_lsb < _LEAST_LSB:
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
def _reached(sensor: Draw, white_code: int, rms_lsb: float) -> tuple[NDArray[np.float32], int]:
    """Return the least single-precision values that are not below the edges.

    And from how many codes on no edge is away from its place.
    """
    edges = code_edges(sensor, white_code, rms_lsb)
    nearest = edges.astype(np.float32)
    above = np.nextafter(nearest, np.float32(np.inf))
    reached = np.where(nearest < edges, above, nearest)
    reached.flags.writeable = False
    return reached, int(np.abs(edges - (np.arange(edges.size) - 0.5)).max()) + 1


@kernel
def _convert(
    signal: NDArray[np.float32],
    black: np.float32,
    edges: NDArray[np.float32],
    steps: int,
    out: NDArray[np.float32],
) -> None:
    """Write codes less black; no edge is so many codes, `steps`, or more away from its place."""
    last = np.int32(edges.size - 2)
    codes = np.empty(_TOGETHER, np.int32)
    for start in range(0, signal.size, _TOGETHER):
        line, into = signal[start : start + _TOGETHER], out[start : start + _TOGETHER]
        for i in range(line.size):
            nearest = np.rint(line[i] + black)
            codes[i] = np.int32(min(max(nearest, np.float32(0)), np.float32(last)))
        # Step by step from the nearest code, without a branch: vector instructions.
        for _ in range(steps):
            for i in range(line.size):
                v, place = line[i] + black, np.uintp(codes[i])
                step = np.int32(v >= edges[place + np.uintp(1)]) - np.int32(v < edges[place])
                codes[i] = min(max(codes[i] + step, np.int32(0)), last)
        for i in range(line.size):
            into[i] = np.float32(codes[i]) - black
