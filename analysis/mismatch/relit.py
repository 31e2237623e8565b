"""The light under which another camera has the levels that were recorded.

Where colours exchange charge a mosaic's levels are not its light, nor are those that a full well
hides. The light of a model is such that
levels are right with the effects that its camera has. A camera with one more, or without it, under
the same light has levels that nobody recorded: above a switch of the read-out, say, what is below.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.layout import Layout, sites
from analysis.mismatch.limited import full_well_of, lit
from analysis.mismatch.model import Model, Sites
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import Effect

Array = NDArray[np.float64]
_ROUNDS = 60  # each leaves a share of what the last one changed: more, the more is exchanged
_SAME, _NEAR = 1e-6, 1e-3  # of a level: as good as recorded, and near enough
_TILES = 6  # of two rows and columns: the middle ones know of no border


def relit(model: Model, camera: Camera, layout: Layout) -> Model:
    """Return the model with another camera, under light that gives the levels of its own one.

    Both greens have one light. Where the light of flats is known, a colour's is off by the same
    share in all of them; where it is not, by its own in each. Where no light gives these levels, it
    stays as it is. So does that of scenes.
    """
    made = _unhidden(model, camera, layout)
    if layout.cfa is Cfa.MONO:
        return made
    before, after = _exchanging(model.camera), _exchanging(camera)
    flats = [e for e in layout.uniform if e.kind == "flat" and (model.signals[e.name] > 0).all()]
    if before == after or not flats:
        return made
    signals = np.stack([made.signals[e.name] for e in flats])
    wanted = _of_colours(np.stack([exchanged(before, own) for own in signals]), layout.cfa)
    known = np.array([e.light is not None for e in flats])
    off = np.inf
    for _ in range(_ROUNDS):
        got = _of_colours(np.stack([exchanged(after, own) for own in signals]), layout.cfa)
        if not (got > 0).all():
            return made
        ratio = wanted / got
        if known.any():
            ratio[known] = ratio[known].mean(0)
        off = float(np.abs(ratio - 1).max())
        if off < _SAME:
            break
        signals = signals * ratio
    if off > _NEAR:
        return made
    names = [e.name for e in flats]
    return replace(made, signals={**made.signals, **dict(zip(names, signals, strict=True))})


def _unhidden(model: Model, camera: Camera, layout: Layout) -> Model:
    """Return the model with another camera, under light that its full well hides as it does."""
    before, after = full_well_of(model.camera), full_well_of(camera)
    if before == after:
        return model.with_camera(camera)
    flats = {e.name for e in layout.uniform if e.kind == "flat" and e.light is None}
    levels = {
        name: np.minimum(own, before) if before is not None and name in flats else own
        for name, own in model.signals.items()
    }
    return Model(camera, lit(camera, layout, levels))


def exchanged(effects: Iterable[Effect], signal_dn: Sites) -> Sites:
    """Return the levels of a mosaic of which effects exchange charge, from those of its light.

    Parameters
    ----------
    effects
        In the order that charge meets them.
    signal_dn
        For rows 0, 1 and columns 0, 1: (2, 2), DN above black.
    """
    effects = list(effects)
    start = _TILES + 2 * sum(effect.reach_pixels() for effect in effects)
    image = np.tile(signal_dn, (start, start)).astype(np.float32)
    for effect in effects:
        image = effect.exchanged(image)
    middle = slice(start, start + 2)
    return np.asarray(image[middle, middle], np.float64)


def _exchanging(camera: Camera) -> list[Effect]:
    return [e for e in camera.chain() if e.exchanges]


def _of_colours(levels: Array, cfa: Cfa) -> Array:
    """Return levels (exposure, 2, 2) with the mean of both greens for either."""
    found, where = levels.copy(), sites(cfa)
    greens = [(slice(None), *where[name]) for name in ("Gr", "Gb")]
    mean = (levels[greens[0]] + levels[greens[1]]) / 2
    for at in greens:
        found[at] = mean
    return found
