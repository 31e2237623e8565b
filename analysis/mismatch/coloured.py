"""Maps that are not white: a wave, or what neighbours share, is no pattern of single pixels."""

from collections.abc import Sequence
from math import inf, log

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.bank.peaks import white_level
from analysis.mismatch.bank.standing import NAME as FIXED_WAVE
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.standout import first_maps
from analysis.mismatch.state import State

Array = NDArray[np.float64]
MAPS = {
    "dsnu": ("offset", "offset alone"),
    "prnu": ("gain", "gain alone"),
    "hot_pixels": ("time", "time alone"),
}
"""By pattern its maps: the first is noisier, for others' patterns are taken off it."""
_OF_ALL = frozenset({"dsnu", "prnu"})
_NEIGHBOURS = frozenset({"fixed_correlation_0_1", "fixed_correlation_1_0", "fixed_patch_variance"})
_SURE = 4.0  # standard errors of what few frequencies make
_MOST = 0.5  # of a pattern's variance, that something else may feign
_FINE = 0.25  # cycles per pixel
_CORRELATION = "correlation_"


def coloured(state: State, kind: str) -> Denial | None:
    """Return how a pattern of all pixels is denied by a map that is not white; None: it is not.

    A pattern that is drawn anew for each pixel has the same power at all frequencies, as noise has.
    Where a wave is left unexplained, or that neighbours are alike, and half of the map's variance
    beyond noise, lines and smooth surfaces is of few frequencies, all pixels may be alike but for
    it: the median bin knows of the many, and where no noise of frames is alike in neighbours, which
    may be of a filter, so do the finest waves. By chance these differ from the mean of all bins by
    what their own error is beyond its. Nor is it certain that all differ, where neighbours are
    alike and the median bin does not say so.
    """
    called = {m.statistic for m in state.mismatches} & {FIXED_WAVE, *_NEIGHBOURS}
    if kind not in MAPS or not called:
        return None
    plain, most, square = 0.0, 0.0, 0.0
    powers = []
    for image, noise in first_maps(state, MAPS[kind]).values():
        part = parts(image, noise)
        power = np.abs(np.fft.rfft2(part.pixels)[1:, 1:-1]) ** 2 / image.size
        powers.append((power, image.shape))
        plain += part.square - 1
        most += white_level(power, 1) - 1
        square += 2 / image.size
    error, beyond = square**0.5 / log(2), (square * (1 / log(2) ** 2 - 1)) ** 0.5
    few = most < _MOST * plain and plain - most >= _SURE * beyond
    alike = kind in _OF_ALL and not called.isdisjoint(_NEIGHBOURS)
    if alike and not few and not _noise_alike(state):
        fine, of_fine = _finest(powers)
        if fine < _MOST * plain and plain - fine >= _SURE * max(of_fine - square, 0.0) ** 0.5:
            few, most = True, fine
    unsure = most < _SURE * error and alike
    if plain <= 0 or not (few or unsure):
        return None
    if not few:
        why = "neighbours are alike, and beside that it is not certain that all pixels differ"
        return Denial(float(np.clip(most / (_SURE * error), 0.0, 1.0)), why)
    why = "a wave that stands still makes" if FIXED_WAVE in called else "neighbours have in common"
    return Denial(max(most / plain, 0.0), f"{why} most of what it would explain")


def _finest(powers: Sequence[tuple[Array, tuple[int, ...]]]) -> tuple[float, float]:
    """Return the power of waves of less than four pixels along rows and columns, and its square.

    Beyond noise, summed over channels: of each its spectrum, and the shape of its map. Where one is
    too narrow for such waves nothing is known: infinite.
    """
    power, square = 0.0, 0.0
    for own, shape in powers:
        down, across = np.abs(np.fft.fftfreq(shape[0])[1:]), np.fft.rfftfreq(shape[1])[1:-1]
        finest = own[np.ix_(down > _FINE, across > _FINE)]
        if not finest.size:
            return inf, inf
        power += float(finest.mean()) - 1
        square += 1 / finest.size
    return power, square


def _noise_alike(state: State) -> bool:
    """Return whether noise of neighbours is alike, in the model or besides.

    What makes it so, a filter say, may smooth patterns as well.
    """
    modelled = any(
        name.startswith(_CORRELATION) for own in state.camera.effect for name in own.measures
    )
    return modelled or any(m.statistic.startswith(_CORRELATION) for m in state.mismatches)
