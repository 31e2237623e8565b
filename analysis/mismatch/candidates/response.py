"""What bends the mean level: non-linearity, saturation, paths that disagree."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import fmin
from scipy.stats import norm

from analysis.mismatch.candidates.candidate import Candidate, Proposal, measured, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Place
from dsis.effects.nonlinearity import bend_peak, bend_shape

_UNTOLD_PERCENT = 1.0  # start where levels do not tell
_LEAST_LEVELS = 3  # two of them are told by the light's scale and a parabola
_EXPONENTS = np.geomspace(0.2, 16.0, 20) - 1  # of a bend: from a power law to a knee
_LEAST_FLATS = 2  # on each side of a switch
_SOFTNESS = np.geomspace(0.2, 8.0, 9)  # standard deviations of noise: a harder limit is hard
_HARD, _TOLD_APART = 0.02, 3.0  # of noise: as good as hard; of log-likelihood: odds of 20
_BEYOND = np.linspace(-1.0, 6.0, 22)
_LEFT = 0.05  # of shot noise, at a full well that is far below the light
_BELOW = np.linspace(1.0, 8.0, 71)  # standard deviations of a full well below the light
_DIFFERENT = 5.0  # standard errors by which pixels' levels differ
_SPREADS, _MOST_SPREAD = (0.05, 10.0), 20.0  # of full wells, per cent
_FARTHER = np.array([1.0, 1.2, 1.4, 1.7, 2.2])  # times what levels show, where not all are full
_FIXED, _OF_FIXED = "fixed_pixel_variance", 3
_ROUNDING = 1 / 12  # of variance, DN^2
_NU = 6.0  # of Student's t law, by which numbers depart
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(41)
_WEIGHTS = _WEIGHTS / _WEIGHTS.sum()
_FEW_NODES, _FEW_WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
_FEW_WEIGHTS = _FEW_WEIGHTS / _FEW_WEIGHTS.sum()
Array = NDArray[np.float64]


def _nonlinearity(clues: Clues) -> Sequence[Proposal]:
    """Solve level residual = c u (1 - u^k) / k beside the light's scale, u = S / (0.85 F).

    Once with k = 1 and, where levels are enough, once with the k that fits best. Where light is
    unknown only variances bend: they say how much, or it is tried both ways.
    """
    end = 0.85 * (clues.layout.white_dn - clues.layout.black_dn)
    rows = [
        (clues.signal(place), value, sd)
        for place, (value, sd) in clues.excess("level").items()
        if clues.signal(place) > 0
    ]
    signals = len({round(s, 1) for s, _, _ in rows})
    if signals < _LEAST_LEVELS:
        told = _by_variances(clues, end)
        return _bends(told) if told else _bends(_UNTOLD_PERCENT) + _bends(-_UNTOLD_PERCENT)
    u, value, sd = np.array(rows).T
    u, value = u / end, value / sd
    fits = []
    for exponent in (1.0, *_EXPONENTS.tolist()):
        shape = bend_shape(u, exponent) / bend_peak(exponent)
        design = np.stack([shape, u], 1) / sd[:, None]
        found = np.linalg.lstsq(design, value, rcond=None)[0]
        misfit = float(((value - design @ found) ** 2).sum())
        fits.append((misfit, exponent, 85 / end * float(found[0])))
    parabola = _bends(float(np.clip(fits[0][2], -12, 12)))
    if signals == _LEAST_LEVELS:
        return parabola
    _, exponent, percent = min(fits[1:])
    names = ["percent_full_scale", "exponent"]
    start = dict(zip(names, (float(np.clip(percent, -12, 12)), exponent), strict=True))
    return parabola + proposals("nonlinearity", names, names, **start)


def _by_variances(clues: Clues, end: float) -> float:
    """Return the bend by which variances depart from their line, per cent; 0: they do not say.

    Of shot noise m Q and a response Q + c b(Q) the signal S has a variance that is larger by
    c m (2 S b'(S) - b(S)), beside a line of its own.
    """
    rows = [
        (clues.signal(place), value, sd)
        for place, (value, sd) in clues.excess("pixel_variance").items()
        if np.isfinite(sd)
    ]
    if len({round(s, 1) for s, _, _ in rows}) <= _LEAST_LEVELS:
        return 0.0
    signal, value, sd = np.array(rows).T
    unit = end / 85 / bend_peak(1.0)
    u, step = signal / end, 1e-3
    bend = unit * bend_shape(u, 1.0)
    slope = unit * (bend_shape(u + step, 1.0) - bend_shape(u - step, 1.0)) / (2 * step * end)
    variance = np.asarray(clues.fit.line_dn2(signal))
    dark, one = (float(v) for v in clues.fit.line_dn2(np.array([0.0, 1.0])))
    shape = (one - dark) * (2 * signal * slope - bend)
    design = np.stack([shape, signal, np.ones_like(signal)], 1) / (variance * sd)[:, np.newaxis]
    percent = float(np.linalg.lstsq(design, value / sd, rcond=None)[0][0])
    error = float(np.linalg.pinv(design.T @ design)[0, 0]) ** 0.5
    return float(np.clip(percent, -12, 12)) if abs(percent) > 2 * error > 0 else 0.0


def _bends(percent: float) -> list[Proposal]:
    name = "percent_full_scale"
    return proposals("nonlinearity", [name], [name], percent_full_scale=percent)


def _saturation(clues: Clues) -> Sequence[Proposal]:
    """Propose a full well, and how far pixels' own differ where fixed patterns show that."""
    found = _limits(clues)
    top = max(clues.places, key=clues.signal)
    apart, error = clues.excess(_FIXED).get(top, (0.0, np.inf))
    less, of_less = clues.excess("pixel_variance").get(top, (0.0, np.inf))
    if not clues.signal(top) > 0 or not np.isfinite(error) or apart < _DIFFERENT * error:
        return found
    # Gains that differ leave all of the noise; where light is far above it nothing foretells it.
    if less > -_DIFFERENT * of_less and not _full(clues, top):
        return found
    spread = float(np.clip(100 * apart**0.5 / clues.signal(top), *_SPREADS))
    hard = [one for one in found if "softness_dn" not in one.free]
    lights = {e.name: e.light for e in clues.layout.exposures}
    soft = [] if lights[top[0]] is None else _soft_limits(clues, top, spread=spread)
    return [*found, *(_differing(one, spread) for one in hard), *soft]


def _differing(one: Proposal, spread: float) -> Proposal:
    """Return a hard limit as a start for one that differs from pixel to pixel: all is fitted."""
    full, names = float(dict(one.effect)["full_well_dn"]), ["full_well_dn", "spread_percent"]
    (made,) = proposals("saturation", names, full_well_dn=full, spread_percent=spread)
    return made


def _limits(clues: Clues) -> Sequence[Proposal]:
    """Start where the skewness of the brightest level puts the full well, and around it."""
    top = max(clues.places, key=clues.signal)
    level = clues.signal(top)
    sd = clues.seen.levels[top].variance_dn2 ** 0.5
    skewness, error = clues.excess("skewness").get(top, (0.0, np.inf))
    beyond = np.linspace(-1, 4, 51)
    expected = np.array([skewness_below(z) for z in beyond])
    nearest = beyond[np.abs(expected - min(skewness, 0.0)).argmin()]
    if not np.isfinite(error):
        nearest = 1.5
    told = _full(clues, top)
    if told:
        lights = {e.name: e.light for e in clues.layout.exposures}
        hard = float(told[0].effect.model_dump()["full_well_dn"])
        return told if lights[top[0]] is None else [*told, *_soft_limits(clues, top, hard)]
    found: list[Proposal] = []
    for z in (nearest, nearest + 0.5, nearest - 0.5, 0.3):
        found += proposals("saturation", ["full_well_dn"], full_well_dn=level + float(z) * sd)
    found += proposals("saturation", ["full_well_dn"], full_well_dn=0.99 * level)
    return [*found, *_soft_limits(clues, top)]


def _full(clues: Clues, top: Place) -> list[Proposal]:
    """Return the full well that the brightest flat has reached: its level is that.

    By the share of shot noise that is left, which says how far below the light the limit lies, and
    by that how far the mean is from it (a censored normal law). Nothing where much is left.
    """
    level, own = clues.signal(top), clues.seen.levels[top]
    dark, bright = (float(v) for v in clues.fit.line_dn2(np.array([0.0, level])))
    if bright <= dark:
        return []
    share = max(own.variance_dn2 - 1 / 12 - dark, 0.0) / (bright - dark)
    if share > _LEFT:
        return []
    limit = -_BELOW
    left = norm.pdf(limit) + limit * norm.cdf(limit)  # of the mean, below the limit
    square = (1 + limit**2) * norm.cdf(limit) + limit * norm.pdf(limit) - left**2
    missing = float(np.interp(share, square[::-1], left[::-1])) * (bright - dark) ** 0.5
    made = proposals("saturation", ["full_well_dn"], full_well_dn=level + missing)
    error = float(np.hypot(own.level_error_dn, missing))
    return [measured(one, {"full_well_dn": level + missing}, {"full_well_dn": error})
            for one in made]  # fmt: skip


def _soft_limits(
    clues: Clues, top: Place, hard: float | None = None, spread: float = 0.0
) -> list[Proposal]:
    """Start where levels, variances and skewness put a soft limit, by a grid of well and softness.

    What the limit makes of normal noise is found by Gauss-Hermite quadrature; beside it the scale
    of the light and the slope of the variances are free, which were fitted without it. Nothing
    where a limit at `hard`, DN, is as likely as the best, at odds of 20. Where pixels' levels
    differ by what full wells do that are `spread` apart, per cent, or more, that is in the grid.
    """
    measured = ("level", "pixel_variance", "skewness", *([_FIXED] if spread else []))
    off = {name: clues.excess(name) for name in measured}
    rows = [
        (place, number, *(_logarithm(value, error) if number == _OF_FIXED else (value, error)))
        for number, own in enumerate(off.values())
        for place, (value, error) in own.items()
        if clues.signal(place) > 0 and np.isfinite(error)
        if number < _OF_FIXED or value > _DIFFERENT * error
    ]
    if not rows:
        return []
    bent = off["level"]
    signal = np.array([clues.signal(at) - bent.get(at, (0.0, 0.0))[0] for at, *_ in rows])
    line = clues.fit.line_dn2(signal)
    # Read noise comes after a full well; of light that is hardly there a line has none.
    after = max(float(clues.fit.line_dn2(np.zeros(1))[0]), 0.0)
    sd = np.sqrt(np.maximum(line - after, _ROUNDING))
    number, value, error = np.array([row[1:] for row in rows]).T
    free = np.stack([np.where(number == 0, signal / signal.max(), 0.0), number == 1], 1)
    free = free / error[:, np.newaxis]
    level, unit = clues.signal(top), _noise_dn(clues, top)

    def misfit(full: float, softness: float, apart: float) -> float:
        if apart:
            made = moments_of_many(signal, sd, full, softness, apart, after)
        else:
            made = soft_moments(signal, sd, full, softness, after)
        own = (value - np.choose(number.astype(int), made)) / error
        rest = own - free @ np.linalg.lstsq(free, own, rcond=None)[0]
        return (_NU + 1) / 2 * float(np.log1p(rest**2 / _NU).sum())

    def least(some: Array) -> tuple[float, tuple[float, float, float]]:
        tried = (
            (float(full), float(softness), float(apart))
            for softness in some
            for full in level + np.sqrt(unit * max(softness, unit)) * _BEYOND
            for apart in (np.minimum(spread * _FARTHER, _MOST_SPREAD) if spread else (0.0,))
        )
        own = min((misfit(*one), one) for one in tried)
        return _nearer(misfit, own, unit, fixed=some.size == 1)

    best, found = least(unit * _SOFTNESS)
    as_hard = np.inf
    if spread:
        as_hard, _ = least(unit * np.array([_HARD]))
    elif hard is not None:
        as_hard = misfit(hard, unit * _HARD, 0.0)
    if as_hard < best + _TOLD_APART:
        return []
    full, softness, apart = found
    names = ["full_well_dn", "softness_dn"]
    own = {"full_well_dn": full, "softness_dn": softness}
    if not spread:
        return proposals("saturation", names, (), **own)
    return proposals("saturation", [*names, "spread_percent"], (), **own, spread_percent=apart)


def _nearer(
    misfit: Callable[[float, float, float], float],
    start: tuple[float, tuple[float, float, float]],
    unit: float,
    *,
    fixed: bool,
) -> tuple[float, tuple[float, float, float]]:
    """Return the least misfit near one of a grid, and where: between two of it none may fit.

    `fixed`: the softness stays.
    """
    full, softness, apart = start[1]

    def there(moved: Array) -> tuple[float, float, float]:
        soft = softness if fixed else softness * float(np.exp(np.clip(moved[1], -1, 1)))
        far = min(apart * float(np.exp(np.clip(moved[-1], -1, 1))), _MOST_SPREAD)
        return max(full + float(moved[0]) * unit, unit), soft, far

    count = 1 + (not fixed) + (apart > 0)
    simplex = np.vstack([np.zeros(count), 0.1 * np.eye(count)])

    def missed(moved: Array) -> float:
        return misfit(*there(moved))

    made = fmin(
        missed,
        np.zeros(count),
        initial_simplex=simplex,
        maxfun=150 * count,
        xtol=1e-3,
        ftol=1e-2,
        disp=False,
    )
    nearest = there(np.asarray(made))
    return min(start, (misfit(*nearest), nearest))


def _noise_dn(clues: Clues, top: Place) -> float:
    """Return the noise of the brightest level; where a full well left none, that of its light."""
    own = clues.seen.levels[top].variance_dn2
    if _full(clues, top):
        own = max(own, float(clues.fit.line_dn2(np.array([clues.signal(top)]))[0]))
    return float(own**0.5)


def _logarithm(value: float, error: float) -> tuple[float, float]:
    return float(np.log(value)), error / value


def soft_moments(
    signal: Array, sd: Array, full: float, softness: float, after_dn2: float = 0.0
) -> list[Array]:
    """Return what a soft limit makes of normal noise: change of mean, log variance, skewness.

    `signal` and `sd` (place,) are those without it, DN; the limit is that of `Saturation`. Noise of
    variance `after_dn2` comes after it.
    """
    q = signal[:, np.newaxis] + sd[:, np.newaxis] * _NODES
    made = full - softness * np.logaddexp(0, (full - q) / softness) - signal[:, np.newaxis]
    mean = made @ _WEIGHTS
    away = made - mean[:, np.newaxis]
    variance = np.maximum(away**2 @ _WEIGHTS + after_dn2, 1e-12)
    third = away**3 @ _WEIGHTS
    return [mean, np.log(variance / (sd**2 + after_dn2)), third / variance**1.5]


def moments_of_many(
    signal: Array,
    sd: Array,
    full: float,
    softness: float,
    spread: float,
    after_dn2: float = 0.0,
) -> list[Array]:
    """Return means over pixels whose limits differ by `spread`, per cent; see `soft_moments`.

    The last is the logarithm of the variance of their levels, DN^2.
    """
    wells = full * (1 + spread / 100 * _FEW_NODES)
    each = np.stack([soft_moments(signal, sd, float(own), softness, after_dn2) for own in wells])
    levels, logs, skewness = each.transpose(1, 2, 0)
    variance = np.exp(logs)
    third = (skewness * variance**1.5) @ _FEW_WEIGHTS
    mean, total = levels @ _FEW_WEIGHTS, variance @ _FEW_WEIGHTS
    apart = (levels - mean[:, np.newaxis]) ** 2 @ _FEW_WEIGHTS
    return [mean, np.log(total), third / total**1.5, np.log(np.maximum(apart, 1e-12))]


def skewness_below(limit: float) -> float:
    """Return the skewness of a standard normal variate that is cut at a limit."""
    density, below = norm.pdf(limit), norm.cdf(limit)
    first = -density + limit * (1 - below)
    second = below - limit * density + limit**2 * (1 - below)
    third = -(limit**2 + 2) * density + limit**3 * (1 - below)
    variance = second - first**2
    return float((third - 3 * first * second + 2 * first**3) / variance**1.5)


def _gain_mismatch(clues: Clues) -> Sequence[Proposal]:
    """Start from what the gain does at the switch: the mean steps or kinks.

    A side of one flat only has no step. Three flats above lie on a line that crosses that of one
    below, and of black, at the switch: they have a kink.
    """
    ends = [s.upper_dn for s in clues.camera.noise.segment if s.upper_dn is not None]
    flats = {e.name for e in clues.layout.exposures if e.kind == "flat"}
    rows = [
        (clues.signal(place), value, sd, place[0])
        for place, (value, sd) in clues.excess("level").items()
        if clues.signal(place) > 0 and place[0] in flats
    ]
    if not (ends and rows):
        return []
    signal, value, sd = (np.array(part) for part in list(zip(*rows, strict=True))[:3])
    above = signal >= ends[0]
    names = np.array([name for *_, name in rows])
    upper, lower = (len(set(names[side].tolist())) for side in (above, ~above))
    steps = min(upper, lower) >= _LEAST_FLATS
    if not (steps or (upper > _LEAST_FLATS and lower)):
        return []
    name = "gain_error_percent"
    bent = np.stack([np.where(above, signal - ends[0], 0.0), signal], 1) / sd[:, None]
    kink = 100 * float(np.linalg.lstsq(bent, value / sd, rcond=None)[0][0])
    kinked = float(np.clip(kink, -20, 20)) or 0.1
    found = proposals("dual_gain_mismatch", [name], [name], gain_error_percent=kinked, mean="kinks")
    if steps:
        ratio = value / signal
        step = 100 * float(np.median(ratio[above]) - np.median(ratio[~above]))
        own = proposals("dual_gain_mismatch", [name], [name], gain_error_percent=step or 0.1)
        found = [*own, *found]
    return found


CANDIDATES = (
    Candidate("nonlinearity", ("level", "pixel_variance", "skewness"), _nonlinearity),
    Candidate("saturation", ("level", "pixel_variance", "skewness", "kurtosis"), _saturation),
    Candidate("dual_gain_mismatch", ("level", "pixel_variance"), _gain_mismatch),
)
