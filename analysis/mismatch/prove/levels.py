"""The law of frame means: levels predicted from the other exposures, wandering from frame to frame.

Level = black level + light x (DN per light, by colour) + what the camera model adds. Black levels
and DN per light are fitted to the training frames; each exposure is then predicted without its own,
by Student's t law, whose scale is what the fit leaves. Locked frames wander about their exposure's
training level. Where the other exposures do not tell a level (unknown light, scenes, whose greens
see other parts of the picture), the level tells nothing.
"""

from dataclasses import dataclass

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from analysis.mismatch.prove.held import Held, HeldExposure
from analysis.mismatch.prove.law import Law
from analysis.mismatch.prove.sites import site_colours, site_means

Array = NDArray[np.float64]
RELATIVE_LIGHT = 2e-4  # light is stated, and a lamp is stable, no better than this


@dataclass(frozen=True)
class _Level:
    """The training level of one site in one exposure, less what the camera adds.

    Attributes
    ----------
    exposure, site
        Which.
    row
        Of the design matrix.
    value_dn, white_dn2, light_dn2
        Level, its variance from frames, its variance from light.
    """

    exposure: str
    site: int
    row: Array
    value_dn: float
    white_dn2: float
    light_dn2: float


@dataclass(frozen=True)
class _Prediction:
    """Student's t law of a level: place and scale without the locked frames' own noise."""

    value_dn: float
    variance_dn2: float
    dof: float


def level_loglik(law: Law, held: Held) -> tuple[dict[str, Array], dict[str, float]]:
    """Return the log-likelihood of frame means, in units of their white noise.

    First of the locked frames about the exposure's level, by exposure: (frame,). Then of the level
    itself, from the other exposures; 0 where they do not tell it.
    """
    levels = _training_levels(law, held)
    frames, exposures = {}, {}
    for e in held.locked:
        frames[e.name], exposures[e.name] = _of_exposure(law, held, e, levels)
    return frames, exposures


def frame_means(law: Law, held: Held, exposure: HeldExposure, codes: Array) -> Array:
    """Return the level of each site from mean codes (frame, site), DN above black."""
    variance = site_means(law.exposures[exposure.name].variance_dn2, held.cfa)
    sd = np.sqrt(variance * law.exposures[exposure.name].factor)
    less_black = codes - law.cells.black_dn
    return np.array(
        [
            [law.cells.centre(float(m), float(s)) for m, s in zip(means, sd, strict=True)]
            for means in less_black
        ]
    ).reshape(codes.shape)


def white_dn2(law: Law, held: Held, name: str) -> Array:
    """Return the variance of a frame mean from white noise, by site."""
    own = law.exposures[name]
    variance = site_means(own.variance_dn2, held.cfa) * own.factor
    return np.asarray(variance * variance.size / (held.shape[0] * held.shape[1]), np.float64)


def _of_exposure(
    law: Law, held: Held, exposure: HeldExposure, levels: list[_Level]
) -> tuple[Array, float]:
    """Return the log-likelihood of an exposure's locked frame means, and of its level.

    The chain rule: the level of the training frames from the other exposures, the locked frames
    from it. Where there are no training frames the mean of the locked ones stands for them.
    """
    own, white = law.exposures[exposure.name], white_dn2(law, held, exposure.name)
    codes = site_means(exposure.codes, held.cfa)
    y = frame_means(law, held, exposure, codes) - own.offset_dn
    frames, sites = y.shape
    mine = [v for v in levels if v.exposure == exposure.name]
    trained = exposure.trained
    start = np.array([v.value_dn for v in mine]) if trained else y.mean(0)
    away = (y - start) / np.sqrt(white)
    # The start's own error is common to the frames: covariance I + 1 / trained, less their mean.
    common = 1 / (trained + frames) if trained else 0.0
    left = away - common * away.sum(0)
    quadratic = np.einsum("ts,su,tu->t", away, np.linalg.inv(own.wander), left)
    free = frames if trained else frames - 1
    norm = sites * np.log(2 * np.pi) + np.linalg.slogdet(own.wander)[1]
    if trained:
        norm += sites * np.log1p(frames / trained) / frames
    loglik: Array = -0.5 * (quadratic + norm * free / frames)
    count = trained or frames
    level = 0.0
    for site, place in enumerate(mine):
        known = _predicted(place, levels)
        if known is not None:
            scale = np.sqrt(known.variance_dn2 + white[site] * own.wander[site, site] / count)
            value = scipy.stats.t.logpdf(start[site], known.dof, known.value_dn, scale)
            level += float(value) + 0.5 * float(np.log(white[site] / count))
    return loglik, level


