"""Learning what ties pixels together: memory, spectra, levels that wander."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.law import Law, below, innovations
from analysis.mismatch.prove.populations import CONSPICUOUS, GROUPS
from analysis.mismatch.prove.residuals import Residuals
from analysis.mismatch.prove.scores import normal_scores
from analysis.mismatch.prove.sites import site_means
from analysis.mismatch.prove.spectrum import spectrum_of
from analysis.mismatch.prove.sure import sure
from analysis.mismatch.prove.virtual import Stack
from analysis.mismatch.prove.whittle import periodogram
from dsis.effects import Image

_MOST = 0.9  # correlation with the frame before


def with_dependence(own: Residuals, base: Residuals, held: Held) -> Law:
    """Return the law with memory of the frame before, and spectra of what is new."""
    groups = own.sensed.groups
    many = groups < CONSPICUOUS
    laws = dict(own.law.exposures)
    sums, sizes = np.zeros(GROUPS), np.zeros(GROUPS)
    scores = {e.name: _scores(own, e.name, held) for e in held.exposures}
    for name, q in scores.items():
        w = base.standardised(name, held)
        product = (q[1:] * q[:-1]).mean(0)
        # About the frames' mean: an error of the pattern is no memory of one frame.
        seen, other = ((a[1:] * a[:-1]).mean(0) for a in (q - q.mean(0), w - w.mean(0)))
        frames = len(q) - 1
        sums += frames * np.bincount(groups.reshape(-1), product.reshape(-1), GROUPS)
        sizes += frames * np.bincount(groups.reshape(-1), minlength=GROUPS)
        rho = float(seen[many].mean()) - float(other.mean())
        rho = sure(rho, 1 / np.sqrt(frames * many.sum()))
        laws[name] = replace(laws[name], memory=float(np.clip(rho, -_MOST, _MOST)))
    memory = np.zeros(GROUPS)
    for group in range(CONSPICUOUS, GROUPS):
        if sizes[group]:
            rho = sure(sums[group] / sizes[group], 1 / np.sqrt(sizes[group]))
            memory[group] = np.clip(rho, -_MOST, _MOST)
    pixels = replace(own.law.pixels, memory=memory)
    law = replace(own.law, exposures=laws, pixels=pixels)
    for e in held.locked:
        q, w = scores[e.name], base.standardised(e.name, held)[1:]
        new = np.stack([innovations(law, e.name, b, a, groups)[0] for a, b in pairwise(q)])
        excess = periodogram(new).mean(0) - periodogram(w).mean(0)
        spectrum = spectrum_of(excess, len(new), held.shape, held.cfa)
        laws[e.name] = replace(laws[e.name], spectrum=spectrum)
    return replace(law, exposures=laws)


def _scores(virtual: Residuals, name: str, held: Held) -> Image:
    """Return normal scores of fresh frames: float32 (frame, row, column)."""
    made = [
        normal_scores(below(virtual.law, name, u, virtual.sensed.groups, held)).astype(np.float32)
        for u in virtual.standardised(name, held)
    ]
    return np.stack(made)


def with_levels(
    law: Law, held: Held, model: Mapping[str, Stack], other: Mapping[str, Stack]
) -> Law:
    """Return the law with what the camera adds to levels, and how frame means wander."""
    laws = dict(law.exposures)
    for e in held.exposures:
        means, base = (
            site_means(np.concatenate([s[e.name].training, s[e.name].fresh]), held.cfa)
            for s in (model, other)
        )
        added = means - base
        error = added.std(0, ddof=1) / np.sqrt(len(added))
        offset = np.array([sure(a, b) for a, b in zip(added.mean(0), error, strict=True)])
        own = laws[e.name]
        plain = site_means(own.variance_dn2, held.cfa)
        pixels = held.shape[0] * held.shape[1] / plain.size
        scaled = means * np.sqrt(pixels / (plain * own.factor))
        white = base * np.sqrt(pixels / plain)
        change = np.atleast_2d(np.cov(scaled.T)) - np.atleast_2d(np.cov(white.T))
        values, vectors = np.linalg.eigh(np.eye(plain.size) + change)
        wander = (vectors * np.maximum(values, 0.5)) @ vectors.T
        laws[e.name] = replace(own, offset_dn=offset, wander=wander)
    return replace(law, exposures=laws)
