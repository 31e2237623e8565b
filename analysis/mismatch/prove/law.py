"""The predictive law of a recording's frames under a camera model.

Normal noise of known variance around a uniform level is the base model's law. Physics beyond it
adds a fixed pattern and noisy pixels, which training frames tell, another shape, memory of the
frame before, and a spectrum; `learning` finds them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.prove.cells import Cells
from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.patterns import Pattern
from analysis.mismatch.prove.populations import CONSPICUOUS, GROUPS, OUTLIER, Groups, groups_of
from analysis.mismatch.prove.shape import NORMAL, Shape
from analysis.mismatch.prove.sites import site_means, site_places, spread_over
from dsis.camera import Camera

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExposureLaw:
    """The law of one exposure's frames around their own mean.

    Attributes
    ----------
    variance_dn2
        Of the base model, by pixel: (row, column).
    factor
        Predictive variance in its units, by site.
    growth_dn
        Change of the variance with the fixed pattern, DN^2 / DN, by site.
    shapes
        Law of the standardised residual, by site.
    memory
        Correlation of normal scores with the frame before.
    spectrum
        Of the normal scores; None: white.
    offset_dn
        What the camera adds to the level, by site.
    wander
        Covariance of the sites' frame means, in units of white noise: (site, site).
    """

    variance_dn2: Array
    factor: Array
    growth_dn: Array
    shapes: tuple[Shape, ...]
    memory: float
    spectrum: Array | None
    offset_dn: Array
    wander: Array


@dataclass(frozen=True)
class Conspicuous:
    """What is common to all exposures: groups of pixels, the noisy ones above all.

    Attributes
    ----------
    excess
        Relative excess of a group's variance where the base noise is least: (group,).
    outlier_factor
        Of outliers of mean maps, by exposure.
    shape
        Law of the noisy groups.
    memory
        Their correlation with the frame before: (group,).
    """

    excess: Array = field(default_factory=lambda: np.zeros(GROUPS))
    outlier_factor: Mapping[str, float] = field(default_factory=dict)
    shape: Shape = NORMAL
    memory: Array = field(default_factory=lambda: np.zeros(GROUPS))


@dataclass(frozen=True)
class Law:
    """The predictive law of a camera model.

    Attributes
    ----------
    camera
        The model.
    cells
        Of its converter.
    exposures
        By name.
    patterns
        By site; empty: the model has no fixed pattern.
    pixels
        Groups of pixels.
    """

    camera: Camera
    cells: Cells
    exposures: Mapping[str, ExposureLaw]
    patterns: tuple[Pattern, ...]
    pixels: Conspicuous

    @cached_property
    def least_dn2(self) -> float:
        """The least variance of the base model in any pixel of any exposure."""
        return min(float(e.variance_dn2.min()) for e in self.exposures.values())


@dataclass(frozen=True)
class Sensed:
    """What training frames tell about a sensor, recorded or virtual.

    Attributes
    ----------
    patterns
        Fixed pattern of each exposure, mean of each site taken off: (row, column).
    groups
        Group of each pixel.
    """

    patterns: Mapping[str, Array]
    groups: Groups


def sense(
    law: Law, held: Held, maps: Mapping[str, Array], variances: Mapping[str, Array]
) -> Sensed:
    """Return what training frames tell under a law.

    Parameters
    ----------
    law
        The law, of which patterns and variances are used.
    held
        The recording's layout.
    maps
        Mean training frames by exposure, DN.
    variances
        Temporal variance maps by exposure, DN^2.
    """
    centred = {
        e.name: maps[e.name] - spread_over(site_means(maps[e.name], held.cfa), held.shape, held.cfa)
        for e in held.exposures
    }
    found = {
        e.name: centred[e.name] if e.kind == "scene" and e.trained else np.zeros(held.shape)
        for e in held.exposures
    }
    uniform = [e.name for e in held.exposures if e.kind != "scene"]
    dof = [max(e.trained - 1, 0) for e in held.exposures]
    expected = np.array(
        [site_means(law.exposures[e.name].variance_dn2, held.cfa) for e in held.exposures]
    )
    groups = groups_of([variances[e.name] for e in held.exposures], dof, expected, held.cfa)
    if law.patterns and uniform:
        for pattern, place in zip(law.patterns, site_places(held.cfa), strict=True):
            made, far = pattern.estimate(np.stack([centred[name][place] for name in uniform]))
            for name, image in zip(uniform, made, strict=True):
                found[name][place] = image
            if pattern.outliers is not None:
                groups[place] = np.where(far, OUTLIER, groups[place])
    return Sensed(found, groups)


def pixel_variance(law: Law, exposure: str, pattern: Array, groups: Groups, held: Held) -> Array:
    """Return the predictive variance of each pixel, DN^2."""
    own = law.exposures[exposure]
    factor = spread_over(own.factor, held.shape, held.cfa)
    variance = own.variance_dn2 * factor
    if own.growth_dn.any():
        grown = variance + spread_over(own.growth_dn, held.shape, held.cfa) * pattern
        variance = np.maximum(grown, 0.1 * variance)
    if law.pixels.excess.any():
        share = law.least_dn2 / own.variance_dn2
        variance = variance * np.maximum(1 + law.pixels.excess[groups] * share, 0.05)
    odd = law.pixels.outlier_factor.get(exposure, 1.0)
    return np.where(groups == OUTLIER, variance * odd, variance)


def below(law: Law, exposure: str, u: NDArray[np.floating], groups: Groups, held: Held) -> Array:
    """Return the probability of lying below standardised residuals u (row, column)."""
    own = law.exposures[exposure]
    made = np.empty(u.shape)
    for shape, place in zip(own.shapes, site_places(held.cfa), strict=True):
        made[place] = shape.below(u[place])
    if not law.pixels.shape.normal:
        odd = groups >= CONSPICUOUS
        made[odd] = law.pixels.shape.below(u[odd])
    return made


def innovations(
    law: Law, exposure: str, score: Array, earlier: Array | None, groups: Groups
) -> tuple[Array, float]:
    """Return normal scores less what the frame before tells, and the log-likelihood gained."""
    rho = memory_of(law, exposure, groups)
    if earlier is None or not rho.any():
        return score, 0.0
    left = (score - rho * earlier) / np.sqrt(1 - rho**2)
    gain = 0.5 * (score**2 - left**2 - np.log(1 - rho**2)).sum()
    return left, float(gain)


def memory_of(law: Law, exposure: str, groups: Groups) -> Array:
    """Return the correlation of each pixel's score with the frame before."""
    rho = np.full(groups.shape, law.exposures[exposure].memory)
    odd = groups >= CONSPICUOUS
    rho[odd] = law.pixels.memory[groups[odd]]
    return rho
