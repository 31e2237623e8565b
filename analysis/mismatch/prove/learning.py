"""How the predictive law of a camera model is found.

The base model's law is known in closed form. What physics beyond it changes is learned from a
virtual sensor of the camera beside one of its base model, of the same draws, by the very steps that
the recording goes through: training frames tell the sensor's pattern and its noisy pixels, fresh
frames show what is left then. Noise that both share cancels, so a weak effect changes the law by
little.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.mismatch.prove.cells import cells_of
from analysis.mismatch.prove.dependence import with_dependence, with_levels
from analysis.mismatch.prove.held import Held, HeldExposure
from analysis.mismatch.prove.hot import hot_of
from analysis.mismatch.prove.law import Conspicuous, ExposureLaw, Law
from analysis.mismatch.prove.marginal import with_groups, with_shapes, with_variances
from analysis.mismatch.prove.patterns import Halves, Pattern, pattern_of
from analysis.mismatch.prove.residuals import Residuals, residuals_of
from analysis.mismatch.prove.shape import NORMAL
from analysis.mismatch.prove.sites import site_places
from analysis.mismatch.prove.teeth import teeth_of
from analysis.mismatch.prove.virtual import (
    LEAST_DN2,
    Signals,
    Stack,
    base_of,
    clean_signal,
    virtual_sensor,
)
from dsis.camera import Camera
from dsis.effects import Image
from dsis.effects.impulse import Impulse
from dsis.measures.spikes import variance_of_most

_NOISY = 0.1  # relative excess of variance: chance leaves a group of the virtual sensor 1 % or less
_UNTIED = frozenset(
    {
        "level",
        "pixel_variance",
        "skewness",
        "kurtosis",
        "variance_spread",
        "code_imbalance",
        "code_spacing",
        "frame_variance",
    }
)


@dataclass(frozen=True)
class Bases:
    """Virtual sensors of base models, each made once: cameras that differ in effects share one.

    Attributes
    ----------
    held, signals, seed
        As `law_of` has them.
    stacks
        Frames of the sensor, by base model.
    residuals
        What is left of them, by base model and the edges of its codes.
    """

    held: Held
    signals: Signals
    seed: int
    stacks: dict[str, dict[str, Stack]] = field(default_factory=dict)
    residuals: dict[tuple[str, bytes], Residuals] = field(default_factory=dict)

    def frames(self, base: Camera) -> dict[str, Stack]:
        """Return the frames of a base model's virtual sensor."""
        key = base.model_dump_json()
        if key not in self.stacks:
            self.stacks[key] = virtual_sensor(base, self.held, self.signals, self.seed)
        return self.stacks[key]

    def left(self, law: Law, teeth: Mapping[str, Image]) -> Residuals:
        """Return residuals of a base model under its law; teeth are the camera's own."""

        def made() -> Residuals:
            return residuals_of(law, self.held, self.frames(law.camera), self.seed, teeth)

        if teeth:
            return made()
        edges = law.cells.lower_dn.tobytes() + law.cells.upper_dn.tobytes()
        key = law.camera.model_dump_json(), edges
        if key not in self.residuals:
            self.residuals[key] = made()
        return self.residuals[key]


