"""Classifier two-sample test: how well locked frames are told from simulated ones.

A sample is one place of 32 x 32 pixels seen in a locked frame of every exposure: fixed features
(`features`), averaged over exposures twice, all alike and where the base noise is least. A ridge
logistic regression learns on other frames and places than it is tested on. 0.5: nothing left.

It cannot see what leaves a patch as it is: levels against light (nonlinearity, dark current, the
two greens), and what is too rare or too weak for one place of 32 x 32 pixels.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import rankdata

from analysis.mismatch.finding import Interval
from analysis.mismatch.prove.features import SIDE, patch_features
from analysis.mismatch.prove.held import Held, HeldExposure, thinned
from analysis.mismatch.prove.sites import site_means, spread_over
from analysis.mismatch.prove.virtual import Signals, base_of, clean_signal
from dsis.camera import Camera
from dsis.draw import Draw
from dsis.effects import Image

Array = NDArray[np.float64]
Index = NDArray[np.intp]
_LEAST_SENSORS, _MOST_SENSORS = 4, 6  # simulated for the one recorded
_SAMPLES = 72  # simulated, of each group of frames
_MOST_EXPOSURES = 12
_RIDGE = 5.0  # precision of a weight: features are standardised
_PLAIN = 2.0  # standard errors below which a feature is left out: samples are few
_STEPS = 8
_PLACES = 8  # groups of places
_FOLDS = 4


@dataclass(frozen=True)
class Auc:
    """Area under the receiver operating characteristic, with its 95 % interval."""

    value: float
    ci95: Interval


@dataclass(frozen=True)
class Samples:
    """Features of patches.

    Attributes
    ----------
    features
        (sample, feature).
    frames, places
        Which group of frames, which place: (sample,).
    sensors
        Which sensor, from 0: (sample,).
    """

    features: Array
    frames: Index
    places: Index
    sensors: Index


def auc_of(held: Held, camera: Camera, signals: Signals, *, seed: int) -> Auc | None:
    """Return how well locked frames are told from those of a camera; None: too few patches."""
    groups = max(min((len(e.numbers) for e in held.locked if len(e.numbers) > 1), default=0), 0)
    if groups < 2:
        return None
    taken = tuple(thinned(list(held.locked), _MOST_EXPOSURES))
    held = replace(held, exposures=taken)
    places = (held.shape[0] // SIDE) * (held.shape[1] // SIDE)
    if places < 2:
        return None  # places are left out in turn
    sensors = int(np.clip(-(-_SAMPLES // places), _LEAST_SENSORS, _MOST_SENSORS))
    base = base_of(camera)
    variance = {
        e.name: np.maximum(base.segments.variance_dn2(clean_signal(held, e, signals)), 0.05)
        for e in held.locked
    }
    recorded = _samples(held, variance, {e.name: _recorded(e) for e in held.locked}, groups)
    made = [
        _samples(held, variance, _simulated(camera, held, signals, seed, k), groups)
        for k in range(sensors)
    ]
    return classifier_auc(recorded, _joined(made))


@dataclass(frozen=True)
class _Seen:
    """Frames of an exposure: training mean and variance, locked frames, those before them."""

    mean: Array
    variance: Array
    locked: Array
    before: tuple[Array | None, ...]


def _recorded(e: HeldExposure) -> _Seen:
    before = tuple(None if b is None else b.astype(np.float64) for b in e.before)
    return _Seen(e.mean_dn, e.variance_dn2, e.codes.astype(np.float64), before)


def _simulated(
    camera: Camera, held: Held, signals: Signals, seed: int, replicate: int
) -> dict[str, _Seen]:
    seen = {}
    draw = Draw(seed).within("classifier", str(replicate))
    for e in held.locked:
        clean, temporal = clean_signal(held, e, signals), draw.within(e.name)

        def frame(
            number: int, e: HeldExposure = e, clean: Image = clean, temporal: Draw = temporal
        ) -> Array:
            image = camera.expose(
                clean,
                temporal,
                draw,
                number,
                held.grid,
                exposure_time_s=e.exposure_time_s,
            )
            return np.rint(image.astype(np.float64) + camera.black_level)

        known = {k: frame(k) for k in {*e.training, *e.numbers, *(k - 1 for k in e.numbers if k)}}
        training = np.stack([known[k] for k in e.training] or [np.zeros(held.shape)])
        locked = np.stack([known[k] for k in e.numbers])
        before = tuple(known.get(k - 1) for k in e.numbers)
        variance = training.var(0, ddof=1) if e.trained > 1 else np.zeros(held.shape)
        seen[e.name] = _Seen(training.mean(0), variance, locked, before)
    return seen


def _samples(
    held: Held, variance: Mapping[str, Array], seen: Mapping[str, _Seen], groups: int
) -> Samples:
    """Return the samples of one sensor."""
    least = min(float(v.min()) for v in variance.values())
    sums: list[list[Array]] = [[] for _ in range(groups)]
    weights: list[list[float]] = [[] for _ in range(groups)]
    for order, e in enumerate(held.locked):
        own = seen[e.name]
        share = least / float(variance[e.name].mean())
        for k, features in enumerate(_of_frames(held, e, own, variance[e.name])):
            group = (k + (order if len(e.numbers) < groups else 0)) % groups
            sums[group].append(features)
            weights[group].append(share)
    rows = [
        np.concatenate([np.mean(f, 0), np.average(f, 0, weights=w)], 1)
        for f, w in zip(sums, weights, strict=True)
    ]
    places = rows[0].shape[0]
    return Samples(
        np.concatenate(rows),
        np.repeat(np.arange(groups), places),
        np.tile(np.arange(places), groups),
        np.zeros(groups * places, np.intp),
    )


def _of_frames(held: Held, e: HeldExposure, own: _Seen, variance: Array) -> list[Array]:
    sd = np.sqrt(variance * (1 + 1 / max(e.trained, 1)))
    flat = spread_over(site_means(own.mean, held.cfa), held.shape, held.cfa)
    mean = (
        own.mean
        if e.trained
        else spread_over(site_means(own.locked.mean(0), held.cfa), held.shape, held.cfa)
    )
    pattern = (own.mean - flat) * np.sqrt(max(e.trained, 1) / variance)
    spread = own.variance / max(float(own.variance.mean()), 1e-9)
    return [
        patch_features(
            (codes - mean) / sd,
            None if before is None else (before - mean) / sd,
            codes.astype(np.intp),
            pattern,
            spread,
        )
        for codes, before in zip(own.locked, own.before, strict=True)
    ]


def _joined(parts: list[Samples]) -> Samples:
    return Samples(
        np.concatenate([p.features for p in parts]),
        np.concatenate([p.frames for p in parts]),
        np.concatenate([p.places for p in parts]),
        np.repeat(np.arange(len(parts)), [len(p.places) for p in parts]),
    )


def classifier_auc(recorded: Samples, simulated: Samples) -> Auc:
    """Return the cross-validated area under the curve, with its interval (Hanley & McNeil, 1982).

    Every sample is scored by a regression that saw neither its frames nor its place. Places share
    what is common to a frame, so where rows or levels wander the interval is somewhat narrow.
    """
    centre, scale = simulated.features.mean(0), simulated.features.std(0)
    scale = np.where(scale > 0, scale, 1.0)
    real, made = (np.clip((s.features - centre) / scale, -8, 8) for s in (recorded, simulated))
    areas, sizes = [], []
    for frames in _groups(recorded.frames, _FOLDS):
        for places in _groups(recorded.places, _PLACES):
            test = [
                np.isin(s.frames, frames) & np.isin(s.places, places) for s in (recorded, simulated)
            ]
            train = [
                ~np.isin(s.frames, frames) & ~np.isin(s.places, places)
                for s in (recorded, simulated)
            ]
            sensors = simulated.sensors[train[1]]
            weights = _regression(real[train[0]], made[train[1]], sensors)
            areas.append(_area(real[test[0]] @ weights, made[test[1]] @ weights))
            sizes.append(int(test[0].sum()))
    area = float(np.average(areas, weights=sizes))
    return Auc(area, _interval(area, len(real), len(made)))


def _groups(labels: Index, most: int) -> list[Index]:
    found = np.unique(labels)
    return [found[k :: min(most, found.size)] for k in range(min(most, found.size))]


def _regression(real: Array, made: Array, sensors: Index) -> Array:
    """Return the weights of a ridge logistic regression by Newton's steps; classes count alike.

    Features whose means differ by less than `_PLAIN` standard errors have no weight. What all
    patches of a sensor share, its converter above all, is drawn once for each: the recorded one may
    differ from those simulated as much as they differ from each other.
    """
    means = np.stack([made[sensors == k].mean(0) for k in np.unique(sensors)])
    error = np.hypot(
        made.std(0) * np.sqrt(1 / len(real) + 1 / len(made)),
        means.std(0, ddof=1) * np.sqrt(1 + 1 / len(means)),
    )
    size = np.abs(real.mean(0) - made.mean(0)) / np.maximum(error, 1e-9)
    kept = (size > _PLAIN) | (size == size.max())
    x = np.concatenate([real, made])[:, kept]
    x = np.concatenate([x, np.ones((len(x), 1))], 1)
    y = np.repeat([1.0, 0.0], [len(real), len(made)])
    each = np.repeat([1.0, len(real) / len(made)], [len(real), len(made)])
    penalty = np.append(np.full(x.shape[1] - 1, _RIDGE), 1e-6)
    weights = np.zeros(x.shape[1])
    for _ in range(_STEPS):
        p = expit(x @ weights)
        slope = x.T @ (each * (y - p)) - penalty * weights
        curve = (x * (each * p * (1 - p))[:, np.newaxis]).T @ x + np.diag(penalty)
        weights = weights + np.linalg.solve(curve, slope)
    whole = np.zeros(kept.size)
    whole[kept] = weights[:-1]
    return whole


def _area(real: Array, made: Array) -> float:
    ranks = rankdata(np.concatenate([real, made]))[: real.size]
    return float((ranks.sum() - real.size * (real.size + 1) / 2) / (real.size * made.size))


def _interval(area: float, real: int, made: int) -> Interval:
    """Return the interval of Hanley & McNeil for independent samples."""
    one, two = area / (2 - area), 2 * area**2 / (1 + area)
    variance = area * (1 - area) + (real - 1) * (one - area**2) + (made - 1) * (two - area**2)
    half = 1.96 * float(np.sqrt(max(variance, 0.0) / (real * made)))
    return max(area - half, 0.0), min(area + half, 1.0)
