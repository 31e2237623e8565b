"""What a model says that the bank's numbers should be, and how far a recording is from it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np
import scipy.optimize
import scipy.special
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.scalars import OF_MEAN_FRAMES
from analysis.mismatch.contrasts import Contrasts, contrasts
from analysis.mismatch.fewpairs import widening
from analysis.mismatch.heavytails import chances, degrees
from analysis.mismatch.layout import Layout
from analysis.mismatch.vector import Vector
from analysis.mismatch.wander import by_lines, wandering_dn2

Array = NDArray[np.float64]
_OWN = 40.0  # degrees of freedom that the closed form, scaled by name, is worth for a number
_POOLED = 160.0  # and for the tails: a scale is shared by all numbers of a name
_LEAST_SCALE = 0.8
_OF_PIXELS, _OF_LINES = "fixed_pixel_variance", ("fixed_row_variance", "fixed_column_variance")
_SEVERAL = 5  # numbers of a name that tell whether they are alike
_FEWEST = 7  # degrees of freedom of a spread that stands alone
_RARE = 1e-5  # chance of a departure that counts, among some hundred numbers
_UNLIKE = 1e-4  # chance of spreads that differ so
_ODD = 1e-3  # chance of simulations so far off that scores are not normal, or closed forms no help
_COMB = 0.4  # relative error of the codes' imbalance that a model predicts


@dataclass(frozen=True)
class Null:
    """Mean and spread of every number under a model.

    Attributes
    ----------
    keys
        Of the numbers, then of the contrasts.
    mean, sd
        Of the numbers, under the model; the error of the mean is in the spread.
    known
        Which numbers can be judged.
    contrasts
        Sums of departures over exposures.
    contrast_mean, contrast_sd
        Of the contrasts, under the model.
    degrees
        Degrees of freedom of the spread: departures are Student's.
    tails
        Those of numbers and contrasts whose own law has heavier tails; inf: it has not.
    """

    keys: tuple[Key, ...]
    mean: Array
    sd: Array
    known: NDArray[np.bool_]
    contrasts: Contrasts
    contrast_mean: Array
    contrast_sd: Array
    degrees: float
    tails: Array

    def departures(self, seen: Vector) -> Array:
        """Return departures in standard deviations, of numbers and contrasts; 0 where unknown."""
        single = self._single(seen.values)
        sums = (self.contrasts.matrix @ single - self.contrast_mean) / self.contrast_sd
        return np.concatenate([single, sums])

    def _single(self, values: Array) -> Array:
        usable = self.known & np.isfinite(values)
        z = np.zeros(len(values))
        z[usable] = (values[usable] - self.mean[usable]) / self.sd[usable]
        return z

    def chances(self, departures: Array) -> Array:
        """Return the two-sided probability of each departure."""
        return chances(departures, self.tails, self.degrees)


def null_of(
    layout: Layout, simulated: Sequence[Vector], seen: Vector, unsure: Array | None = None
) -> Null:
    """Return the null from simulated recordings.

    The closed-form errors are scaled, name by name, to the spread that the simulations show; each
    number's own spread counts by its degrees of freedom, and alone where spreads of a name differ
    as chance does not make them, or a contrast's is not what its parts say. Scores of the highest
    of many bins are standard normal in white noise: so they are taken, unless the simulations deny
    it. `unsure`: the square of what else leaves means unsure, if any.
    """
    values = np.stack([one.values for one in simulated])
    errors = np.stack([one.errors for one in simulated])
    count = len(simulated)
    known = np.isfinite(values).all(0) & np.isfinite(seen.values) & np.isfinite(errors).all(0)
    mean = np.where(known, np.nan_to_num(values).mean(0), 0.0)
    error = np.where(known, np.sqrt(np.mean(np.where(np.isfinite(errors), errors, 1.0) ** 2, 0)), 1)
    error = error * _grown(seen.keys, mean)
    own = np.where(known, ((np.nan_to_num(values) - mean) ** 2).sum(0) / (count - 1), 1) / error**2
    scale, worth, tails = _by_name(seen.keys, own, known, count - 1)
    blended = tails**2 * (worth * scale + (count - 1) * own) / (worth + count - 1)
    sd = error * np.sqrt(np.maximum(blended, _LEAST_SCALE**2) * (1 + 1 / count))
    besides = np.where(known, unsure, 0.0) if unsure is not None and unsure.size else 0.0 * sd
    sd = np.sqrt(sd**2 + besides)
    normal = known & _normal(seen.keys, np.where(known, np.nan_to_num(values), 0.0))
    mean, sd = np.where(normal, 0.0, mean), np.where(normal, 1.0, sd)
    # How deep a comb of codes is hangs on the numbers of the camera: on electrons of several DN.
    comb = np.array([key.statistic == "code_imbalance" for key in seen.keys])
    sd = np.where(comb, np.hypot(sd, _COMB * mean), sd)
    recorded = np.where(known, np.nan_to_num(seen.values), 0.0)
    wide = widening(seen.keys, np.where(known, np.nan_to_num(values), 0.0), error, recorded)
    known &= np.isfinite(wide)
    sd = np.where(known, sd * wide, sd)
    wander = np.where(known, wandering_dn2(layout, seen.keys, mean, recorded), 0.0)
    sd = np.sqrt(sd**2 + wander)
    wander = np.sqrt(wander) / sd
    sums = contrasts(layout, Vector(seen.keys, seen.values, sd), known)
    parts = np.where(known, (np.nan_to_num(values) - mean) / sd, 0.0)
    along = parts @ sums.matrix.T
    spread = (along**2).sum(0) / (count - 1)
    alike = _shared(sums, [one.shared for one in simulated], sd)
    alike += _together(sums, drawn_together(seen.keys, mean, known), seen.keys)
    # No simulation wanders: it has the rest.
    expected = (1 - sums.matrix**2 @ wander**2 + alike) / (1 + 1 / count)
    pooled = (_OWN * expected + (count - 1) * spread) / (_OWN + count - 1)
    alone = spread * (_farther(count - 1) / _farther(_OWN + count - 1)) ** 2
    pooled = np.where(_denied(along.var(0, ddof=1) / expected, count - 1), alone, pooled)
    # The same few recordings leave all numbers unsure, at worst to the same side.
    aside = (np.abs(sums.matrix) @ (np.sqrt(besides) / sd)) ** 2
    aside += _wandering(sums, wander, seen.keys)
    return Null(
        (*seen.keys, *sums.keys),
        mean,
        sd,
        known,
        sums,
        np.zeros(len(sums.keys)),
        np.sqrt(np.maximum(pooled, _LEAST_SCALE**2) * (1 + 1 / count) + aside),
        _POOLED + count - 1,
        degrees(
            (*seen.keys, *sums.keys),
            np.hstack([parts, along]),
            np.concatenate([known, np.ones(len(sums.keys), bool)]),
        ),
    )


def _shared(sums: Contrasts, shared: Sequence[Array], sd: Array) -> Array:
    """Return what numbers that exposures share add to the variance of contrasts, 1 of no others.

    `shared` are the variances that exposures share, of each simulation: they count as far as these
    agree on it.
    """
    if any(own.size != sd.size for own in shared):
        return np.zeros(len(sums.keys))
    mean, noise = np.mean(shared, 0), np.var(shared, 0, ddof=1) / len(shared)
    kept = np.where(mean > 0, mean**3 / np.maximum(mean**2 + noise, 1e-300), 0.0)
    return _of_parts(sums.matrix, np.minimum(np.sqrt(kept) / sd, 1.0))


def _together(sums: Contrasts, part: Array, keys: Sequence[Key]) -> Array:
    """Return what numbers of one fixed pattern add to the variance of contrasts over exposures."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i in np.flatnonzero(part).tolist():
        groups.setdefault((keys[i].statistic, keys[i].channel), []).append(i)
    added = np.zeros(len(sums.keys))
    for which in groups.values():
        added += _of_parts(sums.matrix[:, which], part[which])
    return added


