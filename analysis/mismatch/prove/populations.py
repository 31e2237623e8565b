"""Pixels that are noisier than others, told by their own training frames.

A pixel's score is the excess of its temporal variance over the others', in standard deviations,
summed over exposures as a constant excess in DN^2 is best seen. Pixels of like score form a group;
how noisy a group is, and how much it remembers, is what a virtual sensor of the model shows.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.prove.sites import site_places
from dsis.cfa import Cfa

Array = NDArray[np.float64]
Groups = NDArray[np.intp]
SCORES: Array = np.array([-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 7.0, 12.0, 25.0])
CONSPICUOUS = 10  # from this group on a pixel is not one of the many
OUTLIER = SCORES.size + 1  # far off in a mean map
GROUPS = OUTLIER + 1
_CUT = 8.0  # means from which a variance counts no more
_ROUNDS = 3


def groups_of(
    variances: Sequence[Array], dof: Sequence[int], expected_dn2: Array, cfa: Cfa
) -> Groups:
    """Return the group of each pixel.

    Parameters
    ----------
    variances
        Temporal variance maps, by exposure.
    dof
        Degrees of freedom of each.
    expected_dn2
        Variance of the base model: (exposure, site), for weights.
    cfa
        Colour filter array.
    """
    score = np.zeros(variances[0].shape)
    for site, place in enumerate(site_places(cfa)):
        norm = 0.0
        for variance, n, expected in zip(variances, dof, expected_dn2[:, site], strict=True):
            own = variance[place]
            mean = _usual(own)
            if n < 2 or mean <= 0:
                continue
            weight = n * float(expected_dn2[:, site].min() / expected)
            score[place] += weight * (own / mean - 1)
            norm += 2 * weight**2 / n
        score[place] /= np.sqrt(norm) if norm else 1.0
    return np.searchsorted(SCORES, score).astype(np.intp)


def _usual(variance: Array) -> float:
    """Return the mean of a variance map, a few large ones cut."""
    mean = float(variance.mean())
    for _ in range(_ROUNDS):
        mean = float(np.minimum(variance, _CUT * mean).mean())
    return mean
