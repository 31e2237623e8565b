"""What mean frames show: fixed patterns, shading, taps, glow."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from analysis.mismatch.bank.seams import WHOLE
from analysis.mismatch.bank.surfaces import RING
from analysis.mismatch.bank.together import TOGETHER
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.candidates.parts import unequal_parts
from analysis.mismatch.clues import Clues, alike
from analysis.mismatch.gainmap import mean_frame
from analysis.mismatch.layout import Layout, Place
from dsis.effects import Effect
from dsis.effects.amp_glow import AmpGlow
from dsis.effects.shading import Shading
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
FALL_SIZE = "falloff_percent"
_TILTS = ("tilt_down_percent", "tilt_right_percent")
_BOWS = ("bow_down_percent", "bow_right_percent")
RING_SIZE = "ring_percent"
_ROUND, _RINGED, _BOWED = (FALL_SIZE, *_TILTS), (FALL_SIZE, *_TILTS, RING_SIZE), (*_TILTS, *_BOWS)
SURFACES = frozenset({*_RINGED, *_BOWED})
_BOWS_DEGREE = 2
_MOST, _MOST_RING = 90.0, 390.0  # per cent
_CLEAR = 3.0  # standard errors from which a tilt is worth a trial
_JUMP = 0.15  # z of the step where halves meet, of that of their means: some 0.4 of two amplifiers
_UNEVEN = ("shading", "line_settling", "tap_mismatch")
_LIGHT_DN = 1000.0  # at which they are looked at: all are in proportion
PLACES = (
    "top_left", "top_right", "bottom_left", "bottom_right", "top", "bottom", "left", "right"
)  # fmt: skip
EXTENTS = (0.05, 0.1, 0.2, 0.35, 0.6)  # of the sensor's longer side, to start from
_WIDEST_GLOW = 1.0  # of it: what falls off by less is as good as the same everywhere
_OF_EXTENT = 0.01  # of its logarithm
_SMOOTH = ("fixed_smooth_variance", "fixed_smooth_tilt", "fixed_smooth_falloff", RING)


def _constant(kind: str, statistic: str) -> Candidate:
    def propose(clues: Clues) -> Sequence[Proposal]:
        variance, _ = clues.amplitude(statistic, alike)
        return proposals(kind, ["sigma_dn"], sigma_dn=sqrt(variance)) if variance > 0 else []

    return Candidate(kind, (statistic,), propose)


def _squared(clues: Clues) -> Callable[[Place], float]:
    """Return by what variances of gains grow: pixels that are full show none."""
    return lambda place: 0.0 if place in clues.layout.full else clues.signal(place) ** 2


def _gains(kind: str, statistic: str) -> Candidate:
    def propose(clues: Clues) -> Sequence[Proposal]:
        variance, _ = clues.amplitude(statistic, _squared(clues))
        if variance <= 0:
            return []
        return proposals(kind, ["sigma_percent"], sigma_percent=min(100 * sqrt(variance), 90.0))

    return Candidate(kind, (statistic,), propose)


def _shading(clues: Clues) -> Sequence[Proposal]:
    """Start from the surface that fits the gain: a fall to the corners, tilts, bows.

    Between centre and corner the fall has a shape of its own where all channels together tell it.
    """
    if not clues.image("gain"):
        return _of_strength(clues)
    round_, clear = _fitted(clues, _ROUND)
    leaning = [name for name in _TILTS if name in clear]
    found: list[Proposal] = []
    for names in ([FALL_SIZE], leaning, [FALL_SIZE, *leaning] if leaning else []):
        found += _of_light(round_, names)
    ringed, clear = _fitted(clues, _RINGED)
    if RING_SIZE in clear:
        found += _of_light(ringed, [FALL_SIZE, *leaning, RING_SIZE])
    bowed, clear = _fitted(clues, _BOWED)
    if any(name in clear and bowed[name] > 0 for name in _BOWS):  # no fall rises to the ends
        found += _of_light(bowed, [name for name in _BOWED if name in clear])
    return found


def of_any_shape(proposal: Proposal) -> Proposal:
    """Return a fall of light whose shape between centre and corner is fitted as well.

    Where it is not clear, how far the light falls in the corners is the less known for it.
    """
    if FALL_SIZE not in proposal.free or RING_SIZE in proposal.free:
        return proposal
    return replace(
        proposal, free=(*proposal.free, RING_SIZE), signed=frozenset({*proposal.signed, RING_SIZE})
    )


def _fitted(clues: Clues, names: Sequence[str]) -> tuple[dict[str, float], set[str]]:
    """Return what the gain has of each surface, per cent, and which are clear.

    A ring is one of many smooth surfaces: it is clear beside what else they have.
    """
    values, errors = np.zeros(len(names)), np.zeros(len(names))
    images = clues.image("gain")
    for channel, (image, noise) in images.items():
        shapes = surfaces(image.shape, names)
        inverse = np.linalg.inv(shapes @ shapes.T)
        scale = 100 / clues.scale("gain", channel) / len(images)
        rest = scale * (image - image.mean()).ravel() - had(clues, channel) / len(images)
        own = inverse @ shapes @ rest
        values += own
        scatter = scale * noise
        if RING_SIZE in names:
            scatter = max(scatter, _smooth_scatter((rest - own @ shapes).reshape(image.shape)))
        errors = np.hypot(errors, scatter * np.sqrt(np.diag(inverse)))
    found = dict(zip(names, values.tolist(), strict=True))
    clear = {name for name, error in zip(names, errors, strict=True)
             if abs(found[name]) > _CLEAR * error}  # fmt: skip
    return found, clear


def _smooth_scatter(image: Array) -> float:
    """Return the root mean square of an image's surfaces that neither lean nor bow."""
    coefficients = Smooth.of(*image.shape).coefficients(image)
    order = np.add.outer(*(np.arange(size) for size in coefficients.shape))
    own = coefficients[(order > _BOWS_DEGREE) & (order <= coefficients.shape[0] - 1)]
    return float(np.sqrt((own**2).mean())) if own.size else 0.0


