"""How the predictive law of a camera model is found.

The base model's law is known in closed form. What physics beyond it changes is learned from a virtual
sensor of the camera beside one of its base model, of the same draws, by the very steps that the
recording goes through: training frames tell the sensor's pattern and its noisy pixels, fresh frames
show what is left then. Noise that both share cancels, so a weak effect changes the law by little.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from analysis.mismatch.prove.cells import cells_of, converted
from analysis.mismatch.prove.held import Held, HeldExposure
from analysis.mismatch.prove.law import (
    Array,
    Conspicuous,
    ExposureLaw,
    Law,
    Sensed,
    below,
    innovations,
    pixel_variance,
    sense,
)
from analysis.mismatch.prove.patterns import Halves, Pattern, pattern_of
from analysis.mismatch.prove.populations import CONSPICUOUS, GROUPS, OUTLIER
from analysis.mismatch.prove.shape import EDGES, NORMAL, Shape, counted, shape_of
from analysis.mismatch.prove.sites import site_means, site_places, spread_over
from analysis.mismatch.prove.spectrum import spectrum_of
from analysis.mismatch.prove.virtual import (
    Signals,
    Stack,
    base_of,
    clean_signal,
    sensor_draw,
    virtual_sensor,
)
from analysis.mismatch.prove.whittle import periodogram
from dsis.camera import Camera

_LEAST_FACTOR = 1e-3
_CUT = 9.0  # squared residual from which a pixel counts no more
_ROUNDS = 20
_SURE = 2.5  # standard errors below which a difference counts as none
_LEAST_SCORES = 200  # residuals of noisy pixels: fewer tell no law of their own
_FARTHEST = 1e-9  # probability: scores end at six standard deviations


def law_of(camera: Camera, held: Held, signals: Signals, seed: int) -> Law:
    """Return the predictive law of a camera model for the exposures held.

    Parameters
    ----------
    camera
        The model.
    held
        Training and locked frames.
    signals
        Clean signal of each flat and dark, DN above black, by rows 0, 1 and columns 0, 1: (2, 2).
    seed
        Of the virtual sensor.
    """
    base = base_of(camera)
    cells = cells_of(camera, seed)
    plain = {e.name: _base_law(base, held, e, signals) for e in held.exposures}
    law = Law(camera, cells, plain, (), Conspicuous())
    if camera.effect or camera.saturation_dn or camera.noise.shot != "gaussian":
        model = virtual_sensor(camera, held, signals, seed)
        other = virtual_sensor(base, held, signals, seed)
        law = _learned(law, Law(base, cells, plain, (), Conspicuous()), held, model, other, seed)
    return law if cells.plain else _with_widths(law, held)


def _base_law(base: Camera, held: Held, exposure: HeldExposure, signals: Signals) -> ExposureLaw:
    clean = clean_signal(held, exposure, signals)
    variance = base.segments.variance_dn2(clean).astype(np.float64)
    sites = len(site_places(held.cfa))
    scene = exposure.kind == "scene"  # the pattern that is used is a mean with an error
    return ExposureLaw(
        np.maximum(variance, 1e-6),
        np.full(sites, 1 + 1 / max(exposure.trained, 1) if scene else 1.0),
        np.zeros(sites),
        (NORMAL,) * sites,
        0.0,
        None,
        np.zeros(sites),
        np.eye(sites),
    )


@dataclass(frozen=True)
class _Virtual:
    """A virtual sensor as its law sees it."""

    law: Law
    stacks: Mapping[str, Stack]
    sensed: Sensed

    def residuals(self, name: str, held: Held) -> Array:
        """Return fresh frames less their own mean and the pattern: (frame, row, column)."""
        fresh = self.stacks[name].fresh.astype(np.float64)
        means = spread_over(site_means(fresh, held.cfa), held.shape, held.cfa)
        rest: Array = fresh - means - self.sensed.patterns[name]
        return rest

    def standardised(self, name: str, held: Held) -> Array:
        """Return residuals in units of their predicted standard deviation."""
        pattern, groups = self.sensed.patterns[name], self.sensed.groups
        variance = pixel_variance(self.law, name, pattern, groups, held)
        made: Array = self.residuals(name, held) / np.sqrt(variance)
        return made


def _learned(
    law: Law,
    base_law: Law,
    held: Held,
    model: Mapping[str, Stack],
    other: Mapping[str, Stack],
    seed: int,
) -> Law:
    """Return the law with all that the virtual sensors show."""
    law = replace(law, patterns=_patterns(law, held, model, other))
    base = _virtual(base_law, held, other, seed)
    own = _virtual(law, held, model, seed)
    own = replace(own, law=_with_variances(own, base, held))
    own = replace(own, law=_with_groups(own, base, held))
    own = replace(own, law=_with_shapes(own, base, held))
    own = replace(own, law=_with_memory(own, base, held))
    return _with_levels(_with_spectra(own, base, held), held, model, other)


def _patterns(
    law: Law, held: Held, model: Mapping[str, Stack], other: Mapping[str, Stack]
) -> tuple[Pattern, ...]:
    uniform = [e for e in held.exposures if e.kind != "scene"]
    if not uniform:
        return ()
    trained = np.array([e.trained for e in uniform], np.float64)
    found = []
    for place in site_places(held.cfa):
        variance = np.array([law.exposures[e.name].variance_dn2[place].mean() for e in uniform])
        own, base = (
            _halves([stacks[e.name] for e in uniform], place) for stacks in (model, other)
        )
        found.append(pattern_of(own, base, variance, trained))
    return tuple(found)


def _halves(stacks: list[Stack], place: tuple[slice, slice]) -> Halves:
    early, late, frames = [], [], []
    for stack in stacks:
        whole = np.concatenate([stack.training[:, *place], stack.fresh[:, *place]])
        n = len(whole) // 2
        for half, mean in ((early, whole[:n].mean(0)), (late, whole[-n:].mean(0))):
            half.append(mean - mean.mean())
        frames.append(n)
    return Halves(
        np.stack(early).astype(np.float64), np.stack(late).astype(np.float64), np.array(frames)
    )


def _virtual(law: Law, held: Held, stacks: Mapping[str, Stack], seed: int) -> _Virtual:
    """Return a virtual sensor with what its training frames tell under a law."""
    maps, variances = {}, {}
    for e in held.exposures:
        training = stacks[e.name].training
        zeros = np.zeros(held.shape)
        maps[e.name] = training.mean(0, dtype=np.float64) if e.trained else zeros
        variances[e.name] = zeros
        if e.trained > 1:
            sensor = sensor_draw(seed)
            codes = [converted(law.camera, frame, held.grid, sensor) for frame in training]
            variances[e.name] = np.var(np.stack(codes), axis=0, ddof=1, dtype=np.float64)
    return _Virtual(law, stacks, sense(law, held, maps, variances))


def _with_variances(own: _Virtual, base: _Virtual, held: Held) -> Law:
    """Return the law with predictive variances, and how they grow with the pattern."""
    ordinary = own.sensed.groups < CONSPICUOUS
    laws = dict(own.law.exposures)
    for e in held.exposures:
        law = laws[e.name]
        square = own.residuals(e.name, held) ** 2 / law.variance_dn2
        other = base.residuals(e.name, held) ** 2 / law.variance_dn2
        factor, growth = law.factor.copy(), law.growth_dn.copy()
        for site, place in enumerate(site_places(held.cfa)):
            many = ordinary[place]
            factor[site] *= _scale(square[:, *place][:, many], other[:, *place])
            pattern = own.sensed.patterns[e.name][place]
            growth[site] = _growth(
                square[:, *place] * law.variance_dn2[place],
                pattern,
                factor[site] * float(law.variance_dn2[place].mean()),
            )
        laws[e.name] = replace(law, factor=factor, growth_dn=growth)
    return replace(own.law, exposures=laws)


def _scale(squares: Array, other: Array) -> float:
    """Return the variance of squared residuals relative to that of others, far ones cut.

    Huber's second proposal: the cut squares of both, each in its own scale, have equal means.
    """
    size = float(other.mean())
    wanted = float(np.minimum(other / size, _CUT).mean())
    scale = float(squares.mean())
    for _ in range(_ROUNDS):
        scale *= float(np.minimum(squares / scale, _CUT).mean()) / wanted
        scale = max(scale, _LEAST_FACTOR)
    return scale / size


def _growth(squares: Array, pattern: Array, variance: float) -> float:
    """Return the slope of squared residuals (frame, row, column) over the pattern."""
    size = float((pattern**2).sum())
    if not size:
        return 0.0
    squares = np.minimum(squares, _CUT * variance)
    slope = float(((squares.mean(0) - squares.mean()) * pattern).sum()) / size
    error = np.sqrt(2 * variance**2 / (size * len(squares)))
    return slope * max(1 - (_SURE * error / slope) ** 2, 0.0) if slope else 0.0


def _with_groups(own: _Virtual, base: _Virtual, held: Held) -> Law:
    """Return the law with the variances of groups of pixels."""
    least = min(float(e.variance_dn2.min()) for e in own.law.exposures.values())
    excess, odd = np.zeros(GROUPS), {}
    sums = np.zeros((2, 2, GROUPS))
    for e in held.exposures:
        share = least / own.law.exposures[e.name].variance_dn2
        for k, virtual in enumerate((own, base)):
            groups = virtual.sensed.groups.reshape(-1)
            square = virtual.standardised(e.name, held) ** 2
            square = np.where(virtual.sensed.groups < CONSPICUOUS, np.minimum(square, _CUT), square)
            square = square.mean(0)
            above = ((square - 1) * share).reshape(-1)
            frames = len(virtual.stacks[e.name].fresh)
            sums[k, 0] += frames * np.bincount(groups, above, GROUPS)
            sums[k, 1] += frames * np.bincount(groups, (share**2).reshape(-1), GROUPS)
            if k == 0 and (groups == OUTLIER).any():
                odd[e.name] = max(float(square.reshape(-1)[groups == OUTLIER].mean()), 0.1)
    mean = np.divide(sums[:, 0], sums[:, 1], out=np.zeros((2, GROUPS)), where=sums[:, 1] > 0)
    error = np.sqrt(np.divide(2, sums[0, 1], out=np.ones(GROUPS), where=sums[0, 1] > 0))
    for group in range(OUTLIER):
        excess[group] = _sure(mean[0, group] - mean[1, group], float(error[group]))
    return replace(own.law, pixels=replace(own.law.pixels, excess=excess, outlier_factor=odd))


def _sure(value: float, error: float) -> float:
    """Return a value shrunk by how sure it is; nothing below `_SURE` standard errors."""
    return value * max(1 - (_SURE * error / value) ** 2, 0.0) if value else 0.0


def _with_shapes(own: _Virtual, base: _Virtual, held: Held) -> Law:
    """Return the law with the shapes of standardised residuals."""
    many, odd = own.sensed.groups < CONSPICUOUS, np.zeros(EDGES.size - 1)
    odd_base = np.zeros(EDGES.size - 1)
    laws = dict(own.law.exposures)
    for e in held.exposures:
        u, v = own.standardised(e.name, held), base.standardised(e.name, held)
        shapes = []
        for place in site_places(held.cfa):
            counts = counted(u[:, *place][:, many[place]])
            shapes.append(shape_of(counts, counted(v[:, *place])))
        laws[e.name] = replace(laws[e.name], shapes=tuple(shapes))
        if not many.all():
            odd += counted(u[:, ~many])
            odd_base += counted(v[:, many])
    shape: Shape = shape_of(odd, odd_base) if odd.sum() >= _LEAST_SCORES else NORMAL
    return replace(own.law, exposures=laws, pixels=replace(own.law.pixels, shape=shape))


def _scores(virtual: _Virtual, name: str, held: Held) -> Array:
    """Return normal scores of fresh frames: (frame, row, column)."""
    made = []
    for u in virtual.standardised(name, held):
        p = below(virtual.law, name, u, virtual.sensed.groups, held)
        made.append(ndtri(np.clip(p, _FARTHEST, 1 - _FARTHEST)))
    return np.stack(made)


def _with_memory(own: _Virtual, base: _Virtual, held: Held) -> Law:
    """Return the law with the correlation with the frame before."""
    groups = own.sensed.groups
    many = groups < CONSPICUOUS
    laws = dict(own.law.exposures)
    sums, sizes = np.zeros(GROUPS), np.zeros(GROUPS)
    for e in held.exposures:
        q, w = _scores(own, e.name, held), _scores(base, e.name, held)
        product = (q[1:] * q[:-1]).mean(0)
        frames = len(q) - 1
        sums += frames * np.bincount(groups.reshape(-1), product.reshape(-1), GROUPS)
        sizes += frames * np.bincount(groups.reshape(-1), minlength=GROUPS)
        rho = float(product[many].mean()) - float((w[1:] * w[:-1]).mean())
        rho = _sure(rho, 1 / np.sqrt(frames * many.sum()))
        laws[e.name] = replace(laws[e.name], memory=float(np.clip(rho, -0.9, 0.9)))
    memory = np.zeros(GROUPS)
    for group in range(CONSPICUOUS, GROUPS):
        if sizes[group]:
            rho = _sure(sums[group] / sizes[group], 1 / np.sqrt(sizes[group]))
            memory[group] = np.clip(rho, -0.9, 0.9)
    return replace(own.law, exposures=laws, pixels=replace(own.law.pixels, memory=memory))


def _with_spectra(own: _Virtual, base: _Virtual, held: Held) -> Law:
    """Return the law with the spectra of innovations."""
    laws = dict(own.law.exposures)
    for e in held.locked:
        q, w = _scores(own, e.name, held), _scores(base, e.name, held)
        left = np.stack(
            [
                innovations(own.law, e.name, q[t], q[t - 1], own.sensed.groups)[0]
                for t in range(1, len(q))
            ]
        )
        excess = periodogram(left).mean(0) - periodogram(w[1:]).mean(0)
        spectrum = spectrum_of(excess, len(left), held.shape, held.cfa)
        laws[e.name] = replace(laws[e.name], spectrum=spectrum)
    return replace(own.law, exposures=laws)


def _with_levels(
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
        offset = np.array([_sure(a, b) for a, b in zip(added.mean(0), error, strict=True)])
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


def _with_widths(law: Law, held: Held) -> Law:
    """Return the law with the widths of codes that the training frames show."""
    size = law.cells.lower_dn.size
    expected, counts = np.zeros(size), np.zeros(size, np.int64)
    for e in held.exposures:
        if not e.trained:
            continue
        counts += e.counts
        own = law.exposures[e.name]
        means = e.training_means_dn.mean(0) - law.cells.black_dn
        for site, place in enumerate(site_places(held.cfa)):
            variance = float(own.variance_dn2[place].mean() * own.factor[site])
            spread = max(float(e.mean_dn[place].var()) - variance / e.trained, 0.0)
            sd = np.sqrt(variance + spread)
            centre = law.cells.centre(float(means[site]), sd)
            edges = own.shapes[site].below((law.cells.upper_dn - centre) / sd)
            expected += np.diff(edges, prepend=0.0) * e.trained * e.mean_dn[place].size
    return replace(law, cells=law.cells.learned(counts, expected))
