"""The light of flats whose level a full well hides: other colours tell it, or any that is brighter.

A pixel that is full says nothing of the light beyond. Colours of one lamp are in one ratio at all
levels, however bright it is: those that are not full tell how bright it was. Where none does, any
light far above the full well leaves the same, the full well itself and no shot noise.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects.saturation import Saturation

Array = NDArray[np.float64]
_HALF = 0.4  # standard deviations that a limit takes of the mean where half of the pixels are full
_ALL = 0.01  # or of noise that is 2 standard deviations above it
_FAR = 4.0  # standard deviations above a limit, of which nothing is seen
_SITES = ((0, 0), (0, 1), (1, 0), (1, 1))


def full_well_of(camera: Camera) -> float | None:
    """Return the least full well of a camera, DN above black; None: it has none."""
    wells = [e.full_well_dn for e in camera.effect if isinstance(e, Saturation)]
    return min(wells, default=None)


def lit(camera: Camera, layout: Layout, levels: Mapping[str, Array]) -> dict[str, Array]:
    """Return the clean signals of exposures, from levels that a camera's full well may hide.

    Parameters
    ----------
    camera
        With its full well, if it has one, and its noise.
    layout
        Of exposures; where the light is known it stays.
    levels
        By exposure, for rows 0, 1 and columns 0, 1: (2, 2), DN above black.
    """
    found, full = dict(levels), full_well_of(camera)
    dim = [e.name for e in layout.uniform if e.kind == "flat" and e.light is None]
    if full is None or not dim:
        return found
    line = camera.segments.variance_dn2(np.array([0.0, full], np.float32))
    spreads = [e.spread_percent for e in camera.effect if isinstance(e, Saturation)]
    sd = float(np.hypot(max(line[1] - line[0], 0.0) ** 0.5, max(spreads) / 100 * full))
    hidden = {name: levels[name] > full - _HALF * sd for name in dim}
    for name in dim:
        own = levels[name].copy()
        for site in (at for at in _SITES if hidden[name][at]):
            light = _by_colours(levels, hidden, name, site) if layout.cfa is not Cfa.MONO else None
            if light is None and levels[name][site] > full - _ALL * sd:
                light = full + _FAR * sd
            own[site] = max(levels[name][site], light or 0.0)
        found[name] = own
    return found


def _by_colours(
    levels: Mapping[str, Array],
    hidden: Mapping[str, NDArray[np.bool_]],
    name: str,
    site: tuple[int, int],
) -> float | None:
    """Return the signal of a site in a flat by those that are not hidden there; None: none is.

    By the ratio that both have in the brightest other flat that hides neither.
    """
    told = []
    for other in _SITES:
        if hidden[name][other] or levels[name][other] <= 0:
            continue
        both = [
            own
            for flat, own in levels.items()
            if flat in hidden and not (hidden[flat][site] or hidden[flat][other])
        ]
        best = max(both, key=lambda own: float(own[other]), default=None)
        if best is not None and best[other] > 0:
            told.append(float(levels[name][other] * best[site] / best[other]))
    return float(np.mean(told)) if told else None
