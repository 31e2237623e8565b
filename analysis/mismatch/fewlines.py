"""Rows and columns of which few move from frame to frame, as no offset does that all lines have."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from analysis.mismatch.bank.linemeans import Axis, LineMeans
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State

Array = NDArray[np.float64]
_NEW: Mapping[str, Axis] = {"row_noise": "row", "column_noise": "column"}
_FIXED: Mapping[str, Axis] = {
    "row_fpn": "row",
    "column_fpn": "column",
    "row_prnu": "row",
    "column_prnu": "column",
}
_OF_LIGHT = frozenset({"row_prnu", "column_prnu"})
_PINK = "pink_noise"  # drawn anew for all lines, too
_CHANCE = 1e-3  # that any line moves so much farther than the others
_MOST = 0.5  # of what an effect would explain, that few lines may make


def of_few_lines(
    state: State, kind: str, without: Array, mean: Array | None = None
) -> Denial | None:
    """Return how lines that differ are denied by few of them that move; None: they are not.

    `without` are the numbers predicted without the effect, `mean` those with it: pink noise may be
    that of rows or of columns.

    Offsets that are drawn anew for all lines of a frame move all of them alike: the sum of squares
    of each is chi-squared, about a mean that the middle one tells, whatever moves them besides.
    Where lines move farther for certain - they jump between two levels, say, which makes them
    brighter or darker in the mean as well - and without them half is left of what an effect
    explains, or less, there may be nothing that all lines have.
    """
    if kind == _PINK and mean is not None:
        changed = _changed_most(state, mean - without)
        kind = f"{changed}_noise" if changed is not None else kind
    axis = _NEW.get(kind) or _FIXED.get(kind)
    if axis is None:
        return None
    seen = state.setting.seen
    exposures = [e.name for e in state.setting.layout.uniform if (e.name, axis) in seen.lines]
    own = [seen.lines[name, axis] for name in exposures]
    few = moving_farther(own)
    if not few.any():
        return None
    if kind in _NEW:
        excess = _moving(own, grown_by(state, exposures, (f"{axis}_variance",), without))
    else:
        of_means = ("fixed_pixel_variance", f"fixed_{axis}_variance")
        factors = grown_by(state, exposures, of_means, without)
        signals, channels = state.calibrated.fit.signal_dn, state.setting.layout.channels
        light = [float(np.mean([signals[e, c] for c in channels])) for e in exposures]
        excess = _fixed(own, light if kind in _OF_LIGHT else [1.0] * len(own), factors)
    whole, rest = float(excess.sum()), float(excess[~few].sum())
    if whole <= 0 or rest > _MOST * whole:
        return None
    why = f"few {axis}s that move by themselves from frame to frame make most of it"
    return Denial(max(rest / whole, 0.0), why)


def _changed_most(state: State, change: Array) -> Axis | None:
    """Return the axis whose lines' variances a change of the numbers moves by more; None: none."""
    size: dict[Axis, float] = {"row": 0.0, "column": 0.0}
    for axis in size:
        own = np.array([key.statistic == f"{axis}_variance" for key in state.vector.keys])
        own &= state.null.known & np.isfinite(change)
        size[axis] = float(((change[own] / state.null.sd[own]) ** 2).sum())
    if not any(size.values()):
        return None
    return max(size, key=lambda axis: size[axis])


def moving_farther(own: Sequence[LineMeans]) -> NDArray[np.bool_]:
    """Return which lines of some exposures move farther than the others for certain: (line,).

    In units of what the middle line of each exposure does; exposures count as far as they show
    offsets of one size. The weighted sum of chi-squared variates is near one of fewer degrees of
    freedom (Satterthwaite, 1946).
    """
    own = [one for one in own if np.median(one.moving) > 0]
    if not own:
        return np.zeros(0, np.bool_)
    dof = np.array([one.frames - 1 for one in own])
    middle = np.array([np.median(one.moving) for one in own]) * dof / chi2.median(dof)
    weight = middle.min() / middle
    ratios = np.stack([one.moving for one in own]) / middle[:, np.newaxis]
    squares = (weight * dof) @ ratios
    unit = float((weight**2 * dof).sum() / (weight * dof).sum())
    few = float((weight * dof).sum()) / unit
    return np.asarray(squares / unit > float(chi2.isf(_CHANCE / squares.size, few)))


def grown_by(
    state: State, exposures: Sequence[str], names: Sequence[str], without: Array
) -> list[float]:
    """Return by which factor lines move, or differ, more than noise of pixels makes them.

    Without the effect, in each exposure: ratios of variances are cubes of their numbers.
    """
    found: dict[tuple[str, str], list[float]] = {}
    for key, mean, known in zip(state.vector.keys, without, state.null.known, strict=True):
        if key.scope == "exposure" and key.statistic in names and known and np.isfinite(mean):
            found.setdefault((key.exposure, key.statistic), []).append(float(mean) ** 3)
    ratios = [[np.mean(found.get((e, name), [1.0])) for name in names] for e in exposures]
    return [max(float(np.prod(own)), 0.0) for own in ratios]


def _moving(own: Sequence[LineMeans], factors: Sequence[float]) -> Array:
    """Return by how much each line moves beyond what it does without the effect, (line,)."""
    excess = np.zeros(own[0].moving.size)
    for one, factor in zip(own, factors, strict=True):
        expected = max(one.noise_dn2 * factor, 1e-9)
        excess += (one.frames - 1) * (one.moving - expected) / expected**2
    return excess


def _fixed(own: Sequence[LineMeans], rows: Sequence[float], factors: Sequence[float]) -> Array:
    """Return the squared fixed deviation of each line beyond what it has without the effect.

    (line,), over all exposures, of what is in proportion to `rows`.
    """
    along, square = np.zeros(own[0].fixed.size), 0.0
    for one, row, factor in zip(own, rows, factors, strict=True):
        weight = row * one.frames / max(one.noise_dn2 * factor, 1e-9)
        along += weight * one.fixed
        square += weight * row
    return np.asarray(along**2 / square - 1 if square > 0 else along)
