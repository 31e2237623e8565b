"""The level of the white noise: given, or matched once per content and level to `sd_rgb`.

Both sides are computed on the same few frames with the noise that the clips will carry, so the
solved sigma makes `awgn_rgb` equal `sd_rgb` there; over the whole clip they agree as well as a few
frames stand for all.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from dsis.spec import Spec
from dsis.stimuli.conditions import CODE_MAX, Rendering
from dsis.stimuli.quality import delivered, psnr_db
from dsis.stimuli.source import Source
from dsis.visibility import Eye, pixels_per_degree

Frame = NDArray[np.float32]

FRAMES = 8
SIGMA_MAX = 200.0


def matching_frames(frames: int, count: int = FRAMES) -> tuple[int, ...]:
    """Return up to `count` frame numbers, evenly spaced over the clip."""
    places = np.linspace(0, frames - 1, min(count, frames))
    return tuple(round(float(place)) for place in places)


def solve_sigma(
    spec: Spec, source: Source, rendering: Rendering, content: str, level: int
) -> float:
    """Return the standard deviation of the white noise in 8-bit codes for a content and level."""
    if spec.awgn.sigma is not None:
        return spec.awgn.sigma
    score = _psnr if spec.awgn.match == "psnr" else _visibility(spec)
    pairs = []
    for frame in matching_frames(spec.sequence.frames):
        clean = rendering.camera.clean_raw(source.light(frame))
        reference = rendering.reference(clean)
        target = score(
            rendering.display(rendering.noisy_raw(clean, content, level, frame)), reference
        )
        unit = rendering.noisy_display(reference, 1.0, content, level, frame) / CODE_MAX - reference
        pairs.append((reference, unit, target))

    def excess(sigma: float) -> float:
        found = [score(ref + np.float32(sigma) * unit, ref) for ref, unit, _ in pairs]
        return float(np.mean(found) - np.mean([target for _, _, target in pairs]))

    if excess(0.0) <= 0.0:
        return 0.0  # sd_rgb carries no more than rounding does
    return float(brentq(excess, 0.0, SIGMA_MAX, xtol=1e-3))


def _psnr(test: Frame, reference: Frame) -> float:
    """Falls with sigma; 8-bit rounding keeps it finite at sigma 0 unless the frames are equal."""
    return min(psnr_db(delivered(test), delivered(reference)), 120.0)


def _visibility(spec: Spec) -> Callable[[Frame, Frame], float]:
    eye = Eye(pixels_per_degree(spec.viewing, spec.sequence.height))

    def score(test: Frame, reference: Frame) -> float:
        shown = delivered(test).astype(np.float32) / CODE_MAX
        seen = eye.seen(delivered(reference).astype(np.float32) / CODE_MAX)
        return -eye.difference(shown, seen).energy

    return score
