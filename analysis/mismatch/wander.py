"""How far levels are off by chance where frames wander as no model explains yet.

A level is the mean of few frames. Where these scatter by more than the model's do - light
flickers, an offset drifts - it is no better known than that allows: no bend is told by it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.layout import Layout

Array = NDArray[np.float64]


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
    pixels = layout.rows * layout.columns / len(layout.channels)
    excess = {
        key.place: max(float(recorded[i] ** 3 - model[i] ** 3), 0.0)
        for i, key in enumerate(keys)
        if (key.statistic, key.scope) == ("frame_variance", "exposure")
    }
    return np.array(
        [
            excess[key.place] * layout.variance_dn2[key.place] / pixels / frames[key.exposure]
            if key.statistic == "level" and key.place in excess
            else 0.0
            for key in keys
        ]
    )
