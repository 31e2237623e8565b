"""Patterns of single pixels that few patches make, as dust and blots do."""

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.bank.patches import OUTLYING_PATCH
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.likepatches import in_squares, patches_of
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_MAPS = {"dsnu": "offset", "prnu": "gain"}
_CALLS = frozenset({"fixed_patch_variance", OUTLYING_PATCH})
_INSIDE = 0.5  # of a patch's depth, up to which pixels belong to it
_MOST = 0.5  # of a pattern's variance, that patches may make
_SURE = 4.0  # standard errors of the variance of the other pixels, from which there is a pattern


def in_patches(state: State, kind: str) -> Denial | None:
    """Return how a pattern of all pixels is denied by few patches; None: it is not.

    Where pixels that lie together are left alike, and outside of the patches that a map shows half
    of its variance beyond noise is left, or less, and not for sure, all pixels may be alike but for
    them.
    """
    if kind not in _MAPS or all(m.statistic not in _CALLS for m in state.mismatches):
        return None
    plane = _plane(state, _MAPS[kind])
    if plane is None:
        return None
    part = parts(*plane)
    image, side = in_squares(part.pixels)
    inside = np.zeros(image.shape, np.bool_)
    for _, patch in patches_of(image):
        inside |= np.abs(patch) > _INSIDE * float(np.abs(patch).max())
    covered = np.zeros(part.pixels.shape, np.bool_)
    large = inside.repeat(side, 0).repeat(side, 1)
    covered[: large.shape[0], : large.shape[1]] = large
    if not covered.any() or covered.all():
        return None
    square = np.square(part.pixels)
    whole, rest = part.square - 1, part.square * float(square[~covered].mean() / square.mean()) - 1
    sure = _SURE * (2 / np.count_nonzero(~covered)) ** 0.5
    if whole <= 0 or rest >= min(_MOST * whole, sure):
        return None
    return Denial(max(rest / whole, 0.0), "few patches make most of what it would explain")


def _plane(state: State, name: str) -> tuple[Array, float] | None:
    """Return a map that all channels share, and its noise; None: not all have one.

    Channels count by the inverse variance of their noise.
    """
    layout, images = state.setting.layout, state.setting.seen.images
    if any((channel, name) not in images for channel in layout.channels):
        return None
    found = []
    for channel in layout.channels:
        image, noise = images[channel, name]
        scale = layout.regressors(channel).scales[name]
        found.append((image / scale, noise / scale))
    rows, columns = np.min([image.shape for image, _ in found], 0)
    weights = np.array([noise**-2.0 for _, noise in found])
    planes = np.stack([image[:rows, :columns] for image, _ in found])
    return np.tensordot(weights / weights.sum(), planes, 1), float(weights.sum() ** -0.5)
