"""Log-likelihood of locked frames under a camera model: of their codes, in nats per frame.

log p = sum over pixels of ln P(code) about the frame's own level
      + what the frame before tells (normal scores, first-order)
      + Whittle's likelihood of the scores' spectrum
      + the law of the frame's level (`levels`).

P(code) is the mass of the code's cell, clipped ends included. Scores are drawn within the cell, the
same for every model, so that those of a right model are exactly normal. A pixel far outside of
every law costs ln of `_GROSS` shared by all codes and no more: no single pixel decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import log, pi
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.prove.cells import Cells
from analysis.mismatch.prove.held import Codes, Held, HeldExposure
from analysis.mismatch.prove.law import (
    Array,
    Law,
    Sensed,
    below,
    innovations,
    memory_of,
    pixel_variance,
    sense,
)
from analysis.mismatch.prove.learning import Bases, law_of
from analysis.mismatch.prove.levels import frame_means, level_loglik
from analysis.mismatch.prove.scores import normal_scores
from analysis.mismatch.prove.shape import Shape
from analysis.mismatch.prove.sites import means_of_most, site_places, spread_over
from analysis.mismatch.prove.virtual import Signals
from analysis.mismatch.prove.whittle import bin_counts, whittle_gain
from dsis.camera import Camera

_GROSS = 1e-9  # chance of a gross error: any code alike
_BLOCK = 256  # knots at a time: of a bright scene there are 1e5, among as many codes


@dataclass(frozen=True)
class LikelihoodModel:
    """A camera model that predicts the locked frames of a recording.

    Attributes
    ----------
    law
        Its predictive law.
    held
        Training and locked frames.
    seed
        Of the scores drawn within cells.
    """

    law: Law
    held: Held
    seed: int

    @cached_property
    def sensed(self) -> Sensed:
        """What the training frames tell about the sensor."""
        exposures = self.held.exposures
        return sense(
            self.law,
            self.held,
            {e.name: e.mean_dn - self.law.cells.black_dn for e in exposures},
            {e.name: e.variance_dn2 for e in exposures},
        )


def likelihood_model(
    camera: Camera, held: Held, signals: Signals, seed: int, bases: Bases | None = None
) -> LikelihoodModel:
    """Return the model of a camera; see `law_of`."""
    return LikelihoodModel(law_of(camera, held, signals, seed, bases), held, seed)


@dataclass(frozen=True)
class Loglik:
    """Log-likelihood of locked frames under a model, nats.

    Attributes
    ----------
    frames
        Of each locked frame about its exposure's level: by exposure, (frame,).
    levels
        Of each exposure's level, from the other exposures.
    filled
        Exposures of which too many samples reach the model's full well.
    """

    frames: Mapping[str, Array]
    levels: Mapping[str, float]
    filled: frozenset[str] = frozenset()

    @property
    def per_frame(self) -> dict[str, Array]:
        """Log-likelihood of each locked frame, its share of its exposure's level included."""
        return {n: own + self.levels[n] / own.size for n, own in self.frames.items()}


def frame_loglik(model: LikelihoodModel) -> Loglik:
    """Return the log-likelihood of every locked frame."""
    frames, levels = level_loglik(model.law, model.held)
    for e in model.held.locked:
        own = [_pixels(model, e, k) for k in range(len(e.numbers))]
        frames[e.name] = frames[e.name] + np.array(own)
    return Loglik(frames, levels)


def _pixels(model: LikelihoodModel, exposure: HeldExposure, k: int) -> float:
    """Return the log-likelihood of a locked frame's pixels about its own level."""
    law, held, groups = model.law, model.held, model.sensed.groups
    number = exposure.numbers[k]
    logs, score = _scored(model, exposure, exposure.codes[k], number)
    total = float(logs.sum()) + len(site_places(held.cfa)) * 0.5 * log(2 * pi)
    before, earlier = exposure.before[k], None
    if before is not None and memory_of(law, exposure.name, groups).any():
        earlier = _scored(model, exposure, before, number - 1)[1]
    score, gain = innovations(law, exposure.name, score, earlier, groups)
    spectrum = law.exposures[exposure.name].spectrum
    if spectrum is not None:
        gain += float(whittle_gain(score, spectrum, bin_counts(held.shape, held.cfa)))
    return total + gain


def _scored(
    model: LikelihoodModel, exposure: HeldExposure, codes: Codes, number: int
) -> tuple[Array, Array]:
    """Return ln P(code) and the normal score of each pixel."""
    law, held, sensed = model.law, model.held, model.sensed
    cells, pattern = law.cells, sensed.patterns[exposure.name]
    means = means_of_most((codes - pattern)[np.newaxis], held.cfa, cells.step_dn)
    level = frame_means(law, held, exposure, means)[0]
    centre = spread_over(level, held.shape, held.cfa) + pattern
    variance = pixel_variance(law, exposure.name, pattern, sensed.groups, held)
    sd = np.sqrt(variance)
    low = below(law, exposure.name, (cells.lower_dn[codes] - centre) / sd, sensed.groups, held)
    high = below(law, exposure.name, (cells.upper_dn[codes] - centre) / sd, sensed.groups, held)
    chance = high - low
    if not cells.plain:
        chance = chance * cells.weight[codes] / _norm(law, exposure.name, centre, sd, held)
    logs = np.log((1 - _GROSS) * chance + _GROSS / cells.lower_dn.size)
    key = [model.seed, crc32(exposure.name.encode()), number]
    place = np.random.default_rng(key).random(codes.shape)
    p = low + place * (high - low)
    return logs, normal_scores(p)


def _norm(law: Law, name: str, centre: Array, sd: Array, held: Held) -> Array:
    """Return the sum over codes of P(code) times its learned width, at each pixel."""
    made = np.empty(centre.shape)
    for site, place in enumerate(site_places(held.cfa)):
        shape, own = law.exposures[name].shapes[site], float(np.median(sd[place]))
        low, high = float(centre[place].min()), float(centre[place].max())
        knots = np.linspace(low, high, max(int((high - low) * 4 / min(own, 1.0)), 1) + 1)
        parts = np.array_split(knots, -(-knots.size // _BLOCK))
        sums = [_sums(law.cells, shape, some, own) for some in parts]
        made[place] = np.interp(centre[place], knots, np.concatenate(sums))
    return made


def _sums(cells: Cells, shape: Shape, knots: Array, sd: float) -> Array:
    """Return the same at means `knots`, in order: codes farther off than 8 sd have no chance."""
    edges = cells.upper_dn
    first, last = np.searchsorted(edges, [knots[0] - 8 * sd, knots[-1] + 8 * sd])
    near = slice(first, last + 1)
    chance = shape.below((edges[near] - knots[:, np.newaxis]) / sd)
    mass = np.diff(chance, prepend=0.0)
    return np.asarray(mass @ cells.weight[near] + 1 - chance[:, -1])


def total_pixels(held: Held) -> int:
    """Return the pixels of a frame that are looked at."""
    return held.shape[0] * held.shape[1]


def mean_per_pixel(loglik: Loglik, held: Held) -> float:
    """Return the mean log-likelihood per pixel and frame, nats."""
    frames: NDArray[np.float64] = np.concatenate(list(loglik.per_frame.values()))
    return float(frames.mean()) / total_pixels(held)
