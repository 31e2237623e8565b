"""Bands of rows, or halves and leans that move: which of them the parts of frames show."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import helmert

from analysis.mismatch.bank.linemeans import PARTS
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.row_banding import RowBanding

Array = NDArray[np.float64]
_SIZES = np.geomspace(0.1, 3.0, 16)  # of the scatter of parts that is seen
_CONTRASTS = helmert(PARTS)  # (contrast, part): orthonormal, of what is left without the mean
_LENGTHS = np.geomspace(1 / 24, 2.0, 10)  # of a frame, over which bands last


@dataclass(frozen=True)
class _Moved:
    """How parts of the frames of an exposure move: covariance (contrast, contrast), DN^2.

    `noise` is that of one part, `free` the degrees of freedom.
    """

    covariance: Array
    noise: float
    free: int


def halved(state: State, effect: Effect) -> Denial | None:
    """Return how bands of rows are denied by halves that move; None: they are not.

    Where two amplifiers read a frame, or one that is reset in its middle, rows are as alike as in a
    band that lasts for half of a frame, but for the step between them. Asked are the means of parts
    of each frame less that of the frame, by the likelihood of normal ones: where halves that move,
    each as a whole, are as likely as bands of any length, there may be none. Nor where frames that
    lean, one more than another, are likelier at odds of 20: of long bands most is a lean as well.
    """
    if not isinstance(effect, RowBanding):
        return None
    moved = list(_moving(state))
    if not moved:
        return None
    unit = max(float(np.trace(own.covariance)) / len(own.covariance) for own in moved)
    half = np.where(np.arange(PARTS) < PARTS / 2, 1.0, -1.0)
    apart = np.abs(np.subtract.outer(np.arange(PARTS), np.arange(PARTS))) / PARTS
    halves = _likeliest(moved, unit, [np.outer(half, half)])
    lean = np.linspace(-1, 1, PARTS)
    bands = _likeliest(moved, unit, [np.exp(-apart / length) for length in _LENGTHS])
    leans = _likeliest(moved, unit, [np.outer(lean, lean)])
    if leans - max(bands, halves) > TOLD_APART:
        return rival(leans - bands, "frames lean, one more than another, and have no bands")
    return rival(halves - bands, "halves of a frame move against each other as wholes")


def _moving(state: State) -> Iterator[_Moved]:
    for exposure in state.setting.layout.uniform:
        own = state.setting.seen.lines.get((exposure.name, "row"))
        if own is None or own.frames < 2 or own.fixed.size < PARTS or not own.noise_dn2 > 0:
            continue
        moved = (own.parts - own.parts.mean(0)) @ _CONTRASTS.T
        noise = own.noise_dn2 * PARTS / own.fixed.size
        free = own.frames - 1
        yield _Moved(moved.T @ moved / free, noise, free)


def _likeliest(moved: Sequence[_Moved], unit: float, shapes: Sequence[Array]) -> float:
    """Return the largest log-likelihood of covariances (part, part) of some shape and size, DN^2.

    Beside noise.
    """
    best, white = -np.inf, np.eye(len(_CONTRASTS))
    for shape in shapes:
        made = unit * _SIZES[:, np.newaxis, np.newaxis] ** 2 * (_CONTRASTS @ shape @ _CONTRASTS.T)
        total: Array = np.zeros(_SIZES.size)
        for own in moved:
            expected = made + own.noise * white
            _, logs = np.linalg.slogdet(expected)
            fits = np.linalg.solve(expected, np.broadcast_to(own.covariance, expected.shape))
            total -= own.free / 2 * (logs + np.trace(fits, axis1=1, axis2=2))
        best = max(best, float(total.max()))
    return best
