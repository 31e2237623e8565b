"""Random telegraph signal: some pixels jump between two levels."""

from collections.abc import Mapping
from functools import lru_cache
from math import prod
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtr, ndtri

from dsis.draw import Draw
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid

_Traps = tuple[tuple[NDArray[np.intp], ...], NDArray[np.int64], NDArray[np.float64]]
_MOST_KEPT = 1 << 18  # deviates of a field whose traps are kept

_ABOUT: Literal["about"] = "about"
_DRAWN: Literal["exponential"] = "exponential"


class Rts(Effect):
    """A share of the pixels carries a trap that is empty or filled: two levels, equally long.

    v(t, p) = S(p) + a(p) (b(t, p) - 1/2), a ~ Exp(amplitude) with probability q, else 0; b a Markov
    chain of 0 and 1 that switches with probability w per frame: variance a^2 / 4, correlation
    (1 - 2 w)^k over k frames. So where the `levels` lie about the signal. Else a pixel whose trap
    is empty is as any other, and jumps are all `above` it, S + a b, or `either`, above or below,
    as it is drawn for each pixel: then these pixels stand out of fixed patterns by a / 2. Where
    `heights` are `equal`, a is the amplitude in each of these pixels.
    """

    kind: Literal["rts"] = "rts"
    pixel_fraction: Annotated[float, Field(ge=0, le=0.5, examples=[0.05])]
    amplitude_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[8.0])]
    switch_probability: Annotated[float, Field(gt=0, le=0.5)] = 0.2
    levels: Annotated[Literal["about", "above", "either"], Field(exclude_if=_ABOUT.__eq__)] = _ABOUT

    heights: Annotated[Literal["exponential", "equal"], Field(exclude_if=_DRAWN.__eq__)] = _DRAWN

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = (
        "Wang, Rao, Mierop & Theuwissen, Random telegraph signal in CMOS image sensor pixels, IEDM "
        "2006"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {
            "level",  # where all jump one way
            "pixel_variance",
            "kurtosis",
            "variance_spread",
            "frame_correlation",
            "fixed_pixel_variance",
            "spectral_peak",
            "row_spectrum_peak",
            "code_imbalance",
        }
    )
    confounders: ClassVar[str] = (
        "read_noise_spread is Gaussian in each pixel and white in time; impulse does not return; "
        "hot_pixels grow with time and do not jump."
    )

    @property
    def changes(self) -> frozenset[str]:
        """The measures that it may change: levels only where all jump one way."""
        return self.measures if self.levels == "above" else self.measures - {"level"}

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the state of each trap."""
        if not self.pixel_fraction:
            return image
        sensor, grid = exposure.sensor, exposure.grid
        if prod(grid.shape) <= _MOST_KEPT:
            places, sites, heights = _kept_traps(sensor, grid, self.pixel_fraction)
        else:
            places, sites, heights = _traps(sensor, grid, self.pixel_fraction, exposure.threads)
        filled = exposure.temporal.chained(
            "rts states", sites, exposure.frame, self.switch_probability
        )
        height = np.full(filled.size, self.amplitude_dn)
        if self.heights == _DRAWN:
            height *= heights
        if self.levels == "either":
            signs = sensor.fixed("rts signs", grid, threads=exposure.threads)
            height *= np.where(signs[places] < 0, -1, 1)
        made = image.copy()
        made[places] += height * (filled - (0.5 if self.levels == _ABOUT else 0.0))
        return made

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return q a^2 / 2, or half of it; what correlated frames share goes to the fixed pattern.

        Half of it where heights are equal. As much goes to that pattern of levels that do not lie
        about the signal, less the square of their mean where all lie above.
        """
        mean_square = self.amplitude_dn**2 * (2 if self.heights == _DRAWN else 1)
        variance = self.pixel_fraction * mean_square / 4
        rho, frames = 1 - 2 * self.switch_probability, point.frames
        k = np.arange(1, frames)
        pairs = 2 * float(((frames - k) * rho**k).sum()) / (frames * (frames - 1))
        level = self.pixel_fraction * self.amplitude_dn / 2 if self.levels == "above" else 0.0
        fixed = 0.0 if self.levels == _ABOUT else variance - level**2
        return {
            "pixel_variance": variance * (1 - pairs),
            "fixed_pixel_variance": variance * pairs + fixed,
            "level": level,
        }


def _traps(sensor: Draw, grid: PixelGrid, share: float, threads: int = 1) -> _Traps:
    """Return where a field has traps, and exponential heights of mean 1, read-only.

    Frames share them.
    """
    deviates = sensor.fixed("rts", grid, threads=threads)
    places = np.nonzero(deviates < ndtri(share))
    rows, columns = places[0] + grid.first_row, places[1] + grid.first_column
    channels = places[2] if grid.cfa is None else grid.channels()[rows % 2, columns % 2, 0]
    sites = np.stack([rows, columns, channels]).astype(np.int64)
    # Below the threshold the normal law's tail is uniform: it gives the height as well.
    heights = -np.log(ndtr(deviates[places].astype(np.float64)) / share)
    for shared in (*places, sites, heights):
        shared.flags.writeable = False
    return places, sites, heights


@lru_cache(maxsize=4)
def _kept_traps(sensor: Draw, grid: PixelGrid, share: float) -> _Traps:
    return _traps(sensor, grid, share)
