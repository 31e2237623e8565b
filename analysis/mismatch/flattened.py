"""Exposures that are flat against a full well: base numbers are not fitted to them."""

from collections.abc import Mapping

import numpy as np

from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.observe import Level

_LEAST = 2  # flats below, that say which variance to expect
_SHARE = 0.3  # of the shot noise expected: no law but a limit of charge takes more


def flattened(layout: Layout, levels: Mapping[Place, Level]) -> frozenset[str]:
    """Return the brightest flats in which a channel has lost most of its shot noise.

    Charge that has reached the full well, below the white level, has none: such an exposure says
    nothing of slope, intercept or light, and a line through it is wrong for all others.
    """
    flats = [e.name for e in layout.uniform if e.kind == "flat"]
    found: set[str] = set()
    for channel in layout.channels:
        own = sorted(flats, key=lambda name: levels[name, channel].level_dn)
        darks = [
            levels[e.name, channel].variance_dn2 for e in layout.uniform if e.kind == "dark"
        ] or [0.0]
        read = float(np.median(darks))
        while len(own) > _LEAST and _lost(levels, own, channel, read):
            found.add(own.pop())
    return frozenset(found)


def _lost(levels: Mapping[Place, Level], own: list[str], channel: str, read_dn2: float) -> bool:
    """Return whether the brightest of some flats has lost most of its shot noise."""
    *below, top = (levels[name, channel] for name in own)
    slopes = [(one.variance_dn2 - read_dn2) / one.level_dn for one in below if one.level_dn > 0]
    if not slopes:
        return False
    expected = float(np.median(slopes)) * top.level_dn
    return expected > 0 and top.variance_dn2 - read_dn2 < _SHARE * expected
