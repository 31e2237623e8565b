"""Whether a pattern keeps its phase from frame to frame: a bistable pattern, or interference.

The frames are projected on the pattern. A pattern whose sign alone changes gives numbers on one
line through zero of the complex plane, free phases give a circle: |sum c^2| / sum |c|^2 is 1 or 0.
"""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout

_ONE_LINE, _CIRCLE = 0.75, 0.45
_LEAST = 8  # frames, to tell


def keeps_phase(
    layout: Layout,
    frames_of: Callable[[str], Iterable[NDArray[np.generic]]],
    frequency: tuple[float, float],
) -> bool | None:
    """Return whether the phase is kept; None where the frames cannot tell.

    Parameters
    ----------
    layout, frames_of
        The frames.
    frequency
        Cycles per pixel along x and y.
    """
    y, x = np.arange(layout.rows)[:, None], np.arange(layout.columns)
    along_x = np.exp(-2j * np.pi * frequency[0] * x)
    along_y = np.exp(-2j * np.pi * frequency[1] * y[:, 0])
    total, size, count = 0j, 0.0, 0
    for exposure in layout.uniform:
        variance = float(np.mean([layout.variance_dn2[exposure.name, c] for c in layout.channels]))
        found = np.array(
            [
                along_y @ (image - image.mean()) @ along_x
                for image in (np.asarray(f, np.float64) for f in frames_of(exposure.name))
            ]
        )
        found = found - found.mean()  # what is fixed is no pattern that changes
        total += complex((found**2).sum()) / variance**2
        size += float((np.abs(found) ** 2).sum()) / variance**2
        count += len(found)
    if count < _LEAST or size == 0:
        return None
    share = abs(total) / size
    return True if share > _ONE_LINE else (False if share < _CIRCLE else None)
