"""What a recording's description says that its levels contradict: black level, kind, light."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isclose, sqrt

import numpy as np

_SURE = 5.0  # standard errors
_NOISES = 3.0  # standard deviations of a pixel: black levels are stated no better, and wander
_CODE = 0.5  # of rounding, DN
_SHARE = 0.5  # of the noise that a dark current of that size has
_ALIKE = 0.1  # of the middle ratio of level to light: responses bend by less
_OFF = 1.5  # times the light that a level asks for
_LOWER = 0.8  # of another flat's level, at more light: no full well makes that
_LEAST = 3  # flats that agree


@dataclass(frozen=True)
class Described:
    """An exposure as described, and its level over all channels.

    Attributes
    ----------
    name, kind, exposure_time_s, light
        As described.
    level_dn, error_dn
        Mean code, and its standard error.
    variance_dn2
        Of a pixel over time.
    """

    name: str
    kind: str
    exposure_time_s: float
    light: float | None
    level_dn: float
    error_dn: float
    variance_dn2: float

    @classmethod
    def of(
        cls,
        name: str,
        kind: str,
        exposure_time_s: float,
        light: float | None,
        channels: Sequence[tuple[float, float, float]],
    ) -> "Described":
        """Return an exposure of which each channel has a level, its error, and a variance."""
        level, error, variance = np.mean(channels, 0).tolist()
        return cls(name, kind, exposure_time_s, light, level, error, variance)


def contradictions(exposures: Sequence[Described], black_dn: float) -> tuple[str, ...]:
    """Return what of a description cannot be, in sentences; of a sound recording nothing.

    `black_dn` is the nominal black level. None of the exposures is clipped.
    """
    darks = [e for e in exposures if e.kind == "dark"]
    flats = [e for e in exposures if e.kind == "flat"]
    found = _darker(darks, flats) or _on_black(darks, flats, black_dn)
    return (*found, *_on_light(darks, flats, black_dn))


def _darker(darks: Sequence[Described], flats: Sequence[Described]) -> list[str]:
    """Return which flats are darker than a dark of no longer time: dark current makes that not."""
    for dark in darks:
        room = _NOISES * sqrt(max(dark.variance_dn2, 0.0)) + _CODE
        names = [
            flat.name
            for flat in flats
            if flat.exposure_time_s >= dark.exposure_time_s
            and flat.level_dn + room + _SURE * hypot(flat.error_dn, dark.error_dn) < dark.level_dn
        ]
        if names:
            more = f" and {len(names) - _LEAST} more" if len(names) > _LEAST else ""
            says = f"Darker than {dark.name}, though exposed no shorter: "
            says += f"{', '.join(names[:_LEAST])}{more}. Are frames of a dark and a flat exchanged?"
            return [says]
    return []


def _on_black(darks: Sequence[Described], flats: Sequence[Described], black_dn: float) -> list[str]:
    """Return that darks are not at the nominal black level, nor brought there by dark current."""
    if not darks or not black_dn:  # 0: not stated, as by descriptors
        return []
    dark = min(darks, key=lambda e: e.exposure_time_s)
    over = dark.level_dn - black_dn
    room = _NOISES * sqrt(max(dark.variance_dn2, 0.0)) + _CODE + _SURE * dark.error_dn
    if any(flat.level_dn + room + _SURE * flat.error_dn < dark.level_dn for flat in flats):
        return []  # a current, for a flat of less time is darker: `_darker` says which are not
    # What a current of that size would have for noise, by what light has.
    slopes = [
        (flat.variance_dn2 - dark.variance_dn2) / (flat.level_dn - dark.level_dn)
        for flat in flats
        if flat.level_dn > dark.level_dn + room
    ]
    slope = min(slopes, default=0.0)
    if -room <= over <= room or (over > 0 and dark.variance_dn2 >= _SHARE * slope * over):
        return []
    says = f"black_level is given as {black_dn:g} DN, but {dark.name} is at {dark.level_dn:.5g} DN"
    return [f"{says}: the darks are taken to be right."]


def _on_light(darks: Sequence[Described], flats: Sequence[Described], black_dn: float) -> list[str]:
    """Return that the light of one flat is not what its level asks for, by all others."""
    lit = [
        (e, e.light, e.level_dn - black)
        for e in flats
        for black in _black_of(e, darks, black_dn)
        if e.light and e.level_dn - black > _SURE * e.error_dn
    ]
    for flat, light, level in lit:
        others = [one for one in lit if one[0] is not flat]
        ratios = np.array([own / given for _, given, own in others])
        if ratios.size < _LEAST or np.ptp(ratios) > _ALIKE * np.median(ratios):
            continue
        asked = level / float(np.median(ratios))
        crossed = any(
            (given < light and _LOWER * own > level) or (given > light and own < _LOWER * level)
            for _, given, own in others
        )
        if crossed and max(asked / light, light / asked) > _OFF:
            says = f"The light of {flat.name} is given as {light:g}; by its level, and the light "
            return [f"{says}of the other flats, it is {asked:.3g}."]
    return []


def _black_of(flat: Described, darks: Sequence[Described], black_dn: float) -> list[float]:
    """Return the level without light at a flat's exposure time; none where no dark tells it."""
    if not darks:
        return [black_dn]
    alike = [dark.level_dn for dark in darks if isclose(dark.exposure_time_s, flat.exposure_time_s)]
    return [float(np.mean(alike))] if alike else []
