"""The level of the white noise: given, or matched once per content and level to `sd_rgb`.

Both sides are computed on the same few frames with the noise that the clips will carry, so the
solved sigma makes `awgn_rgb` equal `sd_rgb` there; over the whole clip they agree as well as a few
frames stand for all.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from dsis.errors import InputError
from dsis.spec import SOLVED_SIGMA_MAX, Spec
from dsis.stimuli.conditions import CODE_MAX, Rendering
from dsis.stimuli.quality import delivered, psnr_db
from dsis.stimuli.source import Source
from dsis.visibility import Eye, pixels_per_degree

Frame = NDArray[np.float32]

FRAMES = 8
SIGMA_FIRST = 200.0  # upper end of the first search, 8-bit codes


def matching_frames(frames: int, count: int = FRAMES) -> tuple[int, ...]:
    """Return up to `count` frame numbers, evenly spaced over the clip."""
    places = np.linspace(0, frames - 1, min(count, frames))
    return tuple(round(float(place)) for place in places)


def solve_sigma(
    spec: Spec, source: Source, rendering: Rendering, content: str, level: int
) -> float:
    """Return the standard deviation of the white noise in 8-bit codes for a content and level.

    A given sigma counts at level 0: `level` stops of under-exposure multiply it by 2^level.

    Raises
    ------
    InputError
        No white noise differs from the reference as much as `sd_rgb`: clipping ends its growth.
    """
    if spec.awgn.sigma is not None:
        return spec.awgn.sigma * 2.0**level
    score = _psnr if spec.awgn.match == "psnr" else _visibility(spec)
    pairs = []
    for frame in matching_frames(spec.sequence.frames):
        clean = rendering.camera.clean_raw(source.light(frame))
        reference = rendering.reference(clean)
        raw = rendering.noisy_raw(clean, content, level, frame)
        if not np.isfinite(raw).all():
            fact = f"the camera's noise on content {content!r} at level {level} is not finite"
            raise InputError.of("", "conditions.levels", fact)
        target = score(rendering.display(raw), reference)
        unit = rendering.noisy_display(reference, 1.0, content, level, frame) / CODE_MAX - reference
        pairs.append((reference, unit, target))
    wanted = float(np.mean([target for _, _, target in pairs]))

    def excess(sigma: float) -> float:
        found = [score(ref + np.float32(sigma) * unit, ref) for ref, unit, _ in pairs]
        return float(np.mean(found)) - wanted

    if excess(0.0) <= 0.0:
        return 0.0  # sd_rgb carries no more than rounding does
    highest = SIGMA_FIRST
    while (reached := excess(highest)) > 0.0:
        if highest >= SOLVED_SIGMA_MAX:
            raise _unreachable(spec, content, level, wanted, wanted + reached)
        highest = min(4.0 * highest, SOLVED_SIGMA_MAX)
    return float(brentq(excess, 0.0, highest, xtol=1e-3))


def _unreachable(spec: Spec, content: str, level: int, wanted: float, reached: float) -> InputError:
    """Return the error of a level that no white noise can be matched to."""
    if spec.awgn.match == "psnr":
        has, most = f"a PSNR of {wanted:.2f} dB", f"goes down to {reached:.2f} dB"
    else:
        has, most = f"a visible noise energy of {-wanted:.4g}", f"reaches {-reached:.4g}"
    fact = f"at level {level} sd of content {content!r} has {has}, and white noise only {most}, "
    fact += "however strong: leave this level out, or give awgn.sigma in place of awgn.match"
    return InputError.of("", f"conditions.levels, awgn.match = {spec.awgn.match!r}", fact)


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