def _wandering(sums: Contrasts, part: Array, keys: Sequence[Key]) -> Array:
    """Return the variance that frames which wander bring contrasts: all channels of one as one."""
    groups: dict[str, list[int]] = {}
    for i in np.flatnonzero(part).tolist():
        groups.setdefault(keys[i].exposure, []).append(i)
    added = np.zeros(len(sums.keys))
    for which in groups.values():
        added += (sums.matrix[:, which] @ part[which]) ** 2
    return added


def _of_parts(matrix: Array, part: Array) -> Array:
    """Return by how much variances of contrasts grow where numbers have a part in common."""
    return np.asarray((matrix @ part) ** 2 - matrix**2 @ part**2)


def drawn_together(keys: Sequence[Key], mean: Array, known: NDArray[np.bool_]) -> Array:
    """Return the part that a sensor's fixed pattern has in the scatter of each number, 0 to 1.

    Mean frames of several exposures show one pattern beside noise of their own. Its mean squares
    correlate as the square of the share that the pattern has in the mean square, which is known by
    those of pixels over noise, and of lines and surfaces over pixels. Lines make surfaces.
    """
    squares = {
        (key.statistic, key.place): max(float(value), 1.0) ** 3
        for key, value, told in zip(keys, mean, known, strict=True)
        if key.scope == "exposure" and key.statistic in (_OF_PIXELS, *_OF_LINES) and told
    }
    part = np.zeros(len(keys))
    for i, key in enumerate(keys):
        if key.scope != "exposure" or key.statistic not in OF_MEAN_FRAMES or not known[i]:
            continue
        coarser = key.is_cube_root and key.statistic != _OF_PIXELS
        own = max(float(mean[i]), 1.0) ** 3 if coarser else 1.0
        if key.statistic == "fixed_smooth_variance":
            own = max(own, *(squares.get((lines, key.place), 1.0) for lines in _OF_LINES))
        part[i] = 1 - 1 / (squares.get((_OF_PIXELS, key.place), 1.0) * own)
    return part


