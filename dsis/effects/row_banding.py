"""Row banding: row offsets that neighbouring rows share, new in each frame."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from dsis.cfa import Cfa
from dsis.compiled import kernel
from dsis.effects.effect import MOST_DN, Effect, Exposure, Image, OperatingPoint, Stage
from dsis.grid import PixelGrid
from dsis.lines import moved

_LEAST_ROWS = 0.5  # neighbours then share an eighth: with less, rows are as good as white


class RowBanding(Effect):
    """Offsets of rows that a slow reference leaves alike over some rows, alike at all signals.

    v(t, y, x) = S(y, x) + b(t, y), b a Gaussian series down the rows of standard deviation sigma
    and correlation exp(-d / L) at a distance of d rows, new in each frame: a first-order Markov
    series, as of a black level that is corrected by a share of 1 - exp(-1 / L) after each line.
    """

    kind: Literal["row_banding"] = "row_banding"
    sigma_dn: Annotated[float, Field(ge=0, le=MOST_DN, examples=[3.0])]
    length_rows: Annotated[float, Field(ge=_LEAST_ROWS, examples=[2.5])]

    stage: ClassVar[Stage] = Stage.READ_OUT
    reference: ClassVar[str] = (
        "Levine, Low noise black level reference for CCD imagers, US patent 4549215, 1985; the "
        "series: Uhlenbeck & Ornstein, Physical Review 36, 1930"
    )
    measures: ClassVar[frozenset[str]] = frozenset(
        {"row_variance", "frame_variance", "row_spectrum_peak"}
    )
    confounders: ClassVar[str] = (
        "row_noise is white from row to row; pink_noise correlates rows over the whole frame and "
        "pixels along them; line_flicker grows with the signal and has one frequency."
    )

    def apply(self, image: Image, exposure: Exposure) -> Image:
        """Add the offset of each row."""
        # The series runs from the sensor's first row on: a crop has the rows of the whole.
        grid = exposure.grid
        above = PixelGrid(grid.first_row + grid.rows, 1, Cfa.MONO)
        fresh = exposure.temporal.rows("row_banding", above, exposure.frame)
        series = remembering(fresh.astype(np.float64), np.exp(-1 / self.length_rows))
        own = (self.sigma_dn * series[grid.first_row :]).astype(np.float32)
        return moved(image, own.reshape(-1, 1))

    def contributions(self, point: OperatingPoint) -> Mapping[str, float]:
        """Return what the series' variance and that of its mean make of rows and frames."""
        lag = np.arange(1 - point.rows, point.rows)
        share = (point.rows - np.abs(lag)) / point.rows**2
        variance = self.sigma_dn**2
        mean = variance * float(share @ np.exp(-np.abs(lag) / self.length_rows))
        found = point.components(variance, variance, mean, mean)
        return {name: found[name] for name in ("row_variance", "frame_variance")}


@kernel
def remembering(fresh: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return a series of variance 1 that keeps a share of itself at each step, from white noise."""
    series = fresh.copy()
    new = np.sqrt(1 - share**2)
    for i in range(1, fresh.size):
        series[i] = share * series[i - 1] + new * fresh[i]
    return series
