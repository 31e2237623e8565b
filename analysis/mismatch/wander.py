"""How far levels are off by chance where frames wander as no model explains yet.

A level is the mean of few frames. Where these scatter by more than the model's do - light
flickers, an offset drifts - it is no better known than that allows: no bend is told by it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.layout import Layout, Place

Array = NDArray[np.float64]
_LINES = frozenset({"row_variance", "column_variance"})


def by_lines(keys: Sequence[Key], model: Array) -> dict[Place, float]:
    """Return by how much lines make the variance of frames' means larger than pixels do, by place.

    The cubes of rows' and columns' numbers are ratios to that of pixels; `frame_variance` is one to
    all of these.
    """
    found: dict[Place, float] = {}
    for key, value in zip(keys, model, strict=True):
        if key.statistic in _LINES and key.scope == "exposure":
            found[key.place] = found.get(key.place, 1.0) + max(float(value), 1.0) ** 3 - 1
    return found


def wandering_dn2(layout: Layout, keys: Sequence[Key], model: Array, recorded: Array) -> Array:
    """Return the variances of levels that frames bring which wander beyond the model, DN^2.

    Frames' means, by the cube root of the ratio of their variance to what pixels and lines give
    them, have the excess of their cubes, a mean of n frames 1 / n of it. 0 for all other numbers,
    and where frames scatter less.

    Parameters
    ----------
    layout
        Exposures.
    keys
        Of the numbers.
    model, recorded
        The numbers expected, and those of the recording: (number,); 0 where unknown.
    """
    frames = {e.name: len(e.numbers) for e in layout.uniform}
    lines = by_lines(keys, model)
    pixels = layout.rows * layout.columns / len(layout.channels)
    excess = {
        key.place: max(float(recorded[i] ** 3 - model[i] ** 3), 0.0)
        for i, key in enumerate(keys)
        if (key.statistic, key.scope) == ("frame_variance", "exposure")
    }
    return np.array(
        [
            excess[key.place]
            * lines.get(key.place, 1.0)
            * layout.variance_dn2[key.place]
            / pixels
            / frames[key.exposure]
            if key.statistic == "level" and key.place in excess
            else 0.0
            for key in keys
        ]
    )
