"""Frames projected on plane waves: what is in a line, beside white noise."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.anysize import of_any_size
from analysis.mismatch.instance import Frequency
from analysis.mismatch.layout import Layout
from analysis.mismatch.phaselaw import kept_rather_than_free, strength_of, there

FramesOf = Callable[[str], Iterable[NDArray[np.generic]]]
LEAST = 8  # frames, to tell
_RAISED, _SHARE = 4.0, 0.3  # standard errors, and of the power, from which neighbours are raised
_ONE_LINE, _CIRCLE = 0.75, 0.45
_CLEAR = 8.0  # standard errors of the noise's power from which a line's phase is seen
SURE = 3.0  # of log-likelihood, to prefer one kind of phase
_ASKED = 4.0  # amplitude of one frame, in noise, of which likelihoods are asked as they are


@dataclass(frozen=True)
class Power:
    """Projections of frames on patterns, and the power beyond white noise.

    Attributes
    ----------
    found
        Of each exposure: (frame, frequency), noise at 1.
    weights
        Of each exposure: one over its variance, DN^-2; of what is in proportion to the signal, its
        square over its variance.
    """

    found: tuple[NDArray[np.complex128], ...]
    weights: tuple[float, ...]

    @classmethod
    def of(cls, layout: Layout, projections: Iterator[NDArray[np.complex128]]) -> "Power":
        """Return the power in projections of the frames of a layout, see `projections`."""
        weights = tuple(
            1 / float(np.mean([layout.variance_dn2[e.name, c] for c in layout.channels]))
            for e in layout.uniform
        )
        return cls(tuple(projections), weights)

    def at(self, which: Sequence[int]) -> "Power":
        """Return the same of some frequencies."""
        return replace(self, found=tuple(own[:, which] for own in self.found))

    def above(self, ground: float, level: float = 1.0) -> "Power":
        """Return the same beside noise of so much more power at a frequency, DN^2.

        `level`: of white noise, of which what makes neighbours alike leaves less at high
        frequencies.
        """
        return self.over([level + max(ground, 0.0) * w for w in self.weights])

    def over(self, noise: Sequence[float]) -> "Power":
        """Return the same beside noise of so much power at a frequency, white noise at 1."""
        return Power(
            tuple(own / np.sqrt(m) for own, m in zip(self.found, noise, strict=True)),
            tuple(w / m for w, m in zip(self.weights, noise, strict=True)),
        )

    def _of_light(self, layout: Layout) -> list["Power"]:
        """Return the same of what is constant, and in proportion to the signal: where codes move.

        Frames whose codes hardly ever move show no pattern, whatever there is.
        """
        asked = [
            (found, weight, np.mean([max(layout.signal_dn[e.name, c], 0.0) for c in own]))
            for found, weight, e in zip(self.found, self.weights, layout.uniform, strict=True)
            if (own := [c for c in layout.channels if (e.name, c) not in layout.still])
        ]
        found, weights, signals = zip(*asked, strict=True) if asked else ((), (), ())
        squares = zip(weights, signals, strict=True)
        grown = tuple(float(weight * signal**2) for weight, signal in squares)
        return [Power(found, weights), Power(found, grown)]

    @property
    def frames(self) -> int:
        """Independent frames: what is fixed was taken off."""
        return sum(len(own) - 1 for own in self.found)

    def lifted(self, groups: Sequence[slice]) -> "Power":
        """Return the same beside noise that is, in each exposure, as groups of frequencies are.

        The largest of their medians, where it is more than white.
        """
        return self.over(self.ground(groups))

    def ground(self, groups: Sequence[slice]) -> list[float]:
        """Return that noise of each exposure, white noise at 1."""
        noise = []
        for own in self.found:
            power = (np.abs(own) ** 2).sum(0) / max(len(own) - 1, 1)
            noise.append(max(1.0, *(float(np.median(power[group])) for group in groups)))
        return noise

    @property
    def level(self) -> NDArray[np.float64]:
        """Power of all exposures alike over that of white noise: (frequency,)."""
        return np.asarray(sum((np.abs(own) ** 2).sum(0) for own in self.found) / self.frames)

    def _sum(self, power: int) -> float:
        parts = zip(self.found, self.weights, strict=True)
        return sum((len(own) - 1) * weight**power for own, weight in parts)

    @property
    def excess(self) -> NDArray[np.float64]:
        """Power of a pattern of one amplitude in all exposures, DN^2: (frequency,)."""
        parts = zip(self.found, self.weights, strict=True)
        total = sum(w * ((np.abs(own) ** 2).sum(0) - len(own) + 1) for own, w in parts)
        return np.asarray(total / self._sum(2))

    @property
    def error(self) -> float:
        """Standard error of the excess in white noise."""
        return float(1 / np.sqrt(self._sum(2)))

    def crowded(self, which: Sequence[int], power: float) -> bool:
        """Return whether neighbours of a line of a power, DN^2, are raised as well.

        Their median is asked: one of them may be a line itself.
        """
        beside = float(np.median(self.excess[which]))
        clear = beside / self.error * np.sqrt(len(which)) > _RAISED
        return bool(clear) and beside > _SHARE * power

    def strength(self, power: float, *, kept: bool, real: bool) -> tuple[float, float]:
        """Return the first pattern's amplitude over that of a power, DN^2, and its error."""
        if kept:
            own = [float(np.sqrt(power * w)) for w in self.weights]
            return strength_of([one[:, 0] for one in self.found], own, real=real)
        total = 0.0
        for found, weight in zip(self.found, self.weights, strict=True):
            n, each = len(found), power * weight
            total += weight**2 * ((n - 1) * (1 + 2 * each) + (1 - 1 / n) * each**2)
        return 1.0, float(np.sqrt(total) / self._sum(2) / power / 2)

    def there(self, power: float, *, kept: bool, real: bool) -> float:
        """Return the log-likelihood of a first pattern of about a power, DN^2, less that of noise.

        `kept`: its phase is kept but for its sign.
        """
        own = [float(np.sqrt(max(power, 0.0) * w)) for w in self.weights]
        return there([one[:, 0] for one in self.found], own, kept=kept, real=real)

    def of_any_size(self, *, real: bool) -> bool:
        """Return whether the first pattern's size is another in each frame, not its sign alone."""
        own = [float(np.sqrt(max(float(self.excess[0]), 0.0) * w)) for w in self.weights]
        return of_any_size([one[:, 0] for one in self.found], own, real=real) > SURE

    def grows(self, layout: Layout, *, real: bool) -> bool:
        """Return whether the first pattern is in proportion to the signal, and not constant.

        Darks tell, beside flats.
        """
        constant, lit = self._of_light(layout)
        if not any(lit.weights) or all(lit.weights):
            return False
        powers = [max(float(own.excess[0]), 0.0) for own in (lit, constant)]
        asked = list(zip((lit, constant), powers, strict=True))
        most = max(power * weight for own, power in asked for weight in own.weights) ** 0.5
        scale = _ASKED / max(most, _ASKED)  # of strong lines: both beside the same noise
        grown, same = (
            own.scaled(scale).there(power, kept=False, real=real) for own, power in asked
        )
        return powers[0] > 0 and grown - same > SURE

    def scaled(self, scale: float) -> "Power":
        """Return the same where patterns and what was found of them are so much smaller."""
        weights = tuple(weight * scale**2 for weight in self.weights)
        return Power(tuple(own * scale for own in self.found), weights)

    def bins(self, power: float) -> float:
        """Return the standard error of a line's frequency along an axis, in bins."""
        total = sum(
            (len(own) - 1) * power * w for own, w in zip(self.found, self.weights, strict=True)
        )
        return float(np.sqrt(1.5 / max(total, 1e-9)) / np.pi)

    def bins_apart(self, power: float) -> float:
        """Return the same where powers of frames are added, whatever their phases.

        Of a line of power s beside noise of 1 in each, noise times noise adds a share of 1 / s.
        """
        each = [power * w for w in self.weights]
        told = sum((len(own) - 1) * s**2 / (1 + s) for own, s in zip(self.found, each, strict=True))
        return float(np.sqrt(1.5 / max(told, 1e-9)) / np.pi)

    def chance(self, *, real: bool) -> float:
        """Return the chance of as much at the first frequency: a sum of squares as Gamma's.

        `real`: all samples of the pattern are real; then squares have one degree of freedom, not
        two.
        """
        mean, square = self._sum(1), self._sum(2)
        total = float(self.excess[0]) * square + mean
        spread = square * (2 if real else 1)
        return float(scipy.stats.gamma.sf(total * mean / spread, mean**2 / spread))

    def keeps_phase(self, *, real: bool) -> bool | None:
        """Return whether the first pattern's phase is kept but for its sign; None: untold."""
        free = self.frames
        if free < LEAST:
            return None
        if real:
            return True
        c = np.concatenate([own[:, 0] for own in self.found])
        size = float((np.abs(c) ** 2).sum()) - free  # noise has no phase to keep
        if size > _CLEAR * np.sqrt(free):
            share = abs(complex((c**2).sum())) / size
            if share > _ONE_LINE or share < _CIRCLE:
                return share > _ONE_LINE
        amplitude = np.sqrt(max(float(self.excess[0]), 0.0))
        own = [amplitude * np.sqrt(w) for w in self.weights]
        more = kept_rather_than_free([one[:, 0] for one in self.found], own)
        return None if abs(more) < SURE else bool(more > 0)


def projections(
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
