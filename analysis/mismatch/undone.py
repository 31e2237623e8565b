"""What rounding to codes made of levels and variances, and what it makes of a model's."""

from collections.abc import Callable, Mapping
from math import hypot, inf, isfinite, sqrt

import numpy as np
from scipy.optimize import brentq

from analysis.mismatch.basefit import CLIPPED_SHARE, BaseFit, Offsets
from analysis.mismatch.layout import Layout, Place, sites
from analysis.mismatch.model import Model
from analysis.mismatch.observe import Level
from analysis.mismatch.rounding import of_two_codes, rounded, unrounded
from dsis.camera import Camera

Codes = tuple[float, float]
"""Step between codes, and the lowest code, its phase, DN."""
WHOLE: Codes = (1.0, 0.0)
NARROW = 1 / 3  # codes^2, recorded: of half a code of noise between two codes
_COARSE = 0.45  # steps^2: of 0.6 steps, for the core of noise with tails is half as wide
_NEAR = 0.75  # codes from its mean code within which a level lies
_CHANCE = 4.0  # standard errors
_NONE, _LEAST = 1e-4, 1e-9  # codes^2 and DN: none to speak of
_STEP, _FLAT = 1e-3, 1e-2  # codes; by how much less than a level its mean code moves at least


def narrow(levels: Mapping[Place, Level], codes: Codes, *, spiky: bool) -> bool:
    """Return whether noise is so narrow beside codes that each pixel is rounded by itself.

    That of the many where recordings are `spiky`. Or so near to code 0 that each is cut off there
    by itself.
    """
    squares = (own.bulk_dn2 if spiky else own.variance_dn2 for own in levels.values())
    cut = codes == WHOLE and any(map(_clipped, levels.values()))
    return cut or any(0 < square < _narrow(codes) for square in squares)


def _narrow(codes: Codes) -> float:
    """Return below which recorded variance noise is narrow beside codes, DN^2."""
    return NARROW if codes == WHOLE else _COARSE * codes[0] ** 2


def _clipped(level: Level) -> bool:
    """Return whether the lowest code cuts samples off."""
    return level.clipped_low > CLIPPED_SHARE


def undone(
    camera: Camera,
    layout: Layout,
    levels: Mapping[Place, Level],
    codes: Codes,
    effects: Offsets,
    *,
    spiky: bool,
) -> Offsets:
    """Return what rounding, and effects before it, added to recorded levels and variances.

    Where noise is narrow rounding is undone of what is left without the effects. Two codes say
    nothing of the noise: where they hide it, or rounding cannot be undone, the level is that of
    which the camera's own noise makes the mean code. Beside coarser steps nothing is said of that:
    the camera's numbers may be those from before the steps were known.

    Parameters
    ----------
    camera
        What it says of noise and of the black level holds where codes hide both.
    layout, levels
        What was observed.
    codes
        Of the camera.
    effects
        What the camera's effects add to levels and variances.
    spiky
        Whether variances of the many are fitted.
    """
    shift, added, stretch, bulk, wider = {}, {}, {}, {}, {}
    darks = {e.name for e in layout.uniform if e.kind == "dark"}
    whole, white = codes == WHOLE, layout.white_dn
    scatter = sqrt(len(layout.channels) / (layout.rows * layout.columns)) / 2
    of_many = effects.bulk_dn2 if spiky else effects.variance_dn2
    for place, level in levels.items():
        bent, more = effects.level_dn.get(place, 0.0), of_many.get(place, 0.0)
        mean = level.level_dn + layout.black_dn
        square = level.bulk_dn2 if spiky else level.variance_dn2
        # Rounding is no sum: narrow noise that is wider by an effect is rounded, or cut, as that.
        alone = square - more < _narrow(codes) or (whole and _clipped(level))
        first = (bent, more) if alone else (0.0, 0.0)
        own = mean - first[0], max(square - first[1], 0.0)
        before, variance, stretch[place], wider[place] = unrounded(*own, white, *codes)
        if whole and (not isfinite(stretch[place]) or of_two_codes(before, variance, white)):
            stretch[place] = inf
            given = camera.black_level if place[0] in darks else None
            # What effects add is the mean of pixels, each of which is on one code or the next.
            error = hypot(level.level_error_dn, scatter if bent else 0.0)
            before, wider[place] = _placed(camera, own[0], error, white, given)
        shift[place] = mean - before - first[0] + bent
        made = square - variance - first[1] + more
        if spiky:
            bulk[place] = made
            plain = unrounded(mean, level.variance_dn2, white, *codes)[1]
            made = level.variance_dn2 - plain + effects.variance_dn2.get(place, 0.0)
        added[place] = made
    return Offsets(shift, added, stretch, bulk, wider)


