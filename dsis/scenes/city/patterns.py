"""Textures: hashes of the cells they are made of, averaged over a pixel in closed form.

What is finer than a pixel softens and fades; it never twinkles. Kernels that call these are cached
on disk with them inside: after a change here, remove their caches.
"""

import math

import numpy as np

from dsis.compiled import kernel

_P, _Q, _R = (np.uint64(k) for k in (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9))
_MIX, _S32, _S29, _S40 = np.uint64(0xD6E8FEB86659FD93), np.uint64(32), np.uint64(29), np.uint64(40)


@kernel
def pick(a: int, b: int, c: int) -> float:
    """Return a number in 0..1 of three integers: their hash."""
    h = np.uint64(a) * _P + np.uint64(b) * _Q + np.uint64(c) * _R
    h = (h ^ (h >> _S32)) * _MIX
    h = (h ^ (h >> _S29)) * _MIX
    return float(np.float64(h >> _S40) * 2.0**-24)


@kernel
def smooth(x: float, y: float, seed: int) -> float:
    """Return value noise in -1..1 with features one unit wide."""
    i, j = math.floor(x), math.floor(y)
    s, t = x - i, y - j
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    low = pick(i, j, seed) * (1 - s) + pick(i + 1, j, seed) * s
    high = pick(i, j + 1, seed) * (1 - s) + pick(i + 1, j + 1, seed) * s
    return 2 * (low + t * (high - low)) - 1


@kernel
def bars(x: float, duty: float, pixel: float) -> float:
    """Return the share of a pixel around x covered by bars from n to n + duty, for all n."""
    pixel = max(pixel, 1e-4)
    low, high = x - 0.5 * pixel, x + 0.5 * pixel
    i, j = math.floor(low), math.floor(high)
    return ((j - i) * duty + min(high - j, duty) - min(low - i, duty)) / pixel


@kernel
def fade(size: float, pixel: float) -> float:
    """Return 1 for details wide enough to show in a pixel, towards 0 for finer ones."""
    return min(max(1.5 * size / pixel - 0.5, 0.0), 1.0)
