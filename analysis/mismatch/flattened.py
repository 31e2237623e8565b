"""Exposures that are flat against a full well: base numbers are not fitted to them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.observe import Level
from dsis.camera import Camera

Array = NDArray[np.float64]
_LEAST = 2  # flats below, that say which variance to expect
_SHARE = 0.3  # of the shot noise expected: no law but a limit of charge takes more
_CUT = -0.55  # skewness of normal noise that is cut one standard deviation above its mean
_CUT_SHARE = 0.8  # of its variance, 0.75 of which is left then


def flattened(
    layout: Layout,
    levels: Mapping[Place, Level],
    camera: Camera,
    skewness: Mapping[Place, float],
) -> frozenset[str]:
    """Return the brightest flats in which a channel has lost most of its shot noise.

    Or some of it, where noise leans down as it does that is cut off one standard deviation above
    its mean, or below that.

    Charge that has reached the full well, below the white level, has none: such an exposure says
    nothing of slope, intercept or light, and a line through it is wrong for all others. What to
    expect is in proportion to the camera's shot noise, whose slope may fall where another read-out
    path begins; of a path that the camera lacks the noise grows again, beyond a share of what a
    flat below has.
    """
    flats = [e.name for e in layout.uniform if e.kind == "flat"]
    found: set[str] = set()
    for channel in layout.channels:
        own = sorted(flats, key=lambda name: levels[name, channel].level_dn)
        darks = [
            levels[e.name, channel].variance_dn2 for e in layout.uniform if e.kind == "dark"
        ] or [0.0]
        signal = np.array([levels[name, channel].level_dn for name in own], np.float32)
        shot = np.array([levels[name, channel].variance_dn2 for name in own]) - np.median(darks)
        line = camera.segments.variance_dn2
        expected = (line(signal) - line(np.zeros_like(signal))).astype(np.float64)
        while len(own) > _LEAST and _lost(
            shot[: len(own)],
            expected[: len(own)],
            cut=skewness.get((own[-1], channel), 0.0) < _CUT,
        ):
            found.add(own.pop())
    return frozenset(found)


def _lost(shot_dn2: Array, expected_dn2: Array, *, cut: bool) -> bool:
    """Return whether the last of some flats, the brightest, has lost most of its shot noise.

    Of noise that is `cut` off, as its skewness says, some of it.
    """
    known = expected_dn2[:-1] > 0
    if not known.any():
        return False
    of_others = float(np.median(shot_dn2[:-1][known] / expected_dn2[:-1][known]))
    least, share = of_others * expected_dn2[-1], _CUT_SHARE
    if not cut:
        least, share = min(least, shot_dn2[:-1].max()), _SHARE
    return bool(least > 0 and shot_dn2[-1] < share * least)