def _of_strength(clues: Clues) -> Sequence[Proposal]:
    """Start from how strong the surfaces of single exposures are: one level has no gain."""
    variance, _ = clues.amplitude("fixed_smooth_variance", _squared(clues))
    if variance <= 0:
        return []
    spread = float(surfaces((clues.layout.rows, clues.layout.columns), (FALL_SIZE,)).var())
    return _of_light({FALL_SIZE: 100 * sqrt(variance / spread)}, (FALL_SIZE,))


def had(clues: Clues, channel: str) -> Array:
    """Return how the camera's own effects make the light uneven, per cent, less their mean.

    Those of uneven light, and those whose lines feign it: (pixel,).
    """
    gain = 100 * made_of_light(clues, channel)
    return np.asarray(gain - gain.mean())


def made_of_light(clues: Clues, channel: str) -> Array:
    """Return what these make of a unit of even light: (pixel,)."""
    layout, uneven = clues.layout, [e for e in clues.camera.effect if e.kind in _UNEVEN]
    y, x = layout.sites[channel]
    step = 1 if len(layout.sites) == 1 else 2
    grid, read_out = layout.grid, clues.camera.read_out
    dark, lit = (
        layout.seen(mean_frame(np.full(grid.shape, light, np.float32), uneven, grid, read_out, 0.0))
        for light in (0.0, _LIGHT_DN)
    )
    return np.asarray((lit.astype(np.float64) - dark)[y::step, x::step].ravel() / _LIGHT_DN)


def _of_light(own: Mapping[str, float], names: Sequence[str]) -> list[Proposal]:
    """Return the proposal with some of the surfaces, none where a fall is a rise."""
    if not names or (FALL_SIZE in names and own[FALL_SIZE] <= 0):
        return []
    start = {FALL_SIZE: 0.0}
    for name in names:
        most = _MOST_RING if name == RING_SIZE else _MOST
        start[name] = float(np.clip(own[name], -most, most))
    return proposals("shading", names, [n for n in names if n != FALL_SIZE], **start)


