"""Codes that single electrons make more frequent: a comb that stays as levels wander."""

from collections.abc import Mapping
from zlib import crc32

import numpy as np

from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.virtual import Signals, clean_signal
from dsis.camera import Camera
from dsis.effects import Image

_SEEN = 0.01  # share by which codes differ in frequency
_MANY = 4.0  # electrons, from which an interval of a shape is no finer than two teeth


def teeth_of(camera: Camera, held: Held, signals: Signals) -> dict[str, Image]:
    """Return the distance of codes that single electrons make, DN: by exposure (row, column).

    0 where no comb is seen: electrons of g DN each, in read noise of variance r, make codes g apart
    more frequent by a share 2 exp(-2 pi^2 r / g^2). Exposures without one are left out.
    """
    counts = any(effect.kind == "poisson_shot_noise" for effect in camera.effect)
    if not counts and camera.noise.shot != "poisson":
        return {}
    segments, found = camera.segments, {}
    for e in held.exposures:
        clean = clean_signal(held, e, signals)
        which = segments.index(clean)
        step, read = segments.slope_dn[which], np.maximum(segments.intercept_dn2[which], 0)
        electrons = clean / np.maximum(step, np.float32(1e-6))
        depth = 2 * np.exp(-2 * np.pi**2 * read / np.maximum(step, np.float32(1e-6)) ** 2)
        teeth = np.where((depth > _SEEN) & (electrons >= _MANY), step, 0).astype(np.float32)
        if teeth.any():
            found[e.name] = teeth
    return found


def blurred(frames: Image, teeth: Mapping[str, Image], name: str, seed: int) -> Image:
    """Return frames (frame, row, column) whose codes single electrons make no more frequent.

    A law about each frame's own level cannot tell where a comb lies: levels wander by less than the
    distance of its teeth, and by more than their width. What is drawn evenly over one tooth takes
    all of the comb away, and leaves the envelope; the draws are the same for every camera.
    """
    if name not in teeth:
        return frames
    draws = np.random.default_rng([seed, crc32(name.encode())])
    even = draws.random(frames.shape, np.float32) - np.float32(0.5)
    return frames + even * teeth[name]