def _grown(keys: Sequence[Key], mean: Array) -> Array:
    """Return by how much closed-form errors grow where a model has more than white noise.

    The cube root of a mean square scatters in proportion to itself. A level moves as the means of
    its frames do, whose variance has a number of its own, beside that of lines.
    """
    lines = by_lines(keys, mean)
    frames = {
        key.place: sqrt(max(float(value), 1.0) ** 3 * lines.get(key.place, 1.0))
        for key, value in zip(keys, mean, strict=True)
        if key.statistic == "frame_variance" and key.scope == "exposure"
    }
    grown = [
        frames.get(key.place, 1.0)
        if key.statistic == "level"
        else max(float(value), 1.0)
        if key.is_cube_root
        else 1.0
        for key, value in zip(keys, mean, strict=True)
    ]
    return np.array(grown)


def _normal(keys: Sequence[Key], values: Array) -> NDArray[np.bool_]:
    """Return which numbers are scores that simulations, (recording, number), show as normal.

    The highest of bins that overlap is often less than that of as many apart, and nothing is said
    of less: how far they lie above 0 counts, by the law of squares each of which is none in half of
    all cases (Self & Liang 1987, "Asymptotic properties of maximum likelihood estimators", case 5).
    """
    scores = np.array([key.is_score for key in keys], bool)
    count = len(values)
    square = (np.maximum(values, 0.0) ** 2).sum(0)
    above = np.arange(1, count + 1)
    chance = scipy.stats.binom.pmf(above, count, 0.5) @ scipy.special.chdtrc(
        above[:, np.newaxis], square
    )
    return np.asarray(scores & (chance >= _ODD))


def _by_name(
    keys: Sequence[Key], own: Array, known: NDArray[np.bool_], dof: int
) -> tuple[Array, Array, Array]:
    """Return what a name says of the ratio of mean squared spread to closed form, of each number.

    The ratio, the degrees of freedom that it is worth beside a number's own `dof`, and by how much
    farther tails of fewer reach. A statistic and scope of which some spread otherwise than others,
    as few strong pixels do where noise is low, says as much as its logarithms scatter less than
    chance lets them (Smyth 2004, "Linear models and empirical Bayes methods"). Few numbers leave
    the closed form its say, unless they deny it: then each has its own and that of the others.
    """
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(keys):
        if known[i]:
            groups.setdefault((key.statistic, key.scope), []).append(i)
    scale, worth, tails = np.ones(len(keys)), np.full(len(keys), _OWN), np.ones(len(keys))
    for which in groups.values():
        size, total = len(which), float(own[which].sum())
        scale[which] = (total + 4.0) / (size + 4.0)
        if unlike := _unlike(own[which], dof):
            scale[which], worth[which] = unlike
        elif size < _SEVERAL and _denied(np.array(total / size), size * dof):
            scale[which] = (total - own[which]) / max(size - 1, 1)
            worth[which] = (size - 1) * dof
        tails[which] = _farther(worth[which[0]] + dof) / _farther(_OWN + dof)
    return scale, worth, tails


def _denied(ratio: Array, dof: int) -> NDArray[np.bool_]:
    """Return whether variances are larger than expected by such ratios not by chance.

    By themselves those of next to no simulations say nothing: they are never denied.
    """
    return np.asarray((scipy.special.chdtrc(dof, ratio * dof) < _ODD) & (dof >= _FEWEST))


def _unlike(own: Array, dof: int) -> tuple[float, float] | None:
    """Return the variance of variances that chance alone does not scatter so, and its worth.

    None: they are as like as chance lets them be. Of few it is worth nothing.
    """
    if len(own) < (2 if dof >= _FEWEST else _SEVERAL):
        return None
    logs = (
        np.log(np.maximum(own, _LEAST_SCALE**2))
        - float(scipy.special.digamma(dof / 2))
        + log(dof / 2)
    )
    by_chance = float(scipy.special.polygamma(1, dof / 2))
    scatter = float(logs.var(ddof=1))
    if (len(own) - 1) * scatter / by_chance < scipy.special.chdtri(len(own) - 1, _UNLIKE):
        return None
    if len(own) < _SEVERAL:
        return 1.0, 0.0
    half = _with_trigamma(scatter - by_chance)
    typical = exp(float(logs.mean()) + float(scipy.special.digamma(half)) - log(half))
    return typical, min(2 * half, _OWN)


def _with_trigamma(value: float) -> float:
    """Return where the trigamma function has a value."""
    of_log = scipy.optimize.brentq(
        lambda x: float(scipy.special.polygamma(1, exp(x))) - value, -12.0, 12.0
    )
    return exp(of_log)


def _farther(dof: float) -> float:
    """Return how far out a Student's variate lies at a small chance."""
    return -float(scipy.special.stdtrit(dof, _RARE))


def adjusted(chances: Array, weights: Array) -> Array:
    """Return weighted Holm's adjusted probabilities: family-wise, step-down (Holm 1979).

    A number of weight w may use w times the share of the error rate that one of weight 1 may.
    """
    scaled = chances / weights
    order = np.argsort(scaled)
    left = weights[order][::-1].cumsum()[::-1]
    result = np.empty(len(chances))
    result[order] = np.maximum.accumulate(np.minimum(1.0, scaled[order] * left))
    return result