def _training_levels(law: Law, held: Held) -> list[_Level]:
    """Return the training levels with their places in a common linear model."""
    colours = site_colours(held.cfa)
    sites, lit = len(colours), [e for e in held.exposures if e.kind == "flat" and e.light]
    # Of a flat of unknown light one level a colour; sites of a scene see other parts of it.
    places = {"scene": tuple(range(sites)), "flat": colours}
    unknown = [e for e in held.exposures if e.kind == "scene" or (e.kind == "flat" and not e.light)]
    own_levels = [(e.name, place) for e in unknown for place in sorted(set(places[e.kind]))]
    free = {level: i for i, level in enumerate(own_levels)}
    width = sites + max(colours) + 1 + len(free)
    unit = float(np.mean([e.light for e in lit if e.light])) if lit else 1.0
    found = []
    for e in held.exposures:
        own, white = law.exposures[e.name], white_dn2(law, held, e.name)
        means = (
            frame_means(law, held, e, e.training_means_dn).mean(0) - own.offset_dn
            if e.trained
            else np.full(sites, np.nan)
        )
        black = {d.name: 0.0 for d in held.exposures if d.kind == "dark"}
        for site, colour in enumerate(colours):
            row = np.zeros(width)
            row[site] = 1.0
            level = (e.name, places.get(e.kind, colours)[site])
            if level in free:
                row[sites + max(colours) + 1 + free[level]] = 1.0
            elif e.name not in black:
                row[sites + colour] = (e.light or 0.0) / unit
            light = (RELATIVE_LIGHT * max(float(means[site]) - _dark(held, law), 0.0)) ** 2
            known = e.name not in black and level not in free
            found.append(
                _Level(
                    e.name,
                    site,
                    row,
                    float(means[site]),
                    float(white[site] * own.wander[site, site]) / max(e.trained, 1),
                    light if known and np.isfinite(light) else 0.0,
                )
            )
    return found


def _dark(held: Held, law: Law) -> float:
    """Return the lowest training level, DN above the model's black."""
    means = [e.training_means_dn.mean() for e in held.exposures if e.trained]
    return float(min(means) - law.cells.black_dn) if means else 0.0


def _predicted(mine: _Level, levels: list[_Level]) -> _Prediction | None:
    """Return the law of a level from other exposures, or at least from other sites; or None."""
    trained = [v for v in levels if np.isfinite(v.value_dn)]
    for others in (
        [v for v in trained if v.exposure != mine.exposure],
        [v for v in trained if (v.exposure, v.site) != (mine.exposure, mine.site)],
    ):
        found = _solved(mine, others)
        if found is not None:
            return found
    return None


def _solved(mine: _Level, others: list[_Level]) -> _Prediction | None:
    """Return a level by least squares of others; None where they do not tell it, or barely."""
    if not others:
        return None
    sd = np.sqrt([v.white_dn2 + v.light_dn2 for v in others])
    design = np.array([v.row for v in others]) / sd[:, np.newaxis]
    value = np.array([v.value_dn for v in others]) / sd
    inverse = np.linalg.pinv(design)
    if np.abs(mine.row @ inverse @ design - mine.row).max() > 1e-6:
        return None
    dof = len(others) - int(np.linalg.matrix_rank(design))
    if dof < 2:
        return None
    solution = inverse @ value
    scatter = max(float(((value - design @ solution) ** 2).sum()) / dof, 1.0)
    leverage = float(((mine.row @ inverse) ** 2).sum())
    variance = scatter * (leverage + mine.light_dn2)
    return _Prediction(float(mine.row @ solution), variance, float(dof))
