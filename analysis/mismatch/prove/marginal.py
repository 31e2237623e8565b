"""Learning the law of single pixels: variances, noisy groups, shapes."""

from dataclasses import replace

import numpy as np

from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.law import Array, Law
from analysis.mismatch.prove.populations import CONSPICUOUS, GROUPS, OUTLIER
from analysis.mismatch.prove.residuals import Residuals
from analysis.mismatch.prove.shape import (
    EDGES,
    NORMAL,
    Shape,
    Tally,
    shape_of,
)
from analysis.mismatch.prove.sites import site_places
from analysis.mismatch.prove.sure import sure
from dsis.effects import Image

_LEAST_FACTOR = 1e-3
_CUT = 9.0  # squared residual from which a pixel counts no more
_ROUNDS = 20
_SURE = 2.5  # standard errors below which a slope counts as none
_LEAST_SCORES = 200  # residuals of noisy pixels: fewer tell no law of their own


def with_variances(own: Residuals, base: Residuals, held: Held) -> Law:
    """Return the law with predictive variances, and how they grow with the pattern."""
    ordinary = own.sensed.groups < CONSPICUOUS
    laws = dict(own.law.exposures)
    for e in held.exposures:
        law = laws[e.name]
        plain = law.variance_dn2.astype(np.float32)
        square, other = (v.residuals[e.name] ** 2 / plain for v in (own, base))
        factor, growth = law.factor.copy(), law.growth_dn.copy()
        for site, place in enumerate(site_places(held.cfa)):
            many = ordinary[place]
            factor[site] *= _scale(square[:, *place][:, many], other[:, *place])
            pattern = own.sensed.patterns[e.name][place]
            if e.kind == "scene":  # its base variance follows the scene
                continue
            growth[site] = _growth(
                square[:, *place][:, many] * plain[place][many],
                pattern[many],
                factor[site] * float(law.variance_dn2[place].mean()),
            )
        laws[e.name] = replace(law, factor=factor, growth_dn=growth)
    return replace(own.law, exposures=laws)


def _scale(squares: Image, other: Image) -> float:
    """Return the variance of squared residuals relative to that of others, far ones cut.

    Huber's second proposal: the cut squares of both, each in its own scale, have equal means.
    """
    size = float(other.mean())
    if not size > 0:
        return 1.0  # codes that never move: no scale to compare with
    wanted = float(np.minimum(other, _CUT * size).mean()) / size
    scale = float(squares.mean())
    for _ in range(_ROUNDS):
        found = float(np.minimum(squares, _CUT * scale).mean()) / wanted
        if abs(found - scale) < 1e-6 * scale:
            break
        scale = max(found, _LEAST_FACTOR)
    return scale / size


def _growth(squares: Image, pattern: Array, variance: float) -> float:
    """Return the slope of squared residuals (frame, pixel) over the pattern.

    Of few pixels far out the pattern is large, and squares are cut: those say nothing.
    """
    size = float((pattern**2).sum())
    if not size:
        return 0.0
    squares = np.minimum(squares, _CUT * variance)
    slope = float(((squares.mean(0) - squares.mean()) * pattern).sum()) / size
    error = np.sqrt(2 * variance**2 / (size * len(squares)))
    return slope * max(1 - (_SURE * error / slope) ** 2, 0.0) if slope else 0.0


def with_groups(own: Residuals, base: Residuals, held: Held) -> Law:
    """Return the law with the variances of groups of pixels.

    That of conspicuous ones is the scale of the many among their residuals: a pixel that was hit
    once is no noisy pixel.
    """
    excess, odd = np.zeros(GROUPS), {}
    sums = np.zeros((2, 2, GROUPS))  # of both sensors: excess, its weight
    for e in held.exposures:
        share = own.law.least_dn2 / own.law.exposures[e.name].variance_dn2
        for k, virtual in enumerate((own, base)):
            groups = virtual.sensed.groups.reshape(-1)
            squares = virtual.standardised(e.name, held) ** 2
            square = np.minimum(squares, _CUT).mean(0).reshape(-1)
            others = base.standardised(e.name, held) ** 2
            for group in np.unique(groups[groups >= CONSPICUOUS]):
                which = groups == group
                of_group = squares.reshape(len(squares), -1)[:, which]
                square[which] = _scale(of_group, others)
            above = (square - 1) * share.reshape(-1)
            frames = len(virtual.residuals[e.name])
            sums[k, 0] += frames * np.bincount(groups, above, GROUPS)
            sums[k, 1] += frames * np.bincount(groups, (share**2).reshape(-1), GROUPS)
            if k == 0 and (groups == OUTLIER).any():
                odd[e.name] = max(float(square[groups == OUTLIER].mean()), 0.1)
    there = sums[0, 1] > 0
    size = np.where(there, sums[0, 1], 1.0)
    # Chance excesses of the base model's pixels, mostly the same ones, are taken off.
    mean = np.where(there, sums[0, 0] / size - sums[1, 0] / np.maximum(size, sums[1, 1]), 0.0)
    error = np.sqrt(2 / size)
    for group in range(OUTLIER):
        excess[group] = sure(float(mean[group]), float(error[group]))
    return replace(own.law, pixels=replace(own.law.pixels, excess=excess, outlier_factor=odd))


def with_shapes(own: Residuals, base: Residuals, held: Held) -> Law:
    """Return the law with the shapes of standardised residuals."""
    many, many_base = (virtual.sensed.groups < CONSPICUOUS for virtual in (own, base))
    odd, odd_base = np.zeros(EDGES.size - 1), np.zeros(EDGES.size - 1)
    laws = dict(own.law.exposures)
    for e in held.exposures:
        u, v = (virtual.standardised(e.name, held) for virtual in (own, base))
        shapes = []
        for place in site_places(held.cfa):
            tally = Tally.of(u[:, *place], v[:, *place], many[place], many_base[place])
            shapes.append(shape_of(tally.ordinary, tally.base_ordinary, tally.exchanged))
            if not many.all():
                odd += tally.odd
                odd_base += tally.base_odd
        laws[e.name] = replace(laws[e.name], shapes=tuple(shapes))
    few = odd.sum() < _LEAST_SCORES
    shape: Shape = NORMAL if few else shape_of(odd, odd_base, odd + odd_base)
    return replace(own.law, exposures=laws, pixels=replace(own.law.pixels, shape=shape))
