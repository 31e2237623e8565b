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
_NOTHING = -746.0  # whose exponential is 0
_SMALL = 1e-100  # a product of two is a number still


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
    frames = x.shape[1]
    switches = np.abs(np.diff(_bits(frames), axis=1)).sum(1).astype(np.int64)
    number = np.arange(frames)
    chances = np.stack([0.5 * w**number * (1 - w) ** (frames - 1 - number) for w in switching])
    out = np.empty((len(x), len(heights_dn), len(switching)))
    _jumps(_centred(x), noise_dn2, heights_dn, (switches, chances), out)
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
    count = _bits(x.shape[1]).sum(1).astype(np.int64)
    number = np.arange(x.shape[1] + 1)
    chances = np.stack([p**number * (1 - p) ** (x.shape[1] - number) for p in shares])
    out = np.empty((len(x), len(added_dn2), len(shares)))
    _spikes(_centred(x), noise_dn2, added_dn2, (count, chances), out)
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
def _mean(terms: Any, most: float, chances: Any, sums: Any, out: Any) -> None:
    """Set the log of the mean of exp(term) over all sequences, by each of their probabilities.

    `chances` are the class of each sequence, and the probability of one of each class:
    (probability, class); `sums` is written to, (class,).
    """
    kinds, likely = chances
    sums[:] = 0.0
    for s in range(terms.size):
        if terms[s] - most > _NOTHING:  # to find that it is nothing takes longest
            sums[kinds[s]] += exp(terms[s] - most)
    for p in range(out.size):
        own = 0.0
        for k in range(sums.size):
            own += likely[p, k] * sums[k]
        out[p] = most + log(max(own, 1e-300))


@kernel
def _jumps(x: Any, noise: Any, heights: Any, chances: Any, out: Any) -> None:
    pixels, frames = x.shape
    sums, squares = np.empty(1 << frames), np.empty(1 << frames)
    counts = np.empty(1 << frames, np.int64)
    classes = np.empty(chances[1].shape[1])
    losses = np.empty((heights.size, frames + 1))  # of so many frames in the second state
    for h in range(heights.size):
        for k in range(frames + 1):
            losses[h, k] = heights[h] * heights[h] * k * (frames - k) / (2 * frames)
    for i in range(pixels):
        _sums(x[i], frames, sums, squares, counts)
        for h in range(heights.size):
            a = heights[h]
            most = -1e300
            for s in range(sums.size):
                squares[s] = (a * sums[s] - losses[h, counts[s]]) / noise[i]
                most = max(most, squares[s])
            _mean(squares, most, chances, classes, out[i, h])


@kernel
def _spikes(x: Any, noise: Any, added: Any, chances: Any, out: Any) -> None:
    pixels, frames = x.shape
    sums, squares = np.empty(1 << frames), np.empty(1 << frames)
    counts = np.empty(1 << frames, np.int64)
    terms = np.empty(1 << frames)
    weights, logs = np.empty(frames + 1), np.empty(frames + 1)  # of so many noisier frames
    classes = np.empty(frames + 1)
    for i in range(pixels):
        _sums(x[i], frames, sums, squares, counts)
        b = 1 / noise[i]
        for v in range(added.size):
            a = 1 / (noise[i] + added[v])
            for k in range(frames + 1):
                weights[k] = (a - b) ** 2 / ((frames - k) * b + k * a)
                logs[k] = k * log(a / b) - log(((frames - k) * b + k * a) / (frames * b))
            most = -1e300
            for s in range(sums.size):
                k = counts[s]
                bent = (a - b) * squares[s] - weights[k] * sums[s] ** 2
                terms[s] = (logs[k] - bent) / 2
                most = max(most, terms[s])
            _mean(terms, most, chances, classes, out[i, v])


@kernel
def of_mixtures(own: Any, beside: Any, weight: Any, parts: Any, out: Any) -> None:
    """Set the log-likelihood of all pixels, of which a share has laws of its own: (law, share).

    Parameters
    ----------
    own
        Likelihood under each law, at most about 1: (law, pixel).
    beside
        The same under the law of all others, (pixel,).
    weight
        For how many pixels each stands, (pixel,): those that stand for as many follow each other.
    parts
        Shares.
    """
    product, sums = np.empty(parts.size), np.empty(parts.size)
    larger, likely = np.empty(parts.size), np.empty(parts.size)
    for law in range(own.shape[0]):
        product[:] = 1.0
        sums[:] = 0.0
        for i in range(beside.size):
            other, more = beside[i], own[law, i] - beside[i]
            last = i == beside.size - 1 or weight[i + 1] != weight[i]
            for k in range(parts.size):
                likely[k] = other + parts[k] * more
                larger[k] = product[k] * likely[k]
            small = last
            for k in range(parts.size):
                small |= (likely[k] < _SMALL) | (larger[k] < _SMALL**2)
            if small:
                _take_logarithms(likely, weight[i], last, product, sums)
            else:
                product[:] = larger
        out[law] = sums


@kernel
def _take_logarithms(likely: Any, weight: float, last: bool, product: Any, sums: Any) -> None:
    """Multiply products by what is likely; add logarithms where they are small, or the last."""
    for k in range(likely.size):
        if likely[k] < _SMALL:
            sums[k] += weight * log(max(likely[k], 1e-300))
        else:
            product[k] *= likely[k]
        if last or product[k] < _SMALL**2:
            sums[k] += weight * log(product[k])
            product[k] = 1.0
