"""Scenes among the exposures: their place in the layout, and their clean signal in the model."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.basefit import BaseFit, Offsets
from analysis.mismatch.bending import bending_offsets
from analysis.mismatch.layout import Layout, Place
from analysis.mismatch.model import Model
from analysis.mismatch.scenes import SCENE, Scene, scene_of, without_picture
from dsis.cfa import Cfa


def with_scenes(
    layout: Layout,
    means: Mapping[Place, float],
    first: Callable[[str, Sequence[int]], Iterable[NDArray[np.generic]]],
) -> Layout:
    """Return the layout with its scenes, without those that move.

    A scene counts from the darks of its time, as flats do; without darks from the nominal black.
    """
    scenes: dict[str, Scene] = {}
    signal, variances = dict(layout.signal_dn), dict(layout.variance_dn2)
    step = 1 if layout.cfa is Cfa.MONO else 2
    planes = {c: (slice(y, None, step), slice(x, None, step)) for c, (y, x) in layout.sites.items()}
    everything = tuple(e for e in layout.exposures if e.kind == SCENE)
    for e in everything:
        dark = {c: layout.black_dn + _of_darks(layout, c, e.exposure_time_s, means) for c in planes}
        scene = scene_of(first(e.name, e.numbers), planes, dark)
        if scene is None:
            continue
        scenes[e.name] = scene
        for channel, local in scene.channels.items():
            parts = {channel: slice(None)} | {
                f"{channel} {label}": one.ranges for label, one in local.bins.items()
            }
            for name, part in parts.items():
                place = (e.name, name)
                signal[place] = max(local.mean(local.signal_dn, part), 0.0)
                variances[place] = max(local.mean(local.variance_dn2, part), 0.05)
    moving = tuple(e.name for e in everything if e.name not in scenes)
    kept = tuple(e for e in layout.exposures if e.name not in moving)
    return replace(
        layout,
        exposures=kept,
        signal_dn=signal,
        variance_dn2=variances,
        scenes=scenes,
        moving=moving,
    )


def with_pictures(
    model: Model, layout: Layout, fit: BaseFit, effects: Offsets, *, seed: int, jobs: int
) -> Model:
    """Return a model with the clean signal of each scene: its picture, response undone.

    What the camera's effects add to the level of flats, beyond that of darks, is taken off.
    """
    plain = without_picture(model.camera)
    if plain is not model.camera:
        effects = bending_offsets(model.with_camera(plain), layout, seed, jobs)
    step = 1 if layout.cfa is Cfa.MONO else 2
    signals = dict(model.signals)
    flats = [e for e in layout.uniform if e.kind == "flat"]
    for e in layout.pictures:
        clean = layout.scenes[e.name].signal_dn.astype(np.float64)
        for channel, (y, x) in layout.sites.items():
            pairs = sorted(
                (
                    fit.signal_dn[flat.name, channel],
                    effects.level_dn[flat.name, channel]
                    - _of_darks(layout, channel, flat.exposure_time_s, effects.level_dn),
                )
                for flat in flats
                if effects.level_dn
            )
            if pairs:
                own = clean[y::step, x::step]
                own -= np.interp(own, *np.transpose([(0.0, 0.0), *pairs]))
        signals[e.name] = clean
    return replace(model, signals=signals)


def _of_darks(layout: Layout, channel: str, time_s: float, values: Mapping[Place, float]) -> float:
    """Return a value of the darks at an exposure time, by interpolation; 0 without darks."""
    times: dict[float, list[float]] = {}
    for e in layout.exposures:
        if e.kind == "dark":
            times.setdefault(e.exposure_time_s, []).append(values[e.name, channel])
    if not times:
        return 0.0
    ordered = sorted(times)
    return float(np.interp(time_s, ordered, [float(np.mean(times[t])) for t in ordered]))
