"""Collaborative filtering: similar blocks are transformed together, shrunk, and put back."""

import numpy as np
from numpy.typing import NDArray

from analysis.denoising.bm3d_groups import (
    MOST,
    Groups,
    Sums,
    gather,
    haar,
    haar_back,
    scatter,
    transform,
)
from analysis.denoising.bm3d_shrinkage import (
    Shrinkage,
    combine_covariances,
    cut,
    fill_covariances,
    repeat,
    shrink_as_wiener,
)
from dsis.compiled import kernel


@kernel
def filter_groups(
    noisy: NDArray[np.float32],
    basic: NDArray[np.float32],
    groups: Groups,
    shrinkage: Shrinkage,
    sums: Sums,
) -> None:
    """Filter the groups of a band and add the results, times their weights, to its sums.

    With an empty `basic` coefficients below the threshold are set to zero (weight: one over the
    noise variance that remains); otherwise they are multiplied by Wiener's b^2/(b^2 + v), b from
    `basic`, v the noise variance. The mean of a group is kept as it is: a shift of the image shifts
    the result.

    Parameters
    ----------
    noisy, basic
        float32 (channel, row, column); `basic` may have no channel.
    groups, shrinkage, sums
        See there.
    """
    channels, _, width = noisy.shape
    wiener = basic.shape[0] > 0
    a = np.empty((8, MOST * 8), np.float32)
    b = np.empty((8, MOST * 8), np.float32)
    spare = np.empty((8, MOST * 8), np.float32)
    left = np.empty(MOST * 8, np.float32)
    independent = shrinkage.covariance.shape[1] == 1
    variances = np.empty((channels, 8, MOST * 8), np.float32)
    for channel in range(channels):
        repeat(shrinkage.covariance[channel, 0, 0], shrinkage.least, variances[channel])
    members = 1 if independent else MOST
    between = np.empty((members, members, 64), np.float32)
    for r in range(groups.counts.shape[0]):
        for c in range(groups.counts.shape[1]):
            count = groups.counts[r, c]
            order = 0
            while (1 << order) < count:
                order += 1
            slots = groups.slots[order]
            places = groups.places[r, c]
            for channel in range(channels):
                variance = variances[channel]
                if not independent:
                    covariance = shrinkage.covariance[channel]
                    fill_covariances(covariance, places, slots, count, width, between)
                    combine_covariances(between, shrinkage.least, variance, count)
                gather(noisy[channel], places, slots, count, a)
                haar(a, count)
                transform(shrinkage.forward, a, spare, count)
                if wiener:
                    gather(basic[channel], places, slots, count, b)
                    haar(b, count)
                    transform(shrinkage.forward, b, spare, count)
                    remaining = shrink_as_wiener(a, b, variance, left, count)
                else:
                    remaining = cut(a, variance, shrinkage.threshold, left, count)
                transform(shrinkage.inverse, a, spare, count)
                haar_back(a, count)
                certainty = np.float32(1) / remaining
                scatter(a, places, slots, count, shrinkage.window, certainty, sums, channel)
