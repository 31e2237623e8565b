"""Which of the frequencies that planes of every second pixel see alike whole frames show."""

from collections.abc import Sequence

import numpy as np

from analysis.mismatch.instance import Frequency
from analysis.mismatch.layout import Layout
from analysis.mismatch.projections import FramesOf, projections

_ASIDE = 3  # bins to the neighbours that say what is around


def strongest(layout: Layout, frames_of: FramesOf, frequencies: Sequence[Frequency]) -> Frequency:
    """Return the frequency at which frames vary most: one plane of a mosaic cannot tell aliases.

    What rows or columns of bins have in common, as row noise has, is no line.
    """
    across, down = _ASIDE / layout.columns, _ASIDE / layout.rows
    steps = ((0.0, 0.0), (-across, 0.0), (across, 0.0), (0.0, -down), (0.0, down))
    looked_at = [(fx + u, fy + w) for fx, fy in frequencies for u, w in steps]
    power = np.zeros(len(looked_at))
    for found in projections(layout, frames_of, looked_at):
        power += (np.abs(found) ** 2).sum(0)
    own, left, right, below, above = power.reshape(-1, len(steps)).T
    around = np.maximum(left + right, below + above) / 2
    return frequencies[int((own - around).argmax())]


def aliases(frequency: Frequency) -> list[Frequency]:
    """Return the frequencies that planes of every second pixel see as this one; not the mean's."""
    found = []
    for ax in (0.0, 0.5):
        for ay in (0.0, 0.5):
            fx, fy = ((f + a + 0.5) % 1 - 0.5 for f, a in zip(frequency, (ax, ay), strict=True))
            if abs(fx) + abs(fy) > 0:
                found.append((fx, fy))
    return found