def law_of(
    camera: Camera, held: Held, signals: Signals, seed: int, bases: Bases | None = None
) -> Law:
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
    bases
        Sensors of base models that were made for other cameras; None: there are none.
    """
    bases, base = bases or Bases(held, signals, seed), base_of(camera)
    cells = cells_of(camera, seed)
    plain = {e.name: _base_law(base, held, e, signals) for e in held.exposures}
    law = Law(camera, cells, plain, (), Conspicuous())
    if camera.effect or camera.saturation_dn or camera.noise.shot != "gaussian":
        teeth = teeth_of(camera, held, signals)
        base_law = Law(base, cells, plain, (), Conspicuous())
        model = virtual_sensor(camera, held, signals, seed)
        calm, ties = without_spikes(camera), None
        if calm != camera and not _untied(calm):
            still = virtual_sensor(calm, held, signals, seed)
            ties = _learned(replace(law, camera=calm), base_law, bases, still, teeth)
            ties = None if _odd(ties) else ties
        law = _learned(law, base_law, bases, model, teeth, ties)
    return law if cells.plain else _with_widths(law, held)


def _base_law(base: Camera, held: Held, exposure: HeldExposure, signals: Signals) -> ExposureLaw:
    clean = clean_signal(held, exposure, signals)
    variance = base.segments.variance_dn2(clean).astype(np.float64)
    sites = len(site_places(held.cfa))
    scene = exposure.kind == "scene"  # the pattern that is used is a mean with an error
    return ExposureLaw(
        np.maximum(variance, LEAST_DN2),
        np.full(sites, 1 + 1 / max(exposure.trained, 1) if scene else 1.0),
        np.zeros(sites),
        (NORMAL,) * sites,
        0.0,
        None,
        np.zeros(sites),
        np.eye(sites),
    )


def _learned(
    law: Law,
    base_law: Law,
    bases: Bases,
    model: Mapping[str, Stack],
    teeth: Mapping[str, Image],
    ties: Law | None = None,
) -> Law:
    """Return the law with all that the virtual sensors show.

    Of effects that tie no samples together but by a frame's mean, and leave no mean pattern, no
    pattern, memory or spectrum is learned: chance would be, of tails above all. Beside any other
    effect all is. `ties`: the law of the camera without its spikes, which has those three: spikes
    of a few virtual frames feign them, or drown a pattern that the training frames tell well but
    for the few pixels that were hit.
    """
    held, other = bases.held, bases.frames(base_law.camera)
    single = ties is not None or _untied(law.camera)
    if ties is not None:
        law = replace(law, patterns=ties.patterns)
    elif not single:
        law = replace(law, patterns=_patterns(law, held, model, other))
    base = bases.left(base_law, teeth)
    own = residuals_of(law, held, model, bases.seed, teeth)
    own = replace(own, law=with_variances(own, base, held))
    own = replace(own, law=with_groups(own, base, held))
    own = replace(own, law=with_shapes(own, base, held))
    if not single:
        own = replace(own, law=with_dependence(own, base, held))
    law = own.law if ties is None else _tied(own.law, ties)
    return with_levels(law, held, model, other)


def without_spikes(camera: Camera) -> Camera:
    """Return a camera that nothing hits."""
    calm = tuple(own for own in camera.effect if not isinstance(own, Impulse))
    return camera.model_copy(update={"effect": calm})


def _untied(camera: Camera) -> bool:
    """Return whether no effect of a camera ties samples, or leaves a mean pattern."""
    return all(own.changes <= _UNTIED for own in camera.effect)


def _odd(law: Law) -> bool:
    """Return whether a law has pixels that stand out or are noisy: a hit one is not told from them.

    Then spikes are what training frames make of such pixels: all must be learned with them.
    """
    far = any(pattern.outliers is not None for pattern in law.patterns)
    return far or bool((np.abs(law.pixels.excess) > _NOISY).any())


def _tied(law: Law, ties: Law) -> Law:
    """Return a law with the memory and the spectra of another."""
    exposures = {
        name: replace(
            own, memory=ties.exposures[name].memory, spectrum=ties.exposures[name].spectrum
        )
        for name, own in law.exposures.items()
    }
    pixels = replace(law.pixels, memory=ties.pixels.memory)
    return replace(law, exposures=exposures, pixels=pixels)


def _patterns(
    law: Law, held: Held, model: Mapping[str, Stack], other: Mapping[str, Stack]
) -> tuple[Pattern, ...]:
    uniform = [e for e in held.exposures if e.kind != "scene"]
    if not uniform:
        return ()
    trained = np.array([e.trained for e in uniform], np.float64)
    times = np.array([e.exposure_time_s for e in uniform])
    found = []
    for place in site_places(held.cfa):
        variance = np.array([law.exposures[e.name].variance_dn2[place].mean() for e in uniform])
        own, base = (_halves([stacks[e.name] for e in uniform], place) for stacks in (model, other))
        pattern = pattern_of(own, base, variance, trained)
        if pattern.outliers is None:
            pattern = replace(pattern, hot=hot_of(law.camera.effect, times, trained / variance))
        found.append(pattern)
    return tuple(found)


def _halves(stacks: list[Stack], place: tuple[slice, slice]) -> Halves:
    early: list[Image] = []
    late: list[Image] = []
    frames = []
    for stack in stacks:
        whole = np.concatenate([stack.training[:, *place], stack.fresh[:, *place]])
        n = len(whole) // 2
        for half, mean in ((early, whole[:n].mean(0)), (late, whole[-n:].mean(0))):
            half.append(mean - mean.mean())
        frames.append(n)
    return Halves(
        np.stack(early).astype(np.float64), np.stack(late).astype(np.float64), np.array(frames)
    )


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
            means_of = np.var if e.kind == "scene" else variance_of_most  # lights are no spikes
            spread = max(float(means_of(e.mean_dn[place])) - variance / e.trained, 0.0)
            sd = np.sqrt(variance + spread)
            centre = law.cells.centre(float(means[site]), sd)
            edges = own.shapes[site].below((law.cells.upper_dn - centre) / sd)
            expected += np.diff(edges, prepend=0.0) * e.trained * e.mean_dn[place].size
    return replace(law, cells=law.cells.learned(counts, expected))
