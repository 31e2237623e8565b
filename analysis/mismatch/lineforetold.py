"""What locked frames gain by a line that the other frames foretell.

A likelihood of pixels asks each locked frame for itself. Frames together know more: of a pattern
whose phase is kept but for its sign the others tell the phase, of any line the size; and few dark
frames, which alone may show it, are not hidden among many bright ones.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.instance import Frequency
from analysis.mismatch.layout import Layout
from analysis.mismatch.phaselaw import of_exposures, there_in
from analysis.mismatch.projections import LEAST, FramesOf, Power, projections

_FAR = (-23, -17, -13, -9, 9, 13, 17, 23)  # bins that say what rows or columns have in common
_NEAR = (-2, -1, 1, 2)  # bins that a line leaves as they are
_LEAST_EACH = 2  # frames of an exposure, that know what is fixed


def line_foretold(
    layout: Layout,
    frames_of: FramesOf,
    frequency: Frequency,
    locked: Mapping[str, Sequence[int]],
    *,
    kept: bool,
) -> NDArray[np.float64]:
    """Return what locked frames gain by a line that the others show: nats of each exposure.

    Odds of all frames less those of the others, by what these know: size, noise, and of a phase
    that is kept but for its sign the phase. Exposures are added one after another. An empty array
    where the others are too few, or show no power there, or as much beside.

    Parameters
    ----------
    layout, frames_of
        All frames, of one sensor.
    frequency
        Of the line, cycles per pixel along x and y.
    locked
        Numbers of frames, by the exposure's name.
    kept
        Whether the phase is kept but for its sign; else it is another in each frame.
    """
    fx, fy = frequency
    bins = (*_NEAR, *_FAR)
    across = [(fx + k / layout.columns, fy) for k in bins]
    down = [(fx, fy + k / layout.rows) for k in bins]
    power = Power.of(layout, projections(layout, frames_of, [frequency, *across, *down]))
    rest = [~np.isin(e.numbers, locked.get(e.name, ())) for e in layout.uniform]
    if any(own.sum() < _LEAST_EACH for own in rest):
        return np.zeros(0)
    others = tuple(
        own[some] - own[some].mean(0) for own, some in zip(power.found, rest, strict=True)
    )
    known, groups = Power(others, power.weights), []
    for first in (1, 1 + len(bins)):
        far = first + len(_NEAR)
        groups += [slice(first, far), slice(far, first + len(bins))]
    noise = known.ground(groups)
    known = known.over(noise)
    if known.frames < LEAST or not (size := float(known.excess[0])) > 0:
        return np.zeros(0)
    if any(known.crowded(range(near.start, near.stop), size) for near in groups[::2]):
        return np.zeros(0)
    real = all((2 * f) % 1 == 0 for f in frequency)
    sizes = [float(np.sqrt(size * weight)) for weight in known.weights]

    def part(own: NDArray[np.complex128], amplitude: float) -> NDArray[np.float64]:
        return there_in(own, amplitude, kept=kept, real=real)

    parts = [part(own[:, 0], a) for own, a in zip(known.found, sizes, strict=True)]
    gains, odds = [], of_exposures(parts)
    for i, own in enumerate(power.found):
        if rest[i].all():
            continue
        parts[i] = part(own[:, 0] / np.sqrt(noise[i]), sizes[i])
        gains.append(of_exposures(parts) - odds)
        odds += gains[-1]
    return np.array(gains)
