"""What whole frames gain by bands of light: a wave down the rows, in proportion to the signal.

Its phase is another in every frame, and where the lamp and the frames keep their rates moves on
steadily. A single number of the bank, the largest power of many, says less of bands that few
exposures show.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout
from analysis.mismatch.phaselaw import moving_on_in, of_exposures, there_in, turns_of
from analysis.mismatch.projections import LEAST, SURE, FramesOf, Power, projections

Part = tuple[NDArray[np.float64], NDArray[np.float64]]
"""What one exposure adds to the log-likelihood of free phases and of steady ones."""
_BETWEEN = (-1 / 3, 0.0, 1 / 3)  # bins by which a frequency may be off
_FAR = (-19, -15, -12, -9, -7, -5, 5, 7, 9, 12, 15, 19)  # bins that say what rows have in common
_NEAR = (-2, -1, 1, 2)  # bins that a band leaves as they are, and slow waves do not
_LEAST_EACH = 2  # frames of an exposure, that know what is fixed
_OFF, _STEP, _APART = 0.9, 0.06, 3  # bins about a peak, between places; steps of a parabola
_SLOWEST = 0.5  # cycles a frame: a slower wave is a slope
_CLEAR = 5.0  # standard errors of the power, from which a place is told
_LOWEST = 1.0  # cycles a frame: below, a wave is much like the frame's mean


def gain_of_bands(layout: Layout, frames_of: FramesOf, cycles: float) -> float:
    """Return the log-likelihood that frames gain by bands at a place not known before.

    Of all places where bands could be as likely, these take the share to which frames tell it:
    sqrt(2 pi) times its error, of the bins of a column (Laplace). Noise is, in each exposure,
    white, or what its rows have in common, or what slow waves leave beside the place. Where there
    are no neighbours on both sides only a phase that moves on steadily says anything: of 1/f noise
    the slowest waves stand out, too. Minus infinity where neighbours are raised as well, or where
    there is too little to tell.

    Parameters
    ----------
    layout, frames_of
        The frames.
    cycles
        Of the bands, in the rows of a frame.
    """
    found = _found(layout, frames_of, cycles)
    numbers = [np.array(e.numbers, np.float64) for e in layout.uniform]
    bands = None if found is None else _bands(found, numbers)
    if bands is None:
        return -np.inf
    share = min(np.sqrt(2 * np.pi) * bands.bins, 1.0)
    return bands.odds(bands.parts) - float(np.log(layout.rows / 2 / share))


def turns_of_bands(
    layout: Layout, frames_of: FramesOf, cycles: float
) -> tuple[float, float] | None:
    """Return the share of a turn by which bands move on in each frame, and its error; None: unsure.

    Of the exposure that shows them best, where phases that move on steadily are likelier than free
    ones. Of few frames free phases add up in the mean frame, which has their pattern then; steady
    ones cancel, and single frames keep all of it: so bands would be taken for deeper than they are.
    """
    found = _found(layout, frames_of, cycles)
    numbers = [np.array(e.numbers, np.float64) for e in layout.uniform]
    bands = None if found is None else _bands(found, numbers)
    if bands is None:
        return None
    free, steady = (of_exposures(own) for own in zip(*bands.parts, strict=True))
    if steady - free < SURE:
        return None
    powers = [bands.power * weight for weight in bands.seen.weights]
    best = int(np.argmax([p * n.size for p, n in zip(powers, numbers, strict=True)]))
    return turns_of(bands.seen.found[best][:, 0], numbers[best], powers[best] ** 0.5)


def place_of_bands(
    layout: Layout, frames_of: FramesOf, cycles: float
) -> tuple[float, float] | None:
    """Return where bands are, cycles in the rows of a frame, and its error; None: nothing is seen.

    Where a cosine and a sine explain most of what frames have beside their mean, each at its own
    amplitude: by least squares, for of few cycles the three are not as good as independent, and a
    peak of the power is pulled off by the same wave that runs backwards. The error is that of the
    likelihood's bend, and no less than the bound of Rife & Boorstyn (IEEE Transactions on
    Information Theory 20, 1974).

    Parameters
    ----------
    layout, frames_of
        The frames.
    cycles
        Where to look, from `_OFF` below to as much above.
    """
    rows = layout.rows
    tried = np.arange(-_OFF, _OFF + _STEP / 2, _STEP) + cycles
    tried = tried[(tried >= _SLOWEST) & (tried <= rows / 2)]
    far = [cycles + k for k in _FAR if _LOWEST <= cycles + k <= rows / 2]
    if tried.size < 2 * _APART + 1 or not far:
        return None
    places = [(0.0, own / rows) for own in (*tried, *far)]
    power = Power(tuple(projections(layout, frames_of, places)), tuple(_light(layout) ** 2))
    if not any(power.weights):
        return None
    seen = power.over(power.ground([slice(tried.size, None)]))
    likely: NDArray[np.float64] = np.zeros(tried.size)
    size = max(float(seen.excess[: tried.size].max()), 0.0)
    for own, weight in zip(seen.found, seen.weights, strict=True):
        share = size * weight / (1 + size * weight)
        likely += share * _explained(own[:, : tried.size], tried, rows)
    best = int(likely.argmax())
    if size < _CLEAR * seen.error or not _APART <= best < tried.size - _APART:
        return None
    below, at, above = (float(likely[best + k * _APART]) for k in (-1, 0, 1))
    bend = below - 2 * at + above
    step = _APART * _STEP
    error = max(seen.bins(size), step / np.sqrt(-bend)) if bend < 0 else np.inf
    return float(tried[best] + step * (below - above) / (2 * bend)), float(error)


def _explained(
    found: NDArray[np.complex128], cycles: NDArray[np.float64], rows: int
) -> NDArray[np.float64]:
    """Return half of what cosines and sines explain of frames, noise at 1: (place,).

    By projections (frame, place) of frames less their mean, which know both waves as if they were
    independent of one another, and of it.
    """
    angle = 2 * np.pi * cycles[:, np.newaxis] * np.arange(rows) / rows
    cosine, sine = np.cos(angle), np.sin(angle)
    cosine, sine = (own - own.mean(1, keepdims=True) for own in (cosine, sine))
    a, b, c = (2 * (u * v).mean(1) for u, v in ((cosine, cosine), (cosine, sine), (sine, sine)))
    u, v = found.real, -found.imag
    return np.asarray((c * u**2 - 2 * b * u * v + a * v**2).sum(0) / (a * c - b**2))


def foretold(
    layout: Layout,
    frames_of: FramesOf,
    cycles: float,
    locked: Mapping[str, Sequence[int]],
) -> NDArray[np.float64]:
    """Return what locked frames gain by bands that the others show: nats of each exposure.

    Odds of all frames less those of the others, by what these know: place, size, noise, and of a
    phase that moves on steadily where it will be. Exposures are added one after another. None where
    the others show no bands.

    Parameters
    ----------
    layout, frames_of
        All frames, of one sensor.
    cycles
        Of the bands, in the rows of a frame.
    locked
        Numbers of frames, by the exposure's name.
    """
    found = _found(layout, frames_of, cycles)
    numbers = [np.array(e.numbers, np.float64) for e in layout.uniform]
    rest = [~np.isin(e.numbers, locked.get(e.name, ())) for e in layout.uniform]
    if found is None or any(own.sum() < _LEAST_EACH for own in rest):
        return np.zeros(0)
    others = tuple(
        own[some] - own[some].mean(0) for own, some in zip(found.power.found, rest, strict=True)
    )
    known = replace(found, power=replace(found.power, found=others))
    bands = _bands(known, [n[some] for n, some in zip(numbers, rest, strict=True)])
    if bands is None:
        return np.zeros(0)
    parts, gains = bands.parts, []
    odds = bands.odds(parts)
    for i, (own, noise) in enumerate(zip(found.power.found, bands.noise, strict=True)):
        if rest[i].all():
            continue
        parts[i] = bands.part(i, own[:, bands.place] / np.sqrt(noise), numbers[i])
        gains.append(bands.odds(parts) - odds)
        odds += gains[-1]
    return np.array(gains)


@dataclass(frozen=True)
class _Found:
    """Projections at the places tried, at their neighbours, far away: bands in DN of signal 1.

    `amid`: there are neighbours on both sides.
    """

    power: Power
    near: slice
    far: slice
    amid: bool


@dataclass(frozen=True)
class _Bands:
    """Bands at the best place: their projections, power, and the noise of each exposure there."""

    seen: Power
    power: float
    place: int
    noise: Sequence[float]
    numbers: Sequence[NDArray[np.float64]]
    amid: bool

    @property
    def bins(self) -> float:
        """Standard error of the place."""
        return self.seen.bins(self.power)

    @property
    def parts(self) -> list[Part]:
        """What each exposure says of them, see `odds`."""
        pairs = zip(self.seen.found, self.numbers, strict=True)
        return [self.part(i, own[:, 0], number) for i, (own, number) in enumerate(pairs)]

    def part(self, exposure: int, own: NDArray[np.complex128], number: NDArray[np.float64]) -> Part:
        """Return what projections (frame,) of an exposure say: of any phase, of a steady one."""
        amplitude = float(np.sqrt(self.power * self.seen.weights[exposure]))
        free = there_in(own, amplitude, kept=False, real=False)
        return free, moving_on_in(own, number, amplitude)

    def odds(self, parts: Sequence[Part]) -> float:
        """Return the log-likelihood of bands in projections of all exposures, less that of noise.

        Their phase is another in each frame, or moves on steadily: as likely beforehand. Where
        there are no neighbours on both sides slow noise may be there, whose phase is free: then
        only what a steady one gains over that says anything.
        """
        free, steady = (of_exposures(own) for own in zip(*parts, strict=True))
        if self.amid:
            return float(np.logaddexp(free, steady) - np.log(2))
        return steady - max(free, 0.0)


def _found(layout: Layout, frames_of: FramesOf, cycles: float) -> _Found | None:
    """Return the projections about a place; None: too few neighbours, frames, or no light."""
    rows = layout.rows
    tried = [cycles + k for k in _BETWEEN]
    near = [cycles + k for k in _NEAR if _LOWEST <= cycles + k <= rows / 2]
    far = [cycles + k for k in _FAR if _LOWEST <= cycles + k <= rows / 2]
    if not near or not far:
        return None
    places = [*tried, *near, *far]
    found = tuple(projections(layout, frames_of, [(0.0, own / rows) for own in places]))
    power = Power(found, tuple(_light(layout) ** 2))
    beside = slice(len(tried), len(tried) + len(near))
    amid = len(near) == len(_NEAR)
    return _Found(power, beside, slice(-len(far), None), amid) if any(power.weights) else None


def _bands(found: _Found, numbers: Sequence[NDArray[np.float64]]) -> _Bands | None:
    """Return the bands that projections show; None where they show none."""
    noise = found.power.ground([found.near, found.far])
    seen = found.power.over(noise)
    if seen.frames < LEAST:
        return None
    tried = range(found.near.start)
    best = int(seen.excess[: len(tried)].argmax())
    power = float(seen.excess[best])
    if not power > 0 or seen.crowded(range(found.near.start, found.near.stop), power):
        return None
    return _Bands(seen.at([best]), power, best, noise, numbers, found.amid)


def _light(layout: Layout) -> NDArray[np.float64]:
    """Return the signal of each exposure over its noise, of all channels together."""
    found = []
    for exposure in layout.uniform:
        places = [(exposure.name, channel) for channel in layout.channels]
        signal = max(float(np.mean([layout.signal_dn[place] for place in places])), 0.0)
        variance = float(np.mean([layout.variance_dn2[place] for place in places]))
        found.append(signal / np.sqrt(variance))
    return np.array(found)
