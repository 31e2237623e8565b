"""What whole frames say of a line: its phase from frame to frame, and which alias it is.

The frames are projected on the pattern. A pattern whose sign alone changes gives numbers on one
line through zero of the complex plane, free phases give a circle: |sum c^2| / sum |c|^2 is 1 or 0.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.instance import Frequency, frequency_of, same_line
from analysis.mismatch.layout import Layout
from dsis.effects import Effect

FramesOf = Callable[[str], Iterable[NDArray[np.generic]]]
_ONE_LINE, _CIRCLE = 0.75, 0.45
_LEAST = 8  # frames, to tell
_CLEAR = 8.0  # standard errors of the noise's power from which a line's phase is seen
_ASIDE = 3  # bins to the neighbours that say what is around
_PHASES = {
    "periodic_noise": "the pattern's phase is the same in all frames but for its sign",
    "bistable_pattern": "the pattern's phase is another in every frame",
}


@dataclass(frozen=True)
class WholeFrames:
    """What whole frames say of lines, asked once for each.

    Attributes
    ----------
    layout, frames_of
        The frames.
    """

    layout: Layout
    frames_of: FramesOf
    _shown: dict[Frequency, bool] = field(default_factory=dict)
    _kept: dict[Frequency, bool | None] = field(default_factory=dict)

    def shown(self, effect: Effect) -> bool:
        """Return whether an effect is no line of a mosaic, or the one that whole frames show."""
        frequency, layout = frequency_of(effect), self.layout
        if frequency is None or len(layout.channels) == 1:
            return True
        wrapped = ((frequency[0] + 0.5) % 1 - 0.5, (frequency[1] + 0.5) % 1 - 0.5)
        if wrapped not in self._shown:
            alike = aliases(wrapped)
            clearest = strongest(layout, self.frames_of, alike)
            for one in alike:
                self._shown[one] = same_line(one, clearest, layout.rows, layout.columns)
        return self._shown[wrapped]

    def denial(self, effect: Effect) -> str | None:
        """Return why a line's phase says that it is of the other kind; None: it does not.

        Interference and a bistable pattern are alike in power.
        """
        frequency = frequency_of(effect)
        if frequency is None:
            return None
        if frequency not in self._kept:
            self._kept[frequency] = keeps_phase(self.layout, self.frames_of, frequency)
        kept = self._kept[frequency]
        return (
            None
            if kept is None or kept == (effect.kind == "bistable_pattern")
            else (_PHASES[effect.kind])
        )


def keeps_phase(layout: Layout, frames_of: FramesOf, frequency: Frequency) -> bool | None:
    """Return whether the phase is kept; None where the frames cannot tell.

    Of stripes and checkerboards of single pixels, all of whose samples are real, it always is.

    Parameters
    ----------
    layout, frames_of
        The frames.
    frequency
        Cycles per pixel along x and y.
    """
    total, size, count = 0j, 0.0, 0
    for found in _projections(layout, frames_of, [frequency]):
        total += complex((found**2).sum())
        free = len(found) - 1
        size += float((np.abs(found) ** 2).sum()) - free  # noise has no phase to keep
        count += free
    if count < _LEAST or size < _CLEAR * np.sqrt(count):
        return None
    share = abs(total) / size
    return True if share > _ONE_LINE else (False if share < _CIRCLE else None)


def strongest(layout: Layout, frames_of: FramesOf, frequencies: Sequence[Frequency]) -> Frequency:
    """Return the frequency at which frames vary most: one plane of a mosaic cannot tell aliases.

    What rows or columns of bins have in common, as row noise has, is no line.
    """
    across, down = _ASIDE / layout.columns, _ASIDE / layout.rows
    steps = ((0.0, 0.0), (-across, 0.0), (across, 0.0), (0.0, -down), (0.0, down))
    looked_at = [(fx + u, fy + w) for fx, fy in frequencies for u, w in steps]
    power = np.zeros(len(looked_at))
    for found in _projections(layout, frames_of, looked_at):
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


def _projections(
    layout: Layout, frames_of: FramesOf, frequencies: Sequence[Frequency]
) -> Iterator[NDArray[np.complex128]]:
    """Yield of each exposure how its frames vary at each frequency: (frame, frequency).

    In units of the noise's standard deviation at one frequency.
    """
    fx, fy = np.array(frequencies).T
    y, x = np.arange(layout.rows)[:, np.newaxis], np.arange(layout.columns)[:, np.newaxis]
    down, turns = np.exp(-2j * np.pi * fy * y), 2 * np.pi * fx * x
    across = np.concatenate([np.cos(turns), -np.sin(turns)], 1)  # real: frames are
    for exposure in layout.uniform:
        variance = float(np.mean([layout.variance_dn2[exposure.name, c] for c in layout.channels]))
        found = []
        for frame in frames_of(exposure.name):
            image = np.asarray(frame, np.float64)
            real, imaginary = np.split((image - image.mean()) @ across, 2, axis=1)
            found.append((down * (real + 1j * imaginary)).sum(0))
        made = np.array(found)
        # What is fixed is no pattern that changes.
        yield (made - made.mean(0)) / np.sqrt(variance * y.size * x.size)
