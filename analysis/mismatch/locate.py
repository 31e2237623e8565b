"""Which departures are real, and where: family-wise control, floors, one entry a statistic."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.home import TIME, homes, one_sided
from analysis.mismatch.bank.key import MOSAIC, Key
from analysis.mismatch.bank.movingbands import DETAIL as MOVING_BANDS
from analysis.mismatch.bank.movingbands import KIND as MOVING_PLACE
from analysis.mismatch.bank.parts import parts
from analysis.mismatch.bank.patches import OUTLYING_PATCH, outlying
from analysis.mismatch.bank.standing import NAME as FIXED_WAVE
from analysis.mismatch.bank.together import shared_pixels
from analysis.mismatch.finding import Mismatch, Where
from analysis.mismatch.layout import Layout
from analysis.mismatch.null import Null, adjusted
from analysis.mismatch.observe import Observation
from analysis.mismatch.says import sentence
from analysis.mismatch.scenes import SCENE
from analysis.mismatch.vector import Vector

Array = NDArray[np.float64]
FAMILY = 0.006  # chance of any mismatch in a recording that differs in nothing
HOMES = 0.6  # of it, for the sums that show an effect of the vocabulary best
SUMS = 0.2  # of it, for other sums over exposures or channels
_ROOTS = 2e-3  # of a ratio: 0.6 % of the finer mean square
_PATTERNS = frozenset(f"fixed_{part}_variance" for part in ("pixel", "row", "column", "smooth"))
_NO_PATTERN = 1.02  # cube root of a ratio of mean squares: 6 % above noise alone
_EDGE = 16  # lines at an edge: a decay is seen there
_BANDS = {"light": "rows of light", MOVING_BANDS: MOVING_PLACE}  # where their peak is
_FLOORS = {
    "pixel_variance": 1e-3,
    "skewness": 1e-3,
    "kurtosis": 3e-3,
    "kurtosis_within_pixels": 3e-3,
    "variance_spread": 1e-2,
    "code_imbalance": 2e-3,
    "carry_over": 1e-2,
    "channel_ratio": 5e-5,
    "level": 1e-3,
}


def floor(key: Key) -> float:
    """Return the least departure that matters, in the unit of the transformed number."""
    if key.is_cube_root:
        return _ROOTS
    if "correlation" in key.statistic:
        return 1e-3
    return _FLOORS.get(key.statistic, 0.0)


def tested(layout: Layout, null: Null, seen: Vector) -> tuple[Array, Array]:
    """Return departures and adjusted chances; departures too small to matter are 0."""
    z = null.departures(seen)
    size = len(seen.keys)
    distance = np.abs(np.nan_to_num(seen.values) - null.mean)
    small = distance < np.array([floor(key) for key in seen.keys])
    z[:size][small] = 0.0
    for i, row in enumerate(null.contrasts.matrix):
        if small[np.flatnonzero(row)].all():
            z[size + i] = 0.0
    # The largest of many bins says nothing where it is smaller than chance makes it.
    scores = np.array([key.is_score for key in null.keys])
    z[scores] = np.maximum(z[scores], 0.0)
    # No pattern is less than none: lower tails of these ratios of few degrees are heavy.
    nothing = _without_pattern(null, seen)
    z[nothing] = np.maximum(z[nothing], 0.0)
    known = np.concatenate([null.known, np.ones(len(null.contrasts.keys), bool)])
    weights = shares(layout, null)
    single = null.chances(z)
    raised = np.array([one_sided(key) for key in null.keys])
    raised &= np.array(homes(null.keys, layout.channels)) > 0
    single[raised] = np.where(z[raised] > 0, single[raised] / 2, 1 - single[raised] / 2)
    chances = np.ones(len(z))
    chances[known] = adjusted(single[known], weights[known])
    return z, chances


def _without_pattern(null: Null, seen: Vector) -> NDArray[np.bool_]:
    """Return which numbers and contrasts are of fixed patterns that the model does not have."""
    pattern = np.array([key.statistic in _PATTERNS for key in seen.keys])
    single = pattern & (null.mean < _NO_PATTERN + null.sd)
    weights = np.abs(null.contrasts.matrix)
    mean = weights @ null.mean / np.maximum(weights.sum(1), 1e-12)
    of_patterns = ~(weights[:, ~pattern] > 0).any(1)
    return np.concatenate([single, of_patterns & (mean < _NO_PATTERN)])


def shares(layout: Layout, null: Null) -> Array:
    """Return the share of the error rate of each number and contrast; 0 where it is unknown.

    Sums over exposures and channels, where an effect shows best, have most of it.
    """
    known = np.concatenate([null.known, np.ones(len(null.contrasts.keys), bool)])
    home = np.where(known, homes(null.keys, layout.channels), 0.0)
    alone = len(layout.channels) == 1
    summed = np.array(
        [
            not key.exposure and (key.scope == "contrast" or key.channel == "" or alone)
            for key in null.keys
        ]
    )
    rest = known & (home == 0)
    groups = (
        (HOMES, home),
        (SUMS, 1.0 * (rest & summed)),
        (1 - HOMES - SUMS, 1.0 * (rest & ~summed)),
    )
    return np.asarray(sum(share * own / max(own.sum(), 1) for share, own in groups))


def located(
    layout: Layout, seen: Observation, null: Null, z: Array, chances: Array
) -> tuple[Mismatch, ...]:
    """Return one mismatch a statistic, the largest departure first."""
    groups: dict[str, list[int]] = {}
    for i in np.flatnonzero(chances < FAMILY):
        groups.setdefault(null.keys[i].statistic, []).append(int(i))
    found = []
    for statistic, which in groups.items():
        top = max(which, key=lambda i: abs(z[i]))
        where = _where(layout, seen, null.keys, statistic, which, top, z)
        departure = float(np.clip(z[top], -1e6, 1e6))
        says = sentence(statistic, null.keys[top], departure, where)
        found.append(Mismatch(statistic, departure, float(chances[top]), where, says))
    return tuple(sorted(found, key=lambda m: -abs(m.z)))


def _where(
    layout: Layout,
    seen: Observation,
    keys: Sequence[Key],
    statistic: str,
    which: Sequence[int],
    top: int,
    z: Array,
) -> Where:
    single = [i for i in which if keys[i].exposure]
    if not single:  # only sums over exposures are certain: those that carry them
        own = [i for i, k in enumerate(keys) if k.statistic == statistic and k.exposure]
        most = max((abs(z[i]) for i in own), default=0.0)
        single = [i for i in own if abs(z[i]) > 0.5 * most and z[i] * z[top] > 0]
    names = list(dict.fromkeys(keys[i].exposure for i in single))
    if not names:
        of_map = f"{keys[top].scope} {keys[top].detail}"
        shone = statistic in (FIXED_WAVE, OUTLYING_PATCH) and "gain" in of_map
        names = [e.name for e in layout.uniform if e.kind == "flat" or not shone]
    exposures = [e for e in layout.exposures if e.name in names]
    channels = {keys[i].channel for i in (*which, *single) if keys[i].channel}
    channel = channels.pop() if len(channels) == 1 else None
    signals = [
        layout.signal_dn[e.name, c]
        for e in exposures
        for c in layout.channels
        if (channel is None or c == channel) and e.kind != SCENE
    ]
    for i in single:
        if keys[i].exposure in layout.scenes:
            signals += layout.range_dn(keys[i].place)
    kinds = {e.kind for e in exposures}
    times = [e.exposure_time_s for e in exposures]
    rows = lines_of(keys[top], "rows", layout.rows)
    columns = lines_of(keys[top], "columns", layout.columns)
    rows, columns = _patch(layout, seen, keys[top]) or (rows, columns)
    return Where(
        exposures=tuple(e.name for e in exposures),
        kind=kinds.pop() if len(kinds) == 1 else None,
        channel=channel,
        signal_dn=(round(min(signals), 3), round(max(signals), 3)) if signals else None,
        rows=rows,
        columns=columns,
        spatial_frequency=_frequency(layout, seen, statistic, keys[top]),
        pixels=_pixels(layout, seen, keys[top]),
        exposure_time_s=(min(times), max(times))
        if "time" in (keys[top].scope, TIME[-4:] if keys[top].detail == TIME else "")
        else None,
    )


def lines_of(key: Key, axis: str, size: int) -> tuple[int, int] | None:
    """Return the first and last of the `rows` or `columns` that a number is of; None: of all."""
    if axis not in key.detail.replace(",", " ").split():  # a contrast names its map first
        return None
    if key.statistic == "half_seam":
        return size // 2 - 1, size // 2
    if key.statistic == "fixed_edge":
        return (0, _EDGE - 1) if "first" in key.detail else (size - _EDGE, size - 1)
    return None


def _patch(
    layout: Layout, seen: Observation, key: Key
) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Return the first and last row, and column, of the patch that a number is of; None: of none.

    Where channels show it together, of the map that they share.
    """
    name = key.detail if key.scope == "contrast" else key.scope
    channels = (key.channel,) if key.channel else layout.channels
    if key.statistic != OUTLYING_PATCH or any((one, name) not in seen.images for one in channels):
        return None
    own = [parts(*seen.images[one, name]) for one in channels]
    sharp = [layout.regressors(one).sharpness(name, seen.images[one, name][1]) for one in channels]
    found = outlying(*shared_pixels(own, sharp))
    if found is None:
        return None
    _, top, left, size = found
    step = 1 if layout.channels == ("MONO",) else 2
    rows, columns = ((step * at, step * (at + size) - 1) for at in (top, left))
    return rows, columns


