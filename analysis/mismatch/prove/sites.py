"""Sites of the colour filter array: the pixels of one filter, a plane each."""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa, pattern

Place = tuple[slice, slice]
_ALL = slice(None)

_FAR = 6.0  # standard deviations that a normal law does not have


def site_places(cfa: Cfa) -> tuple[Place, ...]:
    """Return where the pixels of each site lie: one plane of a monochrome sensor, else four."""
    if cfa is Cfa.MONO:
        return ((_ALL, _ALL),)
    return tuple((slice(y, None, 2), slice(x, None, 2)) for y in (0, 1) for x in (0, 1))


def site_colours(cfa: Cfa) -> tuple[int, ...]:
    """Return the channel of each site; both greens are one."""
    if cfa is Cfa.MONO:
        return (0,)
    return tuple(int(colour) for colour in pattern(cfa).reshape(-1))


def site_values(values: NDArray[np.generic], cfa: Cfa) -> NDArray[np.float64]:
    """Return one value of each site from values (2, 2) of rows 0, 1 and columns 0, 1."""
    whole = np.broadcast_to(np.asarray(values, np.float64), (2, 2)).reshape(-1)
    return whole[:1].copy() if cfa is Cfa.MONO else whole.copy()


def site_means(frames: NDArray[np.generic], cfa: Cfa) -> NDArray[np.float64]:
    """Return the mean of each site of each frame: (..., row, column) to (..., site)."""
    return np.stack(
        [frames[(..., *place)].mean((-2, -1), dtype=np.float64) for place in site_places(cfa)], -1
    )


def means_of_most(frames: NDArray[np.generic], cfa: Cfa, step: float = 0.0) -> NDArray[np.float64]:
    """Return `site_means` of (frame, row, column) without spikes: (frame, site).

    What lies beyond six standard deviations of the rest is left out, until nothing does; and beyond
    six steps of the codes, of which a rare one beside the others is no spike.
    """
    made = site_means(frames, cfa)
    for site, place in enumerate(site_places(cfa)):
        for number, frame in enumerate(frames):
            own = frame[place].astype(np.float64)
            departure = np.abs(own - made[number, site])
            while own.size and float(departure.max()) > (far := _FAR * max(own.std(), step)) > 0:
                own = own[departure <= far]
                made[number, site] = own.mean()
                departure = np.abs(own - made[number, site])
    return made


def spread_over(
    values: NDArray[np.float64], shape: tuple[int, int], cfa: Cfa
) -> NDArray[np.float64]:
    """Return values of the sites (..., site) at the pixels of each: (..., row, column)."""
    out = np.empty((*values.shape[:-1], *shape))
    for site, place in enumerate(site_places(cfa)):
        out[(..., *place)] = values[..., site, np.newaxis, np.newaxis]
    return out
