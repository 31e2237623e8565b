"""Dark current that parts of a sensor do not have: something else grows with exposure time."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.amp_glow import AmpGlow
from dsis.effects.dark_current import DarkCurrent
from dsis.effects.hot_pixels import HotPixels

Array = NDArray[np.float64]
_PARTS = 4  # along each side
_LEAST_SHARE = 0.5  # of a dark current, that every part of the sensor must show
_SURE = 3.0  # standard errors: the least of sixteen
_SEEN = 3.5  # of a surface: chance has that among the map's few numbers in 1 % of recordings
_SMOOTH = "fixed_smooth"


def uneven(state: State, effect: Effect | None) -> Denial | None:
    """Return how an even dark current is denied by where levels grow with time; None: it is not.

    The map of what grows with time has a mean of zero: how much of the mean that grows is a smooth
    surface's - a glow's, say - it does not tell. Where such a surface is left unexplained, the part
    of the sensor that grows least must grow for sure, by half of a dark current; else all may be
    the surface's. Beside a glow or hot pixels that are named nothing is said: the map has their
    mean too.
    """
    if not isinstance(effect, DarkCurrent) or not effect.dn_per_s:
        return None
    if any(isinstance(other, AmpGlow | HotPixels) for other in state.camera.effect):
        return None
    left = state.null.departures(state.vector)
    if not any(
        abs(z) > _SEEN and key.scope == "time" and key.statistic.startswith(_SMOOTH)
        for key, z in zip(state.null.keys, left, strict=True)
    ):
        return None
    shares, errors = [], []
    for (channel, name), (image, noise) in state.setting.seen.images.items():
        if name != "time":
            continue
        growth = effect.dn_per_s * state.setting.layout.regressors(channel).scales["time"]
        means = _parts(image)
        shares.append(1 + means / growth)
        errors.append(noise / growth * (means.size / image.size) ** 0.5)
    if not shares:
        return None
    share = float(np.mean(shares, axis=0).min())
    error = float(np.sqrt(np.mean(np.square(errors)) / len(errors)))
    if share - _SURE * error > 0 and share + _SURE * error >= _LEAST_SHARE:
        return None
    least = f"{max(share, 0):.0%} +- {error:.0%}"
    return Denial(share, f"a part of the sensor grows with exposure time by {least} of it")


def _parts(image: Array) -> Array:
    """Return the means of sixteen parts of an image, (part,)."""
    rows = np.array_split(image, _PARTS, axis=0)
    return np.array([part.mean() for row in rows for part in np.array_split(row, _PARTS, axis=1)])
