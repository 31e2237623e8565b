"""Surfaces and lines that a decay from an edge feigns: the read-out has not settled there."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from analysis.mismatch.bank.edges import LEAST_LINES, decays, line_square, line_square_beside
from analysis.mismatch.bank.robust import EFFICIENCY
from analysis.mismatch.bank.seams import SMOOTH_DEGREE, Rest, beyond_smooth, centred
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.locate import FAMILY
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.line_settling import LineSettling

Array = NDArray[np.float64]
STATISTIC = "fixed_edge"
# Where each kind is seen; of two maps of a gain the one that knows of no other.
_MAPS = {"shading": ("gain",), "tap_mismatch": ("gain",), "amp_glow": ("time", "gain")}
_MOST = 0.5  # of what the surfaces explain, that decays may feign
_NEARLY_ALL = 0.8  # of what surfaces and decays explain together
_SURE, _SEEN = 2.0, 3.0  # standard errors


def edged(state: State, kind: str) -> Denial | None:
    """Return how uneven light, halves or a glow are denied by a decay from an edge; None: not.

    The few bright lines of an edge lean and bend the whole map, and part its halves. Where a decay
    is left unexplained, and tilts, bows and halves beside decays explain not half of what they
    explain alone, there may be none; there are where they alone explain nearly all of what both do,
    and decays from one end do not: long decays from both make a bow. Along an axis where all maps
    together show no decay beyond the first and the last line only these may differ.
    """
    if kind not in _MAPS or all(m.statistic != STATISTIC for m in state.mismatches):
        return None
    alone, beside, both, one_end = 0.0, 0.0, 0.0, 0.0
    for axis in (0, 1):
        maps = list(_means(state, kind, axis))
        decaying = _decaying(maps)
        for means in maps:
            smooth, ends, decay = _designs(means.size)
            level = np.ones((means.size, 1))
            edge = np.hstack([level, ends, *([decay] if decaying else [])])
            flat, rest = _left(means, level), _left(means, np.hstack([edge, smooth]))
            alone += flat - _left(means, np.hstack([level, smooth]))
            beside += _left(means, edge) - rest
            both += flat - rest
            sides = np.split(decay, 2, axis=1)
            one_end += min(_left(means, np.hstack([level, own])) for own in sides) - rest
    bowed = alone >= _NEARLY_ALL * both and one_end >= _MOST * alone
    if not alone > 0 or beside >= _MOST * alone or bowed:
        return None
    return Denial(beside / alone, "lines that decay from an edge make most of what it explains")


def _means(state: State, kind: str, axis: int) -> Iterator[Array]:
    """Yield means of lines of each map where a kind is seen, in the noise of its pixels."""
    images = state.setting.seen.images
    for (channel, name), (image, noise) in images.items():
        if name in {one if (channel, f"{one} alone") not in images else f"{one} alone"
                    for one in _MAPS[kind]}:  # fmt: skip
            yield image.mean(1 - axis) / noise * image.shape[1 - axis] ** 0.5


def _decaying(maps: Sequence[Array]) -> bool:
    """Return whether lines beyond the first and the last show decays beside surfaces and halves.

    What makes only these two differ, as charge that has a neighbour on one side only, is no decay.
    Asked are all maps together, in units of what lines scatter by, which is known by medians.
    """
    shown, freedom, spare = 0.0, 0, 0.0
    for means in maps:
        if means.size < LEAST_LINES:
            continue
        smooth, ends, decay = _designs(means.size)
        less = np.hstack([np.ones((means.size, 1)), smooth, ends])
        square = line_square(beyond_smooth(means), 1.0, 1)
        shown += (_left(means, less) - _left(means, np.hstack([less, decay]))) / square
        freedom += decay.shape[1]
        spare += EFFICIENCY * (means.size - less.shape[1])
    return freedom > 0 and bool(shown / freedom > f.isf(FAMILY, freedom, spare))


def single(state: State, effect: Effect) -> Denial | None:
    """Return how a decay is denied by lines beyond the first; None: they show it.

    One line that differs, at the edge, is no decay, however short. Where a smooth surface or a step
    between halves is left unexplained, which lean towards the edges too, only what no such surface
    has speaks for a decay; beside a step, which may be all there is, it must be seen.
    """
    if not isinstance(effect, LineSettling):
        return None
    rests: list[Rest] = [beyond_smooth]
    why = "beyond the line at the edge nothing is seen of the decay"
    if any(_of_surface(m.statistic) for m in state.mismatches):
        rests = [_beyond_halves]
        why = "surfaces or halves are left, and beside them nothing is seen of the decay"
    elif all(own.kind != "shading" for own in state.camera.effect):
        rests.append(centred)  # of few lines the smooth part of a decay is most of it
    step = any(m.statistic == "half_seam" for m in state.mismatches)
    shares = [_shown(state, effect, rest, seen=step) for rest in rests]
    if any(share is None for share in shares):
        return None
    # A long decay is nearly smooth: fewer numbers make it.
    if _beyond_halves not in rests and outlined(state, effect, beyond=True):
        return None
    return Denial(max(share for share in shares if share is not None), why)


def outlined(state: State, effect: Effect, *, beyond: bool = False) -> bool:
    """Return whether means of lines tell a decay, of gain or else offset, from any smooth surface.

    `beyond`: without the outermost line of each colour, which may differ for other reasons.

    A decay over a tenth of the lines and more is nearly a polynomial of the fourth degree: of what
    is beyond that little is left to see. But it takes two numbers, the polynomial four. The
    likelihoods of both, less half of the logarithm of the lines' number for each number (Schwarz,
    1978), decide, at odds of 20: against nothing, and surfaces of each degree along the axis.
    """
    if not isinstance(effect, LineSettling):
        return False
    layout, images = state.setting.layout, state.setting.seen.images
    gain = bool(effect.gain_percent)
    seen, length = ("gain", effect.gain_length) if gain else ("offset", effect.length_pixels)
    axis = int(effect.edge in ("left", "right"))
    size = (layout.rows, layout.columns)[axis]
    parts: list[tuple[Array, Array]] = []  # means, and surfaces of each degree and the decay
    for (channel, name), (image, noise) in images.items():
        if name != seen:
            continue
        distance = layout.from_edge(channel, effect.edge)
        place = 2 * distance / (size - 1) - 1
        smooth = np.polynomial.legendre.legvander(place, SMOOTH_DEGREE)[:, 1:]
        shapes = np.column_stack([smooth, np.exp(-distance / length)])
        means = image.mean(1 - axis)
        if beyond:
            inner = distance >= 1 + (channel != "MONO")
            means, shapes = means[inner], shapes[inner]
        scale = layout.regressors(channel).scales["gain"] if gain else 1.0
        # Lines scatter beyond the noise of their pixels, in what neither explains. All channels
        # have one surface and one decay, and each its own mean.
        error = line_square(beyond_smooth(means), noise, image.shape[1 - axis]) ** 0.5
        parts.append(((means - means.mean()) / error, (shapes - shapes.mean(0)) * scale / error))
    if not parts:
        return False
    values, design = (np.concatenate(own) for own in zip(*parts, strict=True))
    degrees = range(SMOOTH_DEGREE + 1)
    left = np.array([_left(values, design[:, :k]) for k in degrees])
    told = (left - _left(values, design[:, -1:])) / 2 + np.log(len(values)) * np.array(degrees) / 2
    told -= np.log(len(values))  # of the decay's size and length
    return bool(told.min() > TOLD_APART)


def settles(state: State, effect: LineSettling) -> bool:
    """Return whether a decay has no gain, or an offset that is surely one: at odds of 20.

    Of its size and length, less half of the logarithm of the lines' number for each (Schwarz 1978).
    """
    if not (effect.gain_percent and effect.offset_dn):
        return not effect.gain_percent
    layout, images = state.setting.layout, state.setting.seen.images
    axis = int(effect.edge in ("left", "right"))
    square = 0.0
    for (channel, name), (image, noise) in images.items():
        if name == "offset":
            shape = np.exp(-layout.from_edge(channel, effect.edge) / effect.length_pixels)
            means = image.mean(1 - axis)
            error = line_square(beyond_smooth(means), noise, image.shape[1 - axis])
            square += effect.offset_dn**2 * float(((shape - shape.mean()) ** 2).sum()) / error
    lines = (layout.rows, layout.columns)[axis]
    return bool(square / 2 - np.log(lines) > TOLD_APART)


def _of_surface(statistic: str) -> bool:
    """Return whether a statistic tells of smooth surfaces, or of halves."""
    return statistic == "half_seam" or statistic.startswith("fixed_smooth")


def _beyond_halves(values: Array) -> Array:
    """Return means of lines (line,) less smooth polynomials and the step between halves.

    Of an odd number the step may be on either side of the middle line: one at an edge is left out.
    """
    line = np.arange(len(values))
    places = {len(values) // 2, (len(values) + 1) // 2}
    steps = beyond_smooth(np.stack([np.where(line < k, -0.5, 0.5) for k in sorted(places)], 1))
    rest = beyond_smooth(values)
    return np.asarray(rest - steps @ np.linalg.lstsq(steps, rest, rcond=None)[0])


def _shown(state: State, effect: LineSettling, rest: Rest, *, seen: bool) -> float | None:
    """Return the share of a decay that lines beyond the first show; None: enough of it.

    It may be as much as errors allow, unless it must be `seen`.
    """
    layout, images = state.setting.layout, state.setting.seen.images
    axis = int(effect.edge in ("left", "right"))
    top = bottom = 0.0
    for (channel, name), (image, noise) in images.items():
        amplitude, length = {
            "offset": (effect.offset_dn, effect.length_pixels),
            "gain": (effect.gain_percent / 100, effect.gain_length),
        }.get(name, (0.0, 1.0))
        if not amplitude:
            continue
        scale = layout.regressors(channel).scales[name] if name == "gain" else 1.0
        distance = layout.from_edge(channel, effect.edge)
        beyond = distance >= 1 + (channel != "MONO")
        means = rest(image.mean(1 - axis)[beyond])
        shape = rest(np.exp(-distance[beyond] / length))
        square = line_square_beside(means, shape, noise, image.shape[1 - axis])
        top += amplitude * scale * float(shape @ means) / square
        bottom += (amplitude * scale) ** 2 * float(shape @ shape) / square
    if seen and top <= _SURE * bottom**0.5:
        return max(top / bottom, 0.0) if bottom > 0 else 0.0
    if bottom > 0 and (top + _SURE * bottom**0.5) / bottom >= _MOST and bottom > _SEEN**2:
        return None
    return max(top / bottom, 0.0) if bottom > 0 else 0.0


def _designs(size: int) -> tuple[Array, Array, Array]:
    """Return tilt, bow and halves, the lines at the ends, and decays from these: (line, shape)."""
    line = np.linspace(-1, 1, size)
    smooth = np.stack([line, line**2, np.where(line < 0, -1.0, 1.0)], 1)
    return smooth, np.eye(size)[:, [0, -1]], decays(size).T


def _left(values: Array, design: Array) -> float:
    """Return the square sum of what a design leaves of values."""
    rest = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    return float(rest @ rest)
