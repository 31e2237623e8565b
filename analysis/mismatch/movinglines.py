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
_LINES = {
    "row_fpn": ("row_variance", "offset"),
    "column_fpn": ("column_variance", "offset"),
    "row_prnu": ("row_variance", "gain"),
    "column_prnu": ("column_variance", "gain"),
}
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
    if kind not in _LINES:
        return None
    moving, own_map = _LINES[kind]
    left = left_open(state, (moving,))
    if not left:
        return None
    ratios = {  # numbers are cube roots of variances relative to the noise of pixels
        ((key.exposure, key.channel), key.statistic): float(value) ** 3
        for key, value, known in zip(
            state.vector.keys, state.vector.values, state.null.known, strict=True
        )
        if known and key.scope == "exposure"
    }
    larger = {
        place: (ratios[place, moving] - (np.cbrt(ratios[place, moving]) - rest) ** 3) / own
        for (place, _), (rest, _) in left.items()
        if (own := ratios.get((place, _PIXELS), 0.0)) > 0
    }
    seen = np.nan_to_num(state.vector.values - without) > state.null.sd
    pattern = (own_map, f"{own_map} alone"), f"fixed_{moving}"
    line = moving.removesuffix("_variance")
    why = f"{line}s that differ anew in each frame leave as much in means"
    return of_means(state, pattern, larger, (without, seen), why)


def of_means(
    state: State,
    pattern: tuple[tuple[str, ...], str],
    larger: Mapping[Place, float],
    without: tuple[Array, NDArray[np.bool_]],
    why: str,
) -> Denial | None:
    """Return how a pattern is denied by what makes means of frames scatter further; None: it isn't.

    Parameters
    ----------
    state
        With the pattern, or before it is taken in.
    pattern
        Its maps, and the statistic that it explains.
    larger
        By which share of their noise the variance of mean frames is larger for another reason.
    without
        The numbers predicted without the pattern, and where it explains something.
    why
        Of the denial.
    """
    maps, statistic = pattern
    before, explains = without
    seen, fake, clear, rest = 0.0, 0.0, False, False
    for i, key in enumerate(state.vector.keys):
        if key.statistic != statistic or not (state.null.known[i] and explains[i]):
            continue
        # Numbers are cube roots of variances relative to the noise of the mean frame.
        explained = float(state.vector.values[i] ** 3 - before[i] ** 3)
        place, sd = (key.exposure, key.channel), float(state.null.sd[i])
        if place in larger:
            alike = larger[place]
            seen += explained / sd**2
            fake += alike / sd**2
        elif key.scope in maps:
            alike = _in_map(state, larger, maps[0], key.channel)
        else:
            continue
        unit = 3 * max(before[i], LEAST_NUMBER) ** 2 * sd
        clear |= explained > _CLEAR * unit
        rest |= explained - alike > _CLEAR * unit
    if fake <= _MOST * seen and (rest or not clear):
        return None
    return Denial(1 - fake / seen if seen > 0 else 0.0, why)


def _in_map(state: State, larger: Mapping[Place, float], name: str, channel: str) -> float:
    """Return the same of a map over all exposures: of offsets, of gains or of what grows with time.

    Mean frames count by their inverse variances, and by the square of the signal or the time.
    """
    exposures = {e.name: e for e in state.setting.layout.exposures}
    whole = more = 0.0
    for place, level in state.setting.seen.levels.items():
        exposure, own = place
        if own != channel or exposure not in exposures or not level.variance_dn2 > 0:
            continue
        row = _counted_by(state, name, place)
        weight = row**2 * len(exposures[exposure].numbers) / level.variance_dn2
        whole += weight
        more += weight * larger.get(place, 0.0)
    return more / whole if whole > 0 else 0.0


def _counted_by(state: State, name: str, place: Place) -> float:
    """Return what an exposure's offsets are multiplied by in a map."""
    if name == "offset":
        return 1.0
    if name == "gain":
        return max(state.calibrated.fit.signal_dn[place], 0.0)
    return next(e.exposure_time_s for e in state.setting.layout.exposures if e.name == place[0])
