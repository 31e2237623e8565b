"""All frames of an exposure at once: the sums of small frames, whose Python takes as long as they.

What an `Accumulator` does frame by frame, in the same order: the same bytes. A loop over frames
calls each kernel alone, and what follows from its sums is made of all frames together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from dsis.cfa import Cfa
from dsis.measures import all_frames
from dsis.measures.first_pass import passes
from dsis.measures.kernels import Sums
from dsis.measures.lag_products import lag_products_of_all

if TYPE_CHECKING:
    from dsis.measures.accumulator import Accumulator
    from dsis.measures.plane import Sheets, Transforms

Frames = NDArray[np.float32]


def take_all(sums: Accumulator, frames: Frames) -> None:
    """Take all frames (frame, row, column), contiguous, of an accumulator that has none yet.

    Raises ValueError where a value is not finite.
    """
    differences, found = passes(frames)
    for number in np.flatnonzero(~found.whole).tolist():
        if not np.isfinite(frames[number]).all():
            message = f"frame {number} holds values that are not finite (NaN or infinite)"
            raise ValueError(message)
    sums.codes.add_all(frames, whole=bool(found.whole.all()), low=found.lowest, high=found.highest)
    row_offsets, column_offsets, means = all_frames.offsets_of_all(
        found.by_row, found.by_column, sums.cfa is Cfa.MONO
    )
    sums.first, sums.frames = frames[0], len(frames)
    sums.row_sums, sums.column_sums = list(found.by_row), list(found.by_column)
    sums.means, sums.pair_squares = list(means), list(found.squares[1::2])
    spectra = [_taken_planes(sums, sheet, differences, means) for sheet in sums.sheets]
    if sums.power and sums.spectra is not None:
        for of_frame in zip(*spectra, strict=True):
            for transforms in of_frame:
                sums.spectra(transforms)
    centred, moments = all_frames.moments_of_all(differences, row_offsets, column_offsets)
    sums.moments = moments if len(frames) > 2 else None  # of two the second's residual says it all
    sums.centred, sums.centred_before = centred[-1], centred[0]
    sums.before, sums.difference = differences[-1], differences[0]  # should more frames come
    if sums.neighbours:
        sums.lag_sums += lag_products_of_all(centred[1:], sums.reach)


def _taken_planes(
    sums: Accumulator, sheet: Sheets, differences: Frames, means: Sums
) -> Sequence[Transforms]:
    """Take the planes of one size, surfaces and power; return the transforms of each frame."""
    sheet.start()
    images = np.empty((len(differences) - 1, *sheet.images.shape), np.float32)
    all_frames.split_all(differences[1:], sheet.places, means[1:], images)
    sheet.surfaces += list(sheet.planes[0].smooth.coefficients(images))
    if not sums.power:
        return []
    found = scipy.fft.rfft2(images)
    all_frames.add_powers(found, sheet.power)
    return list(found)