def _frequency(
    layout: Layout, seen: Observation, statistic: str, key: Key
) -> tuple[float, float] | None:
    if statistic == "alternation_variance":
        name = key.detail.rpartition(" ")[2]
        # Of a plane's pixels, or of the mosaic's.
        mosaic = len(layout.channels) > 1
        of_planes = mosaic and key.scope != MOSAIC and MOSAIC not in key.detail
        top = 0.25 if of_planes else 0.5
        return top * (name != "rows"), top * (name != "columns")
    grows = "with the signal" in key.detail  # darks show something else
    kind = {
        "spectral_peak": f"spectrum, {key.detail}" if key.detail else "spectrum",
        "row_spectrum_peak": _BANDS.get(key.detail, _BANDS["light"] if grows else "rows"),
        FIXED_WAVE: f"{FIXED_WAVE}, {key.scope}",
    }.get(statistic)
    peak = seen.peaks.get((key.channel, kind or ""))
    if peak is None:
        peak = seen.peaks.get((layout.channels[0], kind or ""))
    if peak is None:
        return None
    step = 1 if layout.channels == ("MONO",) else 2
    return round(peak.fx / step, 6), round(peak.fy / step, 6)


def _pixels(
    layout: Layout, seen: Observation, key: Key, count: int = 8
) -> tuple[tuple[int, int], ...] | None:
    name = {"outlying_pixels": key.scope, "variance_persistence": "variance"}.get(key.statistic)
    channel = key.channel or layout.channels[0]
    if name is None or (channel, name) not in seen.images:
        return None
    image, _ = seen.images[channel, name]
    step = 1 if channel == "MONO" else 2
    order = np.argsort(-np.abs(image - np.median(image)), axis=None)[:count]
    rows, columns = np.unravel_index(order, image.shape)
    y, x = layout.sites[channel]
    return tuple((int(r) * step + y, int(c) * step + x) for r, c in zip(rows, columns, strict=True))
