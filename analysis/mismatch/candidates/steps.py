"""Steps of codes that are no whole number: which codes never occur tells them."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dsis.effects.quantisation import whole_codes
from dsis.measures import Middle

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
FEW = 8  # absent codes that a converter of uneven steps may have: fewer tell no step
_WRONG = 0.01  # of the codes that are absent, or of the others: a step may foretell so many wrongly
_FINE = 0.04  # of what absent codes leave open: so far apart are steps that are tried
_FINER = 0.25  # of that, at last
_ENDS = 2.0  # codes by which a range is no whole number of steps
_AT_ONCE = 1 << 18  # steps times codes
_MOST = 20_000  # steps tried: where more are left the codes tell none
# Divisors of a step that is a ratio: of small numbers, or as gains are written and stored.
_PLAIN = (*range(1, 65), 100, 128, 256, 512, 1000, 1024)
_BETWEEN = 11  # steps of a range, its ends among them
_EDGE, _DIGITS = 1e-6, 6  # of a code


@dataclass(frozen=True)
class Seen:
    """Codes that occur and that never do, within some ranges: float64, ascending.

    Attributes
    ----------
    there, absent
        The codes, DN.
    """

    there: Array
    absent: Array

    @classmethod
    def of(cls, some: Sequence[Middle], never: Collection[int]) -> "Seen":
        """Return what histograms show, of which the codes `never` occur in any."""
        codes = {c for one in some for c in range(one.first, one.last + 1)}
        own = {int(c) for one in some for c in one.absent}
        ordered = (sorted(codes - own), sorted(own & set(never)))
        return cls(*(np.array(part, np.float64) for part in ordered))

    @property
    def size(self) -> int:
        """How many codes there are."""
        return self.there.size + self.absent.size

    @property
    def reach(self) -> float:
        """How far apart the first and the last are, DN."""
        return float(np.ptp(np.concatenate([self.there, self.absent])))

    def wrong(self, steps: Array, slack: float = 0.0) -> tuple[Counts, Array]:
        """Return how many codes each of some steps foretells wrongly, and its best phase, DN.

        Those that lie nearer than `slack`, DN, to where codes begin and end count as foretold.
        """
        size = steps[:, np.newaxis]
        # On a circle of one step codes that occur fill an arc of one code, absent ones the rest.
        few, aside = (self.absent, 0.5) if self.absent.size < self.there.size else (self.there, 0.0)
        turns = np.exp(2j * np.pi * few / size).mean(1)
        phases = (np.angle(turns) / (2 * np.pi) + aside) * steps
        there, absent = self._beside(steps, phases)
        low = np.maximum(there.max(1) - 0.5, absent.max(1) - steps + 0.5)
        high = np.minimum(there.min(1) + 0.5, absent.min(1) - 0.5)
        phases = (phases + (low + high) / 2) % steps
        phases[phases >= steps] = 0.0  # of a negative that rounds to none
        there, absent = self._beside(steps, phases)
        outside = np.abs(there) > 0.5 + _EDGE + slack
        inside = np.minimum(absent, size - absent) < 0.5 - _EDGE - slack
        return outside.sum(1) + inside.sum(1), phases

    def missed(self, step: float, phase: float) -> int:
        """Return how many codes whole steps from a phase on foretell wrongly."""
        most = max(self.there[-1], self.absent[-1])
        made = whole_codes(np.arange(most // step + 2), step, phase)
        return int((~np.isin(self.there, made)).sum() + np.isin(self.absent, made).sum())

    def _beside(self, steps: Array, phases: Array) -> tuple[Array, Array]:
        """Return how far codes lie beside a step: (step, code), those that occur to either side."""
        size, phase = steps[:, np.newaxis], phases[:, np.newaxis]
        half = size / 2
        return (self.there - phase + half) % size - half, (self.absent - phase) % size


def fractional_step(some: Collection[Middle], never: Collection[int]) -> tuple[float, float] | None:
    """Return step and phase, DN, of codes some of which never occur; None: there is no such step.

    A digital gain of 1.5 makes codes 0, 2, 3, 4, 6 .. of 0, 1, 2, 3, 4, or 0, 2, 3, 5, 6 .. where
    halves are rounded up, which is a phase of a quarter. How many are left out tells the step
    roughly, and which are left out, of exposures ever farther from one another, ever more exactly.
    It must foretell both kinds but for a hundredth. Of steps that do as well a ratio of small
    numbers is taken, else hundredths or 1 / 128 and the like, and the phase 0.

    Parameters
    ----------
    some
        Middles of histograms, of steps of one code.
    never
        Codes absent from all of them.
    """
    own = [one for one in some if one.step == 1]
    seen = Seen.of(own, never)
    if min(seen.there.size, seen.absent.size) < FEW:
        return None
    parts = [part for one in own if (part := Seen.of([one], never)).size >= FEW]
    there = sum(part.there.size for part in parts)
    if not there:
        return None
    step = sum(part.size for part in parts) / there
    span = step * _ENDS * len(parts) / there
    runs = [(max(step - span, 1.0), step + span)]
    arc = min(step - 1, 1.0)  # of the circle of one step, that absent codes fill, or the others
    for stage, fine in (*((stage, 1.0) for stage in _ever_farther(own, never)), (seen, _FINER)):
        apart = fine * _FINE * arc * step / max(stage.reach, step)
        if sum(high - low for low, high in runs) > _MOST * apart:
            return None
        runs = list(_likeliest(stage, runs, apart, fine * _FINE * arc))
    return _plainest(seen, runs)


def _ever_farther(own: Sequence[Middle], never: Collection[int]) -> Iterator[Seen]:
    """Return the codes of the histogram that tells most, then beside it of ever farther ones."""
    first = max(own, key=lambda one: (min(one.absent.size, one.codes - one.absent.size), one.codes))
    beside = sorted(own, key=lambda one: abs(one.first + one.last - first.first - first.last))
    for count in range(1, len(beside) + 1):
        seen = Seen.of(beside[:count], never)
        if min(seen.there.size, seen.absent.size) > 1:
            yield seen


def _likeliest(
    seen: Seen, runs: Sequence[tuple[float, float]], apart: float, slack: float
) -> Iterator[tuple[float, float]]:
    """Return the ranges of steps within some that foretell fewest codes wrongly.

    `slack`: by which steps that are tried part at the far end; halves lie on edges.
    """
    grids = [low + apart * np.arange(int((high - low) / apart) + 2) for low, high in runs]
    steps = np.concatenate(grids)
    steps = steps[steps > 1]
    pieces = np.array_split(steps, -(-steps.size * seen.size // _AT_ONCE))
    counts = np.concatenate([seen.wrong(piece, slack)[0] for piece in pieces])
    best = steps[counts == counts.min()]
    for own in np.split(best, np.flatnonzero(np.diff(best) > 1.5 * apart) + 1):
        yield max(float(own[0]) - apart, 1.0), float(own[-1]) + apart


def absent(some: Iterable[Middle]) -> frozenset[int]:
    """Return the codes that are absent wherever one of some histograms could hold them."""
    own = list(some)
    found = {int(code) for one in own for code in one.absent}
    there = {
        int(code)
        for one in own
        for code in np.setdiff1d(range(one.first, one.last + 1, one.step), one.absent)
    }
    return frozenset(found - there)


def _plainest(seen: Seen, runs: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Return a step within one of some ranges, and a phase, that foretell nearly all codes.

    Of those that do as well the ratio of the smallest numbers, with the phase 0 if it can be.
    """
    tried: list[tuple[int, int, float, float]] = []
    for low, high in runs:
        divisor = next((d for d in _PLAIN if int(high * d) >= low * d), 0)
        plain = [(int(high * divisor) / divisor, divisor)] if divisor else []
        others = np.linspace(low, high, _BETWEEN)[1:-1].tolist()
        for own, rank in (*plain, *((other, _PLAIN[-1] + 1) for other in others)):
            phase = round(float(seen.wrong(np.array([own]))[1][0]), _DIGITS)
            tried.append((seen.missed(own, 0.0), 2 * rank, own, 0.0))
            tried.append((seen.missed(own, phase), 2 * rank + 1, own, phase))
    wrong, _, step, phase = min(tried)
    few = min(seen.there.size, seen.absent.size)
    return (step, phase) if wrong <= _WRONG * few else None
