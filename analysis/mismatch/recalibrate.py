"""The base model's numbers, fitted again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import inf, isfinite, log, nan, sqrt

import numpy as np

from analysis.mismatch.basefit import CLIPPED_SHARE, BaseFit, Offsets, colour, fit_base
from analysis.mismatch.bending import bending_offsets, bends, bent_by
from analysis.mismatch.flattened import flattened
from analysis.mismatch.layout import Layout, Place, sites
from analysis.mismatch.limited import lit
from analysis.mismatch.model import Model, Sites
from analysis.mismatch.observe import Level, Observation
from analysis.mismatch.staging import with_pictures
from analysis.mismatch.touches import SPIKES
from analysis.mismatch.undone import WHOLE, halfway, narrow, rounding, together, undone
from dsis.camera import BaseNoise, Camera, Segment
from dsis.effects.quantisation import Quantisation
from dsis.measures.spikes import SPIKED

_ROUNDS, _FINE_ROUNDS = 4, 8  # the latter where each pixel is rounded in its own way
_COARSE_ROUNDS = 24  # by coarse codes: what a filter leaves of noise is halfway there each time
_LEAST = 0.01  # of a signal: with the above, half a thousandth of it is as good as none
_SAME = 0.05  # of an error: the fit has settled
_CLOSER = 0.3  # a round's change beside that of the one before, unless two have shown it
_SWITCH_DEVIANCE = 12.0  # by which another gap must fit better before the switch is moved
_MOST_OFFSETS = 1.1  # variance of pixels' means beside that of noise: a cut moves by tenths of 1 %
_CHANCE = 2.0  # standard errors, that a given number may well be off
_HIDDEN_CHANCE = 4.0  # that are extrapolated from flats
_FREE = 5  # numbers of two lines and a switch
_APART = 1.005  # ratio of signals from which they are two levels


@dataclass(frozen=True)
class Calibrated:
    """The re-calibrated model and what it was fitted with.

    Attributes
    ----------
    model
        Camera and clean signals.
    fit
        The base numbers and their errors.
    residual
        The same with what the model itself says of rounding: what simulations are judged by.
    offsets
        What rounding, clipping and the camera's own effects add.
    switches
        Where read-out segments change, DN above black.
    left_out
        Exposures that were not fitted.
    bent
        What the camera's own effects add, of the offsets.
    settled
        Whether another round would change nothing.
    held
        The first segment's intercept, where the recording does not tell it: see `_held`.
    cut
        Darks that are fitted though some of their noise is cut off: see `_cut`.
    """

    model: Model
    fit: BaseFit
    residual: BaseFit
    offsets: Offsets
    switches: tuple[float, ...]
    left_out: frozenset[str]
    bent: Offsets
    settled: bool = False
    held: float | None = None
    cut: frozenset[str] = frozenset()

    @property
    def sums(self) -> frozenset[str]:
        """Sums of simulated frames that a `refit` needs beside those that are always made."""
        return frozenset({SPIKES} if self.offsets.bulk_dn2 else ())

    def refit(self, layout: Layout, levels: Mapping[Place, Level]) -> BaseFit:
        """Return the base numbers of another observation, fitted in the same way."""
        camera = self.model.camera
        return fit_base(
            layout,
            levels,
            self.switches,
            self.offsets,
            black_dn=camera.black_level - layout.black_dn,
            left_out=self.left_out,
            slopes=[s.slope for s in camera.noise.segment],
            intercept=self.held,
            cut=self.cut,
        )


def calibrate(
    camera: Camera,
    layout: Layout,
    seen: Observation,
    interpolated: str | None,
    *,
    seed: int,
    jobs: int,
    near: Calibrated | None = None,
) -> Calibrated:
    """Return the base model with its numbers fitted to an observation.

    `near` is a model of the same observation with much the same effects: a start.
    """
    switches = tuple(s.upper_dn for s in camera.noise.segment if s.upper_dn is not None)
    left_out = frozenset([interpolated] if interpolated else [])
    skewness = {at: own["skewness"][0] for at, own in seen.scalars.items() if "skewness" in own}
    left_out |= flattened(layout, seen.levels, camera, skewness)
    start = camera.black_level - layout.black_dn
    slopes = [s.slope for s in camera.noise.segment]
    spiky = _spiky(seen.levels)
    fine = narrow(seen.levels, codes_of(camera), spiky=spiky)
    bending = spiky or bends(camera.effect, narrow=fine)
    effects = near.bent if near is not None and bending else Offsets()
    known = near is not None and _bends_alike(near, camera, spiky=spiky, fine=fine)

    held: float | None = None
    cut = _cut(layout, seen)

    def before_codes(effects: Offsets, noise: BaseNoise) -> Offsets:
        own = camera.model_copy(update={"noise": noise})
        return undone(own, layout, seen.levels, codes_of(camera), effects, spiky=spiky)

    def fitted(
        offsets: Offsets, at: tuple[float, ...], levels: Mapping[Place, Level] = seen.levels
    ) -> BaseFit:
        free = partial(fit_base, black_dn=start, left_out=left_out, slopes=slopes)
        return free(layout, levels, at, offsets, intercept=held, cut=cut)

    before: BaseFit | None = None
    change, noise = nan, near.model.camera.noise if near is not None and known else camera.noise
    settled = False
    rounds = _FINE_ROUNDS if codes_of(camera) == WHOLE else _COARSE_ROUNDS
    for _ in range(rounds if fine else _ROUNDS if bending else 1):
        recorded = before_codes(effects, noise)
        if held is None and (fine or before is None):  # beside what effects add darks may hide it
            held = _held(camera, fitted(recorded, switches), hidden=_hidden(layout, recorded))
        fit = fitted(recorded, switches)
        settled = known
        if before is not None:
            last, change = change, _change(before, fit, seen.levels)
            settled = change <= _SAME or _left(change, last) <= _SAME
        if len(switches) == 1 and not settled:
            many, added = recorded.fitted(seen.levels)
            again = partial(fitted, replace(added, bulk_dn2={}), levels=many)
            switches = _moved(many, left_out, switches, fit, again)
            fit = fitted(recorded, switches)
        # Where each pixel is rounded in its own way the user's numbers are the better start.
        first = fine and bending and before is None and not (known or effects.variance_dn2)
        own = camera if first else with_numbers(camera, fit, switches, layout.black_dn)
        before, noise = fit, own.noise
        model = Model(own, lit(own, layout, signals_of(layout, fit)))
        if settled:
            break
        made = bending_offsets(model, layout, seed + 1, jobs, spiky=spiky, narrow=fine)
        # What is rounded by itself swings about where both agree.
        swings = fine and effects.variance_dn2 and made.variance_dn2
        effects = halfway(effects, made) if swings else made
    if layout.scenes:
        model = with_pictures(model, layout, fit, effects, seed=seed + 1, jobs=jobs)
    by_codes = rounding(model, layout, fit, codes_of(model.camera), spiky=spiky)
    offsets = together(by_codes, effects)
    final = fitted(offsets, switches)
    return Calibrated(model, fit, final, offsets, switches, left_out, effects, settled, held, cut)


def _cut(layout: Layout, seen: Observation) -> frozenset[str]:
    """Return darks whose variances are fitted though the lowest code cuts some samples off.

    Where it does in every dark they alone tell the read noise. It is normal, and what a cut leaves
    of it is known, if all pixels have the same offset: not where their means scatter beyond noise.
    """
    darks = [e.name for e in layout.uniform if e.kind == "dark"]
    levels = [seen.levels[name, channel] for name in darks for channel in layout.channels]
    if any(level.clipped_low <= CLIPPED_SHARE for level in levels):
        return frozenset()

    def alike(name: str) -> bool:
        numbers = [seen.scalars[name, c]["fixed_pixel_variance"][0] for c in layout.channels]
        return all(number**3 < _MOST_OFFSETS for number in numbers)

    return frozenset(name for name in darks if alike(name))


def _hidden(layout: Layout, recorded: Offsets) -> bool:
    """Return whether codes hide the noise of every dark, of one or more."""
    darks = [(e.name, c) for e in layout.uniform if e.kind == "dark" for c in layout.channels]
    return bool(darks) and not any(isfinite(recorded.stretch[place]) for place in darks)


def _held(camera: Camera, fit: BaseFit, *, hidden: bool) -> float | None:
    """Return the camera's own intercept where a fit does not tell it; None: it does.

    Where darks are cut off at the lowest code, bright flats alone may know of it: no better than
    that it may as well be the given one, or none, or twice that. It would move from one simulation
    to the next by more than itself, and all that depends on read noise with it. Nor does it where
    codes hide the noise of every level, or of all darks (`hidden`) and the given one may well be.
    """
    given, own = camera.noise.segment[0].intercept, fit.pieces[0]
    if not (isfinite(own.intercept_error) or isfinite(own.slope_error)):
        return given
    size = max(given, abs(own.intercept))
    untold = isfinite(own.intercept_error) and own.intercept_error > size
    most = _HIDDEN_CHANCE if hidden else _CHANCE
    chance = abs(own.intercept - given) <= most * own.intercept_error
    return given if (untold or hidden) and chance else None


def _bends_alike(near: Calibrated, camera: Camera, *, spiky: bool, fine: bool) -> bool:
    """Return whether a model that has settled differs in no effect that bends, nor in a switch."""
    own = near.model.camera
    asked = partial(bent_by, spiky=spiky, narrow=fine)
    return (
        near.settled
        and spiky == bool(near.offsets.bulk_dn2)
        and [s.upper_dn for s in own.noise.segment] == [s.upper_dn for s in camera.noise.segment]
        and asked(own.effect) == asked(camera.effect)
    )


def _change(one: BaseFit, other: BaseFit, levels: Mapping[Place, Level]) -> float:
    """Return by how much two fits differ at most, in errors, or shares of a signal.

    A fall of the light takes of level and variance alike: slope and intercept know nothing of it.
    """
    changes = [
        (signal, other.signal_dn[place], max(levels[place].level_error_dn, _LEAST * signal))
        for place, signal in one.signal_dn.items()
    ]
    for a, b in zip(one.pieces, other.pieces, strict=True):
        changes += [(a.slope, b.slope, a.slope_error)]
        changes += [(a.intercept, b.intercept, a.intercept_error)]
    changes += [
        (value, other.black_dn[c], one.black_error_dn[c]) for c, value in one.black_dn.items()
    ]
    return max((_in_errors(*own) for own in changes), default=0.0)


def _left(change: float, last: float) -> float:
    """Return what further rounds would change, each the same share of the one before."""
    share = change / last if isfinite(last) and last > 0 else _CLOSER
    return change * share / (1 - share) if share < 1 else inf


def _in_errors(a: float, b: float, error: float) -> float:
    if not isfinite(error) or a == b:
        return 0.0
    change = abs(a - b) / error if error > 0 else inf
    return change if isfinite(change) else inf


def with_numbers(
    camera: Camera, fit: BaseFit, switches: Sequence[float], nominal_black_dn: float
) -> Camera:
    """Return a camera with the base numbers of a fit."""
    ends: list[float | None] = [*switches, None]
    segments = tuple(
        Segment(
            upper_dn=end,
            slope=max(piece.slope, 0.0),
            intercept=piece.intercept,
            slope_se=piece.slope_error if isfinite(piece.slope_error) else None,
            intercept_se=piece.intercept_error if isfinite(piece.intercept_error) else None,
        )
        for piece, end in zip(fit.pieces, ends, strict=True)
    )
    black = nominal_black_dn + float(np.mean(list(fit.black_dn.values())))
    noise = BaseNoise(shot=camera.noise.shot, segment=segments)
    return camera.model_copy(update={"noise": noise, "black_level": max(black, 0.0)})


def signals_of(layout: Layout, fit: BaseFit) -> dict[str, Sites]:
    """Return the clean signal of each exposure: by its light where that is known."""
    signals = {}
    where = sites(layout.cfa)
    for e in layout.uniform:
        values = np.zeros((2, 2))
        for channel, (y, x) in where.items():
            if e.kind == "dark":
                value = 0.0
            elif e.light is not None and colour(channel) in fit.light_dn:
                value = fit.light_dn[colour(channel)] * e.light
            elif channel in ("Gr", "Gb"):
                value = (fit.signal_dn[e.name, "Gr"] + fit.signal_dn[e.name, "Gb"]) / 2
            else:
                value = fit.signal_dn[e.name, channel]
            if channel == "MONO":
                values[:] = value
            else:
                values[y, x] = value
        signals[e.name] = np.maximum(values, 0.0)
    return signals


def code_step(camera: Camera) -> float:
    """Return the step between codes, DN: coarser than 1 where the camera quantises."""
    return codes_of(camera)[0]


def codes_of(camera: Camera) -> tuple[float, float]:
    """Return the step between codes and the lowest code, its phase, DN: 1 and 0, or coarser."""
    own = [(e.step_dn, e.phase_dn) for e in camera.effect if isinstance(e, Quantisation)]
    return max(own, key=lambda one: one[0], default=(1.0, 0.0))


def _spiky(levels: Mapping[Place, Level]) -> bool:
    """Return whether spikes dominate variances: the base numbers are then those of the many."""
    return any(level.variance_dn2 > SPIKED * level.bulk_dn2 > 0 for level in levels.values())


def _moved(
    levels: Mapping[Place, Level],
    left_out: frozenset[str],
    switches: tuple[float, ...],
    fit: BaseFit,
    fitted: Callable[[tuple[float, ...]], BaseFit],
) -> tuple[float, ...]:
    """Return the switch; moved to another gap between levels where that fits far better.

    Beside how far variances scatter about the better one: codes of uneven widths, say, make them.
    """
    signals = sorted(set(fit.signal_dn.values()))

    def misfits(switch: float) -> list[float]:
        return [
            levels[place].dof / 2 * log(levels[place].variance_dn2 / expected) ** 2
            for place, expected in fitted((switch,)).expected_dn2.items()
            if place[0] not in left_out and levels[place].variance_dn2 > 0 and expected > 0
        ]

    def deviance(switch: float) -> float:
        return sum(misfits(switch))

    # Both greens of an exposure are one level; a switch may part its colours.
    gaps = [sqrt(max(a, b / 100) * b) for a, b in pairwise(signals) if b > _APART * a and b > 1.0]
    here = deviance(switches[0])
    best = min(gaps, key=deviance, default=switches[0])
    there = misfits(best)
    scatter = max(sum(there) / max(len(there) - _FREE, 1), 1.0)
    return (best,) if sum(there) < here - _SWITCH_DEVIANCE * scatter else switches
