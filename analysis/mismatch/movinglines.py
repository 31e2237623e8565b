"""Fixed patterns that means of few frames feign: of lines that move, of frames that are alike."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.contradicted import Denial
from analysis.mismatch.grown import LEAST_NUMBER
from analysis.mismatch.layout import Place
from analysis.mismatch.leftopen import left_open
from analysis.mismatch.state import State

Array = NDArray[np.float64]
LINES = {
    "row_fpn": ("row_variance", "offset"),
    "column_fpn": ("column_variance", "offset"),
    "row_prnu": ("row_variance", "gain"),
    "column_prnu": ("column_variance", "gain"),
}
"""Patterns of lines: the statistic of lines that move, and the pattern's map."""
_PIXELS = "fixed_pixel_variance"
_CLEAR = 5.0  # standard errors of what stands out
_MOST = 0.5  # of what a pattern would explain, that something else may feign


def moving_lines(state: State, kind: str, without: Array) -> Denial | None:
    """Return how a pattern of lines is denied by lines that move anew in each frame; None: not.

    Of n frames the mean keeps 1 / n of their variance. Ratios of lines' variances to those of
    pixels, less one, are the same of frames and of their mean, but for the pixels' own pattern.
    Where lines that move are left unexplained, and make half of what the pattern would explain,
    there may be no pattern. Nor where what stands out of it, in exposures or in maps over all, does
    no longer beyond that.

    Parameters
    ----------
    state
        With the effect, or before it is taken in.
    kind
        The effect.
    without
        The numbers predicted without it.
    """
    if kind not in LINES:
        return None
    moving, own_map = LINES[kind]
    left = left_open(state, (moving,))
    if not left:
        return None
    numbers = {
        ((key.exposure, key.channel), key.statistic): float(value)
        for key, value, known in zip(
            state.vector.keys, state.vector.values, state.null.known, strict=True
        )
        if known and key.scope == "exposure"
    }
    larger = {}
    for (place, _), (rest, _) in left.items():  # cube roots of variances relative to pixels' noise
        number, pattern = numbers[place, moving], numbers.get((place, _PIXELS), 0.0)
        if pattern > 0:
            larger[place] = (number**3 - (number - rest) ** 3) / pattern**3
    explains = np.nan_to_num(state.vector.values - without) > state.null.sd
    maps, line = (own_map, f"{own_map} alone"), moving.removesuffix("_variance")
    share = of_means(state, (maps, f"fixed_{moving}"), larger, without, explains)
    why = f"{line}s that differ anew in each frame leave as much in means"
    return None if share is None else Denial(share, why)


def of_means(
    state: State,
    pattern: tuple[tuple[str, ...], str],
    larger: Mapping[Place, float],
    without: Array,
    explains: NDArray[np.bool_],
) -> float | None:
    """Return which share of a pattern is left beside what makes means of frames scatter further.

    None: that is half or more, and what stands out of it does so beyond that.

    Parameters
    ----------
    state
        With the pattern, or before it is taken in.
    pattern
        Its maps, and the statistic that it explains.
    larger
        By which share of their noise the variance of mean frames is larger for another reason.
    without
        The numbers predicted without the pattern.
    explains
        Where the pattern explains something.
    """
    maps, statistic = pattern
    seen, fake, clear, rest = 0.0, 0.0, False, False
    for i, key in enumerate(state.vector.keys):
        if key.statistic != statistic or not (state.null.known[i] and explains[i]):
            continue
        # Numbers are cube roots of variances relative to the noise of the mean frame.
        explained = float(state.vector.values[i] ** 3 - without[i] ** 3)
        place, sd = (key.exposure, key.channel), float(state.null.sd[i])
        if place in larger:
            alike = larger[place]
            seen += explained / sd**2
            fake += alike / sd**2
        elif key.scope in maps:
            alike = _in_map(state, larger, maps[0], key.channel)
        else:
            continue
        unit = 3 * max(without[i], LEAST_NUMBER) ** 2 * sd
        clear |= explained > _CLEAR * unit
        rest |= explained - alike > _CLEAR * unit
    if fake <= _MOST * seen and (rest or not clear):
        return None
    return 1 - fake / seen if seen > 0 else 0.0


def _in_map(state: State, larger: Mapping[Place, float], name: str, channel: str) -> float:
    """Return the same of a map over all exposures: of offsets, of gains or of what grows with time.

    Mean frames count by their inverse variances, and by the square of the signal or the time.
    """
    whole = more = 0.0
    for exposure in state.setting.layout.exposures:
        place = (exposure.name, channel)
        level = state.setting.seen.levels.get(place)
        if level is None or not level.variance_dn2 > 0:
            continue
        row = 1.0
        if name == "gain":
            row = max(state.calibrated.fit.signal_dn[place], 0.0)
        elif name == "time":
            row = exposure.exposure_time_s
        weight = row**2 * len(exposure.numbers) / level.variance_dn2
        whole += weight
        more += weight * larger.get(place, 0.0)
    return more / whole if whole > 0 else 0.0
