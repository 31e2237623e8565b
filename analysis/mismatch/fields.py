"""Every second line less noisy than the others, or some: lines made of their neighbours."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.resolved import FAR_OFF
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_ALIKE = frozenset(
    {
        "adc_dnl", "adc_memory", "brighter_fatter", "crosstalk", "readout_memory",
        "spatial_filtering",
    }
)  # fmt: skip
_LINES = {"row_variance_spread": ("row", 1), "column_variance_spread": ("column", 0)}
_MOST = 0.5  # of how much lines differ in noise, that every second one makes


def interpolated(state: State, kind: str) -> Denial | None:
    """Return how what makes samples alike is denied by every second line's noise; None: it is not.

    A frame of which only every second line was read, or that was woven of two fields, has between
    them means of neighbours: alike to these, of half their noise, and of codes between codes. No
    filter, no charge and no converter treats every second line otherwise. Where lines differ in
    noise far beyond the model, and half of that is even and odd ones, surely, samples are alike for
    that. So are they where half of it is of single ones that are far quieter than the many, beyond
    what is smooth across lines: a camera that corrects them puts a mean of others there.
    """
    left = {m.statistic: m.z for m in state.mismatches}
    if kind not in _ALIKE:
        return None
    for statistic, (line, axis) in _LINES.items():
        if left.get(statistic, 0.0) > FAR_OFF and _alternate(state, axis):
            return Denial(0.0, f"every second {line} is less noisy, as if made of its neighbours")
        if left.get(statistic, 0.0) > FAR_OFF and _quiet(state, axis):
            return Denial(0.0, f"some {line}s are far less noisy, as if made of their neighbours")
    return None


def _quiet(state: State, axis: int) -> bool:
    """Return whether single lines far quieter than the many make most of how much noise differs.

    Both neighbours, of which such a line is made, are none of them.
    """
    whole = quiet = 0.0
    for (_, name), (image, noise) in state.setting.seen.images.items():
        if name != "variance":
            continue
        rest = beyond_smooth(image.mean(axis) / noise)
        own = rest - np.median(rest)
        chance = 1 / image.shape[axis]
        low = own < -FAR_OFF * chance**0.5
        beside = np.pad(low, 1)
        whole += float((own**2 - chance).sum())
        quiet += float((own[low & ~beside[:-2] & ~beside[2:]] ** 2).sum())
    return quiet > _MOST * whole > 0


def _alternate(state: State, axis: int) -> bool:
    """Return whether even and odd lines make most of how much lines differ in noise.

    Relative variances of pixels, summed over exposures: lines' means over an axis.
    """
    whole = parity = error = 0.0
    for (_, name), (image, noise) in state.setting.seen.images.items():
        if name != "variance":
            continue
        means = image.mean(axis) / noise
        own = means - means.mean()
        signs = np.where(np.arange(own.size) % 2, -1.0, 1.0)
        chance = 1 / image.shape[axis]
        whole += float((own**2).mean()) - chance
        parity += float((own @ signs) / own.size) ** 2 - chance / own.size
        error += chance / own.size
    return parity > _MOST * whole and parity > FAR_OFF**2 * error