def surfaces(shape: tuple[int, ...], names: Sequence[str]) -> Array:
    """Return what shading does to a unit of light for 1 of each number: (surface, pixel)."""
    n, m = shape
    y, x = ((np.arange(size) - (size - 1) / 2) / (size / 2) for size in shape)
    y = y[:, None]
    fall = -((n * y) ** 2 + (m * x) ** 2) / (n**2 + m**2)
    own = fall, -fall * (1 + fall), y, x, y**2, x**2
    every = dict(zip((FALL_SIZE, RING_SIZE, *_BOWED), own, strict=True))
    made = np.stack([np.broadcast_to(every[name], shape).ravel() for name in names])
    return np.asarray(made - made.mean(1, keepdims=True))


def _taps(clues: Clues) -> Sequence[Proposal]:
    found: list[Proposal] = []
    for regions, statistic, axis in (
        ("left_right", "half_seam", "columns"),
        ("top_bottom", "half_seam", "rows"),
        ("even_odd_columns", "parity", "columns"),
        ("even_odd_rows", "parity", "rows"),
    ):
        jump, whole = (
            max(
                abs(clues.number(statistic, scope, f"{axis}{part}{joint}"))
                for scope in ("gain", "gain alone")
                for joint in ("", f", {TOGETHER}")
            )
            for part in ("", f", {WHOLE}")
        )
        if statistic == "half_seam" and jump < _JUMP * whole and not _as_measured(clues):
            continue  # halves that differ without a step where they meet: a tilt
        if max(jump, whole) < 3 and not (statistic == "parity" and len(clues.layout.channels) > 1):
            continue
        gain = 100 * _step(clues, regions)
        if gain:
            found += proposals(
                "tap_mismatch", ["gain_percent"], ["gain_percent"], gain_percent=gain,
                regions=regions,
            )  # fmt: skip
    for way, regions in enumerate(("top_bottom", "left_right")):
        parts = unequal_parts(clues, way)
        if parts is not None:
            name = "gain_percent"
            start = {name: 100 * parts.step, "regions": regions, "seam": parts.seam}
            own = proposals("tap_mismatch", [name], [name], **start)
            found += [replace(one, best_of=parts.tried) for one in own]
    return found


def _step(clues: Clues, regions: str) -> float:
    """Return the relative step of the gain between two regions."""
    steps = []
    if len(clues.layout.channels) > 1 and regions.startswith("even_odd"):
        ratio, _ = clues.amplitude("channel_ratio", alike)
        rows = clues.layout.cfa.value[:2], clues.layout.cfa.value[2:]
        row = int("R" in rows[1])  # of the green beside red
        odd = row if regions == "even_odd_rows" else rows[row].index("G")
        return ratio if odd else -ratio
    for channel, (whole, _) in clues.image("gain").items():
        image = _in_its_light(clues, channel, whole)
        along = image.mean(0) if regions in ("left_right", "even_odd_columns") else image.mean(1)
        size = along.size
        second = np.arange(size) % 2 == 1 if regions.startswith("even_odd") else _upper(size)
        step = along[second].mean() - along[~second].mean()
        steps.append(float(step) / clues.scale("gain", channel))
    return float(np.mean(steps)) if steps else 0.0


def _as_measured(clues: Clues) -> bool:
    """Return whether the camera has light of a measured shape, beside which a step is little."""
    return any(isinstance(own, Shading) and own.field for own in clues.camera.effect)


def _in_its_light(clues: Clues, channel: str, image: Array) -> Array:
    """Return a map of the gain over what the camera makes of even light, where this is uneven."""
    if not _as_measured(clues):
        return image
    had = made_of_light(clues, channel).reshape(image.shape)
    return (light_over(clues, channel, image, had) - 1) * clues.scale("gain", channel)


