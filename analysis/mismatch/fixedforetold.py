"""What locked frames gain by fixed deviations of lines that the other frames foretell.

A likelihood of pixels learns a fixed pattern site by site, and wave by wave: weak offsets of whole
lines are lost in that. Means of lines, of which each exposure has one, are normal variates that
know all that frames say of them. A pattern that each exposure draws anew, or movement that frames
share, repeats within an exposure only: what is fixed is what exposures have in common.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from analysis.mismatch.bank.linemeans import Axis, LineMeans
from analysis.mismatch.fewlines import grown_by
from analysis.mismatch.observe import Observation
from analysis.mismatch.state import State
from dsis.effects import Effect

Array = NDArray[np.float64]
FIXED_LINES: Mapping[str, Axis] = {
    "row_fpn": "row",
    "row_prnu": "row",
    "column_fpn": "column",
    "column_prnu": "column",
}
_MOST = 3.0  # nats that one line may count: a line that is out of order is no law of lines


@dataclass(frozen=True)
class Odds:
    """Odds that lines deviate by what is fixed, nats of each line; empty: nothing tells.

    Attributes
    ----------
    added, all
        Of all frames less those of the others, and of all: against nothing.
    own
        Of all: against what each exposure has alone, an offset and a gain of likeliest sizes.
    """

    added: Array = field(default_factory=lambda: np.zeros(0))
    all: Array = field(default_factory=lambda: np.zeros(0))
    own: Array = field(default_factory=lambda: np.zeros(0))


_NOTHING = Odds()


def fixed_foretold(bare: State, before: Observation, effect: Effect) -> Odds:
    """Return what locked frames gain by a fixed deviation of lines, and all: nats of each line.

    The first are odds of all frames less those of the others. What lines deviate by without the
    effect, an offset and a gain, is in both models, and so is what an exposure has alone. Empty
    arrays: the effect is none of lines, or nothing tells.

    Parameters
    ----------
    bare
        The model without the effect, of all frames.
    before
        What was observed of the frames that are not locked.
    effect
        The effect, as those frames tell it.
    """
    axis = FIXED_LINES.get(effect.kind)
    everything = bare.setting.seen.lines
    uniform = [e.name for e in bare.setting.layout.uniform]
    names = [n for n in uniform if (n, axis) in everything and (n, axis) in before.lines]
    if axis is None or not names:
        return _NOTHING
    whole = [everything[name, axis] for name in names]
    some = [before.lines[name, axis] for name in names]
    fit, channels = bare.calibrated.fit, bare.setting.layout.channels
    signal = np.array([np.mean([fit.signal_dn[name, c] for c in channels]) for name in names])
    of_means = ("fixed_pixel_variance", f"fixed_{axis}_variance")
    shared = _shared(whole, grown_by(bare, names, of_means, bare.null.mean), signal)
    return odds_of_lines(whole, some, signal, _deviation(effect, signal), shared)


def odds_of_lines(
    whole: Sequence[LineMeans],
    some: Sequence[LineMeans],
    signal_dn: Array,
    deviation_dn: Array,
    shared: tuple[float, float],
) -> Odds:
    """Return the odds that lines deviate: of `whole` less those of `some`, and of `whole`.

    Parameters
    ----------
    whole, some
        Means of lines of all frames of each exposure, and of some of them.
    signal_dn
        Of each exposure. What an exposure has alone is an offset and a gain, of likeliest sizes
        with the deviation and without.
    deviation_dn
        Standard deviation of what is fixed in each exposure, of one shape in all of them.
    shared
        Variances of a fixed offset, DN^2, and of a fixed gain that lines have either way.
    """
    moving = np.array([own.moving.mean() for own in whole])
    added = [i for i, own in enumerate(whole) if own.frames > some[i].frames]
    if not added or not (moving > 0).all():
        return _NOTHING
    which = np.array([*range(len(whole)), *added])
    seen = np.stack([*(own.fixed for own in some), *(_added(whole[i], some[i]) for i in added)])
    frames = [*(own.frames for own in some), *(whole[i].frames - some[i].frames for i in added)]
    signal, deviation = signal_dn[which], deviation_dn[which]
    without = np.diag(moving[which] / np.array(frames))
    without += shared[0] + shared[1] * np.outer(signal, signal)
    same = (which[:, np.newaxis] == which).astype(np.float64)
    own = np.stack([same, same * np.outer(signal, signal)][: 1 + bool(signal.any())])
    beside = without + np.outer(deviation, deviation)
    first = len(whole)
    odds = _loglik(seen, beside) - _loglik(seen, without)
    known = _loglik(seen[:first], beside[:first, :first])
    known = known - _loglik(seen[:first], without[:first, :first])
    # Whether it is the exposures' own is another question than whether there is anything.
    one, other = (_loglik(seen, _with_own(seen, law, own)) for law in (beside, without))
    made = odds - known, odds, one - other
    return Odds(*(np.clip(part, -_MOST, _MOST) for part in made))


def _with_own(seen: Array, covariance: Array, own: Array) -> Array:
    """Return a covariance with the likeliest amounts of what each exposure has of its own."""
    scale = np.trace(covariance) / np.trace(own, axis1=1, axis2=2).clip(np.finfo(float).tiny)

    def total(amounts: Array) -> Array:
        return np.asarray(covariance + np.tensordot(amounts * scale, own, 1))

    def misfit(amounts: Array) -> float:
        return -float(_loglik(seen, total(amounts)).mean())

    found = scipy.optimize.minimize(misfit, np.full(len(own), 0.1), bounds=[(0, None)] * len(own))
    return total(found.x)


def _deviation(effect: Effect, signal_dn: Array) -> Array:
    """Return the standard deviation of lines in exposures of some signals, DN."""
    values = effect.model_dump()
    if "sigma_dn" in values:
        return np.full(signal_dn.size, float(values["sigma_dn"]))
    return np.asarray(float(values["sigma_percent"]) / 100 * signal_dn)


def _added(whole: LineMeans, some: LineMeans) -> Array:
    """Return the means of lines over the frames that only the first has."""
    total = whole.frames * whole.fixed - some.frames * some.fixed
    return np.asarray(total / (whole.frames - some.frames))


def _shared(
    whole: Sequence[LineMeans], grown: Sequence[float], signal_dn: Array
) -> tuple[float, float]:
    """Return the variances of an offset and a gain that lines have without the effect.

    `grown`: by which factor the model's lines differ more than noise of pixels makes them.
    """
    noise = np.array([own.noise_dn2 / own.frames for own in whole])
    design = np.stack([np.ones(signal_dn.size), signal_dn**2], 1) / noise[:, np.newaxis]
    left = np.maximum(np.array(grown) - 1, 0.0)  # what lines move by is not in it
    found, _ = scipy.optimize.nnls(design, left)
    return float(found[0]), float(found[1])


def _loglik(seen: Array, covariance: Array) -> Array:
    """Return the log-likelihood of each column of a normal law, but for a constant."""
    square = (seen * np.linalg.solve(covariance, seen)).sum(0)
    return np.asarray(-(square + np.linalg.slogdet(covariance)[1]) / 2)