def _placed(
    camera: Camera,
    code_dn: float,
    error_dn: float,
    white_dn: float,
    given_dn: float | None,
) -> tuple[float, float]:
    """Return the level whose mean code is known, and by how much its error grows.

    By the camera's own noise, as well as that is known. The level of a dark is as `given`, if its
    mean code is as recorded; what it is off by is no light.
    """
    noise, dark = camera.segments, given_dn is not None

    def variance(level: float) -> float:
        signal = np.array([0.0 if dark else max(level - camera.black_level, 0.0)], np.float32)
        return float(noise.variance_dn2(signal)[0])

    def off(level: float, more_dn2: float = 0.0) -> float:
        square = max(variance(level) + more_dn2, 0.0)
        return level + rounded(level, square, white_dn)[0] - code_dn

    if given_dn is not None and abs(off(given_dn)) <= _CHANCE * error_dn:
        return given_dn, inf
    low, high = code_dn - _NEAR, code_dn + _NEAR
    plain = variance(code_dn)
    if plain <= _NONE or not off(low) < 0 < off(high):  # no noise, or cut off
        return code_dn, inf
    found = float(brentq(off, low, high))
    slope = (off(found + _STEP) - off(found - _STEP)) / (2 * _STEP)
    if slope <= _FLAT:
        return found, inf
    unsure = camera.noise.segment[0].intercept_se or 0.0
    moved = abs(off(found, min(unsure, plain / 2)))
    return found, max(hypot(1.0, moved / max(error_dn, _LEAST)) / slope, 1.0)


def rounding(model: Model, layout: Layout, fit: BaseFit, codes: Codes, *, spiky: bool) -> Offsets:
    """Return what rounding and clipping add under a model, exactly."""
    level, variance = {}, {}
    for e in layout.uniform:
        for channel, (y, x) in sites(layout.cfa).items():
            signal = float(model.signals[e.name][y, x])
            line = float(fit.line_dn2(np.array([signal]))[0])
            mean = layout.black_dn + fit.black_dn[channel] + signal
            level[e.name, channel], variance[e.name, channel] = rounded(
                mean, line, layout.white_dn, *codes
            )
    return Offsets(level, variance, bulk_dn2=variance if spiky else {})


def together(first: Offsets, second: Offsets) -> Offsets:
    """Return what both add, with the errors of the first."""
    return _of_both(first, second, lambda value, more: value + (more or 0.0))


def halfway(first: Offsets, second: Offsets) -> Offsets:
    """Return what lies halfway between what two models add, with the errors of the first."""
    return _of_both(
        first, second, lambda value, other: value if other is None else (value + other) / 2
    )


def _of_both(
    first: Offsets, second: Offsets, of: Callable[[float, float | None], float]
) -> Offsets:
    """Return what a function makes of both at each place of the first; None: it is not there."""

    def made(a: Mapping[Place, float], b: Mapping[Place, float]) -> dict[Place, float]:
        return {place: of(value, b.get(place)) for place, value in a.items()}

    return Offsets(
        made(first.level_dn, second.level_dn),
        made(first.variance_dn2, second.variance_dn2),
        first.stretch,
        made(first.bulk_dn2, second.bulk_dn2),
        first.wider,
    )
