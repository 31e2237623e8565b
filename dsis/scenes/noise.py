"""Value noise in three dimensions, from hashes of lattice points: no table, no order, no seed.

A kernel of its own: the kernels that call it are cached on disk with it inside, so a change here
takes effect once their caches are removed.
"""

import math
from typing import Any

import numpy as np

from dsis.compiled import inlined, kernel

_P, _Q = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xC2B2AE3D27D4EB4F)
_R, _MIX = np.uint64(0x165667B19E3779F9), np.uint64(0xD6E8FEB86659FD93)
_S32, _S29, _S40 = np.uint64(32), np.uint64(29), np.uint64(40)
_UNIT = 2.0**-23


@inlined
def _corner(h: Any) -> Any:
    """Return a number in -1..1 of a lattice point's key."""
    h = (h ^ (h >> _S32)) * _MIX
    h = (h ^ (h >> _S29)) * _MIX
    return np.float64(h >> _S40) * _UNIT - 1.0


@kernel
def noise(x: float, y: float, z: float) -> float:
    """Return value noise in -1..1 with features one unit wide."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    s, t, u = x - i, y - j, z - k
    s, t, u = s * s * (3 - 2 * s), t * t * (3 - 2 * t), u * u * (3 - 2 * u)
    h = np.uint64(np.int64(i)) * _P + np.uint64(np.int64(j)) * _Q + np.uint64(np.int64(k)) * _R
    a, b = _corner(h), _corner(h + _P)
    c, d = _corner(h + _Q), _corner(h + _P + _Q)
    h = h + _R
    e, f = _corner(h), _corner(h + _P)
    g, o = _corner(h + _Q), _corner(h + _P + _Q)
    low = a + s * (b - a) + t * (c - a + s * (d - c - b + a))
    high = e + s * (f - e) + t * (g - e + s * (o - g - f + e))
    return float(low + u * (high - low))


@kernel
def flakes(x: float, y: float, z: float) -> float:
    """Return one number in -1..1 for every cell of a lattice askew to the axes."""
    u, v = 0.80 * x + 0.36 * y - 0.48 * z, -0.60 * x + 0.48 * y - 0.64 * z
    i, j, k = math.floor(u), math.floor(v), math.floor(0.80 * y + 0.60 * z)
    h = np.uint64(np.int64(i)) * _P + np.uint64(np.int64(j)) * _Q + np.uint64(np.int64(k)) * _R
    return float(_corner(h))
