"""Whether a pattern that keeps its phase changes its sign alone, or its size as well."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]
_STRENGTHS = (0.7, 0.85, 1.0, 1.2, 1.4)  # of an amplitude that is not exact
_MIDDLES = 129  # from an amplitude below the least projection to one above the largest
_MOST = 6.0  # amplitude of one frame, beside which sizes that differ by a sixth are one
_FLAT = np.log(2 * np.pi)


def of_any_size(found: Sequence[Complex], amplitudes: Sequence[float], *, real: bool) -> float:
    """Return by how much likelier sizes are that are new in each frame than one of either sign.

    Two fields of a frame, say, each with an offset of its own, make a pattern of two signs and any
    size. Sizes are normal variates about a middle that is each exposure's own, and of two values
    the likeliest one. Both are asked along the phase that most of the pattern has, at
    the likeliest of some amplitudes.

    Parameters
    ----------
    found
        Projections of the frames of each exposure: (frame,), noise of mean square 1.
    amplitudes
        The pattern's amplitude in each, in the same unit.
    real
        Whether all samples of the pattern are real: then projections are, noise and all.
    """
    centred = [own - own.mean() for own in found]
    turn = 0.0 if real else np.angle(sum(complex((own**2).sum()) for own in centred)) / 2
    along = [(own * np.exp(-1j * turn)).real for own in centred]
    noise = 1.0 if real else 0.5
    likely = [
        [_of_both(own, strength * size, noise) for own, size in zip(along, amplitudes, strict=True)]
        for strength in _STRENGTHS
    ]
    any_size, one_size = np.sum(likely, axis=1).max(0)
    return float(any_size - one_size)


def _of_both(own: Array, size: float, noise: float) -> tuple[float, float]:
    """Return the log-likelihoods of frames of an exposure: of sizes that differ, and of one."""
    scale = _MOST / max(size, _MOST)
    own, size = own * scale, size * scale
    spread = size**2 + noise
    differ = -(own**2).sum() / spread / 2 - own.size * (np.log(spread) + _FLAT) / 2
    # All frames may have one sign: the middle is not among them then.
    middle = np.linspace(own.min() - size, own.max() + size, _MIDDLES)[:, np.newaxis]
    signs = [-((own - middle - sign * size) ** 2) / noise / 2 for sign in (-1, 1)]
    one = (np.logaddexp(*signs) - np.log(2) - (np.log(noise) + _FLAT) / 2).sum(1).max()
    return float(differ), float(one)
