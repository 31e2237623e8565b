"""How likely a pixel's frames are under several laws, relative to Gaussian noise of the many.

Of x, the frames of one exposure at one pixel, the mean is unknown and integrated out: fixed
patterns speak for none. Laws are: two levels between which a pixel jumps; another variance; single
frames of another variance; a drift. All sequences of a few frames are summed over one by one.
"""

from math import exp, log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

Array = NDArray[np.float64]
MOST_FRAMES = 8  # of which all sequences are summed over


def of_jumps(x: Array, noise_dn2: Array, heights_dn: Array, switching: Array) -> Array:
    """Return the log-likelihood of two levels: (pixel, height, probability of a switch).

    Both levels are as frequent; a trap starts in either.

    Parameters
    ----------
    x
        (pixel, frame), DN; `MOST_FRAMES` at most.
    noise_dn2
        (pixel,).
    heights_dn
        Between the levels.
    switching
        Probabilities, from one frame to the next.
    """
    chances = np.stack([_chains(x.shape[1], w) for w in switching])
    out = np.empty((len(x), len(heights_dn), len(switching)))
    _jumps(_centred(x), noise_dn2, heights_dn, chances, out)
    return out


def of_spikes(x: Array, noise_dn2: Array, added_dn2: Array, shares: Array) -> Array:
    """Return the log-likelihood of frames some of which are noisier: (pixel, variance, share).

    Parameters
    ----------
    x, noise_dn2
        As above.
    added_dn2
        What is added to the variance of such a frame.
    shares
        Of such frames.
    """
    count = _bits(x.shape[1]).sum(1)
    chances = np.stack([p**count * (1 - p) ** (x.shape[1] - count) for p in shares])
    out = np.empty((len(x), len(added_dn2), len(shares)))
    _spikes(_centred(x), noise_dn2, added_dn2, chances, out)
    return out


def of_variances(x: Array, noise_dn2: Array, added_dn2: Array) -> Array:
    """Return the log-likelihood of other variances: (pixel, variance).

    `added_dn2` is what is added to `noise_dn2`, (variance,) or (pixel, variance).
    """
    square = (_centred(x) ** 2).sum(1)[:, None]
    ratio = np.maximum(1 + added_dn2 / noise_dn2[:, None], 1e-3)
    dof = x.shape[1] - 1
    return np.asarray(square / noise_dn2[:, None] * (1 - 1 / ratio) / 2 - dof / 2 * np.log(ratio))


def of_drifts(x: Array, noise_dn2: Array, added_dn2: Array) -> Array:
    """Return the log-likelihood of frames that drift one way: (pixel, variance, course).

    The course is even, or settles within a quarter of the frames or within one; how far it goes is
    normally distributed. `added_dn2`, (variance,), is the mean variance of that over the frames.
    """
    frames = x.shape[1]
    number = np.arange(frames)
    courses = [number, np.exp(-4.0 * number / frames), np.exp(-1.0 * number)]
    own = np.stack([course - course.mean() for course in courses], 1)
    own /= np.linalg.norm(own, axis=0)
    square = (_centred(x) @ own)[:, None] ** 2 / noise_dn2[:, None, None]
    ratio = 1 + frames * added_dn2[:, None] / noise_dn2[:, None, None]
    return np.asarray(square * (1 - 1 / ratio) / 2 - np.log(ratio) / 2)


def _centred(x: Array) -> Array:
    return np.ascontiguousarray(x - x.mean(1, keepdims=True))


def _bits(frames: int) -> Array:
    """Return all sequences of two states, (sequence, frame)."""
    number = np.arange(2**frames)
    return np.asarray((number[:, None] >> np.arange(frames)) & 1, np.float64)


def _chains(frames: int, switching: float) -> Array:
    """Return how probable each sequence is, (sequence,)."""
    switches = np.abs(np.diff(_bits(frames), axis=1)).sum(1)
    stays = frames - 1 - switches
    return np.asarray(0.5 * switching**switches * (1 - switching) ** stays)


@kernel
def _sums(x: Any, frames: int, sums: Any, squares: Any, counts: Any) -> None:
    """Sum samples and squares over the frames of each sequence that are in the second state."""
    sums[0], squares[0], counts[0] = 0.0, 0.0, 0
    for t in range(frames):
        half = 1 << t
        for s in range(half):
            sums[half + s] = sums[s] + x[t]
            squares[half + s] = squares[s] + x[t] * x[t]
            counts[half + s] = counts[s] + 1


@kernel
def _mean(terms: Any, most: float, chances: Any, out: Any) -> None:
    """Set the log of the mean of exp(term) over all sequences, by each of their probabilities."""
    out[:] = 0.0
    for s in range(terms.size):
        likely = exp(terms[s] - most)
        for p in range(out.size):
            out[p] += chances[p, s] * likely
    for p in range(out.size):
        out[p] = most + log(max(out[p], 1e-300))


@kernel
def _jumps(x: Any, noise: Any, heights: Any, chances: Any, out: Any) -> None:
    pixels, frames = x.shape
    sums, squares = np.empty(1 << frames), np.empty(1 << frames)
    counts = np.empty(1 << frames, np.int64)
    for i in range(pixels):
        _sums(x[i], frames, sums, squares, counts)
        for h in range(heights.size):
            a = heights[h]
            most = -1e300
            for s in range(sums.size):
                k = counts[s]
                squares[s] = (a * sums[s] - a * a * k * (frames - k) / (2 * frames)) / noise[i]
                most = max(most, squares[s])
            _mean(squares, most, chances, out[i, h])


@kernel
def _spikes(x: Any, noise: Any, added: Any, chances: Any, out: Any) -> None:
    pixels, frames = x.shape
    sums, squares = np.empty(1 << frames), np.empty(1 << frames)
    counts = np.empty(1 << frames, np.int64)
    terms = np.empty(1 << frames)
    for i in range(pixels):
        _sums(x[i], frames, sums, squares, counts)
        b = 1 / noise[i]
        for v in range(added.size):
            a = 1 / (noise[i] + added[v])
            most = -1e300
            for s in range(sums.size):
                k = counts[s]
                weight = (frames - k) * b + k * a
                bent = (a - b) * squares[s] - (a - b) ** 2 * sums[s] ** 2 / weight
                terms[s] = (k * log(a / b) - log(weight / (frames * b)) - bent) / 2
                most = max(most, terms[s])
            _mean(terms, most, chances, out[i, v])