def light_over(clues: Clues, channel: str, image: Array, had: Array) -> Array:
    """Return the light that a map of the gain shows, over what a camera has of it."""
    shown = 1 + (image - image.mean()) / clues.scale("gain", channel)
    return np.asarray(shown * had.mean() / had)


def _upper(size: int) -> NDArray[np.bool_]:
    return np.arange(size) >= size / 2


def _imbalance(clues: Clues) -> Sequence[Proposal]:
    ratio, error = clues.amplitude("channel_ratio", alike)
    if len(clues.layout.channels) == 1 or abs(ratio) < 2 * error:
        return []
    return proposals(
        "channel_imbalance", ["gain_percent"], ["gain_percent"], gain_percent=100 * ratio
    )


def _glow(clues: Clues) -> Sequence[Proposal]:
    """Fit exp(-r / L) from each edge and corner to the map that grows with time."""
    images = clues.image("time")
    if not images:
        return []

    def fit(place: str, extent: float) -> tuple[float, float]:
        """Return what the fit gains, and the glow, DN in a second."""
        gain = rate = weight = 0.0
        for channel, (image, noise) in images.items():
            shape = glowing(image.shape, place, extent)
            rest = shape - shape.mean()
            size = float((rest**2).sum())
            slope = float((rest * image).sum()) / size
            gain += max(slope, 0.0) ** 2 * size / noise**2
            rate += slope / clues.scale("time", channel) / noise**2
            weight += 1 / noise**2
        return gain, rate / weight

    most, place, start = max(
        (fit(place, extent)[0], place, extent) for place in PLACES for extent in EXTENTS
    )
    found = scipy.optimize.minimize_scalar(
        lambda logarithm: -fit(place, exp(logarithm))[0],
        bounds=(log(max(start / 2, EXTENTS[0])), log(min(start * 2, _WIDEST_GLOW))),
        method="bounded",
        options={"xatol": _OF_EXTENT},
    )
    extent = exp(float(found.x)) if -found.fun > most else start
    _, rate = fit(place, extent)
    if rate <= 0:
        return []
    free = ["dn_per_s", "extent"]
    return proposals("amp_glow", free, dn_per_s=rate, place=place, extent=extent)


def _is_glow(_: Layout, effect: Effect) -> bool:
    """Return whether a glow falls off within the sensor, and over more than a few pixels.

    What does not fall off is current everywhere; what reaches few pixels is hot pixels.
    """
    return isinstance(effect, AmpGlow) and EXTENTS[0] / 2 <= effect.extent <= _WIDEST_GLOW


def glowing(shape: tuple[int, ...], place: str, extent: float, power: float = 0.0) -> Array:
    """Return a glow of height 1, exp(-r / L), in a map of such a shape: (row, column).

    Of a power it falls off as (1 + r / L)^-power instead.
    """
    n, m = shape
    y, x = np.arange(n)[:, None], np.arange(m)
    down = y if "top" in place else (n - 1 - y if "bottom" in place else np.zeros((n, 1)))
    across = x if "left" in place else (m - 1 - x if "right" in place else np.zeros(m))
    distance = np.hypot(down, across) / (extent * max(n, m))
    return np.asarray((1 + distance) ** -power if power else np.exp(-distance))


CANDIDATES = (
    _constant("dsnu", "fixed_pixel_variance"),
    _constant("row_fpn", "fixed_row_variance"),
    _constant("column_fpn", "fixed_column_variance"),
    _gains("prnu", "fixed_pixel_variance"),
    _gains("row_prnu", "fixed_row_variance"),
    _gains("column_prnu", "fixed_column_variance"),
    Candidate("shading", _SMOOTH, _shading),
    Candidate("tap_mismatch", ("half_seam", "parity", "channel_ratio", *_SMOOTH), _taps),
    Candidate("channel_imbalance", ("channel_ratio",), _imbalance),
    Candidate("amp_glow", _SMOOTH, _glow, sane=_is_glow, credited=frozenset({"dark_current"})),
)
