"""Demosaicking: from one sample per site to three colours.

Three algorithms, one file each: `bilinear`, the plain linear one that correlates noise the most;
`dlmmse` (Zhang and Wu 2005) and `lu_tan` (Lu and Tan 2003), which follow edges and keep the samples
of the mosaic, as the bilinear one does. All take any Bayer phase and any size of at least 8 x 8,
reflect the mosaic at its borders, clip nothing, and give the same bytes for any number of threads.
"""

import numpy as np
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.demosaic import bilinear, dlmmse, lu_tan

METHODS = ("bilinear", "dlmmse", "lu_tan")


def demosaic(
    mosaic: NDArray[np.float32],
    cfa: Cfa,
    method: str,
    *,
    full_scale: float = 1.0,
    out: NDArray[np.float32] | None = None,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Interpolate the colours that a mosaic lacks, by one of `METHODS`.

    Parameters
    ----------
    mosaic
        float32 (row, column), at least 8 x 8; any unit and range, nothing is clipped.
    cfa
        One of the four Bayer phases.
    method
        "bilinear", "dlmmse" or "lu_tan" (without its post-processing).
    full_scale
        The value that code 255 of an 8-bit image corresponds to, in the unit of `mosaic`: what the
        edge-directed methods call a small difference. Scaling both scales the result.
    out
        float32 (row, column, 3), C-contiguous, to write into; re-using one saves time.
    threads
        Number of threads; the result does not depend on it.

    Returns
    -------
    NDArray[np.float32]
        (row, column, 3), in the unit of `mosaic`; `out` where that was given.

    Raises
    ------
    ValueError
        Where an argument is not as said above.
    """
    if method == "bilinear":
        return bilinear.bilinear(mosaic, cfa, out=out, threads=threads)
    if method == "dlmmse":
        return dlmmse.dlmmse(mosaic, cfa, full_scale=full_scale, out=out, threads=threads)
    if method == "lu_tan":
        return lu_tan.lu_tan(mosaic, cfa, full_scale=full_scale, out=out, threads=threads)
    message = f"method is {method!r}, must be one of {', '.join(METHODS)}"
    raise ValueError(message)
