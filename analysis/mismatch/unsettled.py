"""First frames that differ from all after them: the light begins, or the sensor has not settled.

The first frame of an exposure may follow darkness, or another light: what lags behind is missing in
it, and so its mean is off, in every exposure alike. That is no wander of frames and no bend of
levels, and would be taken for both: such frames are left out, and said to be.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, log, sqrt

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.bank.scalars import score_of_log
from analysis.mismatch.finding import Finding, Mismatch, OmittedEffect, Where
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from dsis.recording import RecordedExposure, Recording

Array = NDArray[np.float64]
STATISTIC = "first_frames"
_LEAST = 4  # frames of an exposure that is asked
_READ = 10  # frames of an exposure that are looked at
_MOST = 3  # first frames that may be left out
_CLEAR = 5.0  # times the scatter of the others: the middle one of all exposures
_CHANCE = 1e-6
_WANDER = {"dark": "black_level_drift", "flat": "flicker"}
_AGREES = 0.25  # of what a first frame lacks, by which image lag may be off


@dataclass(frozen=True)
class Unsettled:
    """First frames of exposures of one kind that are left out, and how they differ.

    Attributes
    ----------
    kind
        `dark` or `flat`.
    exposures
        All of that kind; scenes are lit as flats are.
    frames
        How many of each.
    z
        The chance of any such deviation as a standard normal score; its sign is that of the first
        frame's deviation.
    deviation_dn, share
        Of the first frame from those kept: the middle one of all exposures, DN, and as a share of
        the signal above black (nan in darks).
    """

    kind: str
    exposures: tuple[str, ...]
    frames: int
    z: float
    deviation_dn: float
    share: float

    def mismatch(self) -> Mismatch:
        """Return where it differs, in the words of a report."""
        first = "first frame" if self.frames == 1 else f"first {self.frames} frames"
        size = f"{abs(self.deviation_dn):.3g} DN"
        if np.isfinite(self.share):
            size = f"{abs(self.share):.3g} % of the signal"
        way = "above" if self.deviation_dn > 0 else "below"
        says = (
            f"The {first} of every {self.kind} differ{'s' if self.frames == 1 else ''} from those "
            f"after: the very first is {size} {way} them. What it follows is still in it, or it "
            "has not settled: it is left out of all that is said here."
        )
        where = Where(self.exposures, self.kind, frames=tuple(range(self.frames)))
        return Mismatch(STATISTIC, self.z, 2 * float(scipy.stats.norm.sf(abs(self.z))), where, says)


def unsettled(recording: Recording, source: Source) -> tuple[Unsettled, ...]:
    """Return the first frames that differ alike in the exposures of a kind; mostly none."""
    black = recording.sensor.black_level
    darks, flats = recording.of_kind("dark"), recording.of_kind("flat")
    scenes = recording.of_kind("scene")  # which are lit as flats are
    kinds = (
        _of_kind(darks, "dark", black, source),
        _of_kind([*flats, *scenes], "flat", black, source),
    )
    return tuple(one for one in kinds if one is not None)


def without(split: Split, some: Sequence[Unsettled]) -> Split:
    """Return the split without first frames."""
    count = {name: one.frames for one in some for name in one.exposures}
    if not count:
        return split
    train, select, locked = (
        {
            name: kept
            for name, numbers in part.items()
            if (kept := tuple(n for n in numbers if n >= count.get(name, 0)))
        }
        for part in (split.train, split.select, split.locked)
    )
    return replace(split, train=train, select=select, locked=locked)


def told_beside(words: frozenset[str], some: Sequence[Unsettled]) -> frozenset[str]:
    """Return the effects that may be named where first frames differ.

    What they follow decays over the next ones too: a wander of frames is not told from that.
    """
    return words - {_WANDER[one.kind] for one in some}


def with_first_frames(found: Finding, some: Sequence[Unsettled]) -> Finding:
    """Return a finding with first frames among what differs.

    Image lag that is named explains them, where its fraction is what the first frame lacks: light
    that follows darkness.
    """
    if not some:
        return found
    lags = [float(_fraction(one)) for one in found.omitted_physics if one.effect == "image_lag"]
    mismatches, left = list(found.mismatches), list(found.unexplained)
    for one in some:
        lag = any(abs(-one.share / 100 - f) < _AGREES * f for f in lags)
        mismatch = one.mismatch()
        mismatches.append(replace(mismatch, explained_by="image_lag" if lag else None))
        left += [] if lag else [mismatch]
    verdict = found.verdict if found.verdict == "omitted_physics" else "unexplained"
    mismatches.sort(key=lambda m: -abs(m.z))
    left.sort(key=lambda m: -abs(m.z))
    return replace(found, mismatches=tuple(mismatches), unexplained=tuple(left), verdict=verdict)


def _fraction(effect: OmittedEffect) -> float:
    value = effect.parameters["fraction"].value
    return value if isinstance(value, float) else value[0]


def _of_kind(
    some: Sequence[RecordedExposure], kind: str, black_dn: float, source: Source
) -> Unsettled | None:
    """Return the first frames of a kind of exposure that differ; None: none do."""
    means = {
        exposure.name: _frame_means(source, exposure.name, range(min(len(exposure.frames), _READ)))
        for exposure in some
        if exposure.kind == kind and len(exposure.frames) >= _LEAST
    }
    count, first = 0, None
    while count < _MOST:
        # Shorter exposures do as the longer ones.
        kept = [own[:, count:] for own in means.values() if own.shape[1] - count >= _LEAST]
        found = _deviation(kept) if len(kept) > 1 else None
        if found is None:
            break
        first = first or found
        count += 1
    if first is None:
        return None
    long = [own[0] for own in means.values() if own.shape[1] > count]
    values = np.array([own[0] - own[count:].mean() for own in long])
    signals = np.array([own[count:].mean() - black_dn for own in long])
    share = float(np.median(values / signals)) * 100 if kind == "flat" else float("nan")
    names = tuple(exposure.name for exposure in some)
    return Unsettled(kind, names, count, first, float(np.median(values)), share)


def _frame_means(source: Source, name: str, numbers: Sequence[int]) -> Array:
    """Return the means of frames and the variances that noise of single pixels gives them."""
    means, before, last = [], np.zeros(0), np.zeros(0)
    for frame in source.frames(name, numbers):
        before, last = last, np.asarray(frame, np.float64)
        means.append(last.mean())
    noise = float(np.var(last - before) / 2 / last.size)
    return np.stack([means, np.full(len(means), noise)])


def _deviation(some: Sequence[Array]) -> float | None:
    """Return the score of first frames that deviate alike from those after; None: they do not.

    By Student's t of each exposure's first frame against the others, whose scatter is taken no
    smaller than single pixels' noise makes it; chances of one side are combined by Fisher's method.
    """
    t = np.array([_t(own[0], own[1, 0]) for own in some])
    degrees = np.array([own.shape[1] - 2 for own in some])
    if not abs(np.median(t)) > _CLEAR:
        return None
    sign = float(np.sign(np.median(t)))
    chances = np.maximum(scipy.stats.t.sf(sign * t, degrees), 1e-300)
    combined = float(scipy.stats.chi2.logsf(-2 * np.log(chances).sum(), 2 * len(some)))
    combined = min(combined if np.isfinite(combined) else -inf, 0.0) + log(2)
    if combined > log(_CHANCE):
        return None
    return sign * score_of_log(max(combined, -1e5))


def _t(means: Array, noise: float) -> float:
    others = means[1:]
    scatter = sqrt(max(float(others.var(ddof=1)), noise))
    return float((means[0] - others.mean()) / scatter / sqrt(1 + 1 / others.size)) if scatter else 0
