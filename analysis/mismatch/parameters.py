"""Which of the camera model's numbers the recording contradicts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import hypot, isfinite, nan, sqrt

import numpy as np
import scipy.stats

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.beside import Beside
from analysis.mismatch.finding import ParameterError
from analysis.mismatch.layout import Layout
from analysis.mismatch.recalibrate import Calibrated
from dsis.camera import Camera

Errors = tuple[float, float]
"""Of the fit, and of the user's number."""

P_PARAMETERS = 0.004  # chance that numbers without error are called wrong


@dataclass(frozen=True)
class _Row:
    """A number: the user's, as recorded, its own error, and what it moves by with each effect's."""

    name: str
    own: float
    recorded: float
    error: float
    moves: tuple[float, ...]


def parameter_errors(
    camera: Camera,
    calibrated: Calibrated,
    layout: Layout,
    simulated: Sequence[BaseFit],
    beside: Sequence[Beside] = (),
) -> tuple[ParameterError, ...]:
    """Return the numbers of the camera model that the recording contradicts.

    Judged together (chi-squared over all numbers, at `P_PARAMETERS`) and one by one (Bonferroni).
    The errors are those of the fit; larger ones where fits of simulated recordings scatter more,
    as row noise, drift and fixed patterns make them; and with those of sizes of effects that
    numbers go with, as `beside` says, all of them together with each.
    """
    fit = calibrated.fit
    rows: list[_Row] = []
    many = len(fit.pieces) > 1

    def row(name: str, own: float, of: Callable[[BaseFit], float], errors: Errors) -> None:
        error = _wider(errors[0], [of(one) for one in simulated])
        moves = [one.errors * (of(one.after) - of(one.before)) for one in beside]
        known = tuple(one if isfinite(one) else 0.0 for one in moves)
        rows.append(_Row(name, own, of(fit), hypot(error, errors[1]), known))

    # A segment that the camera model does not have is physics, no wrong number.
    for number, (piece, segment) in enumerate(zip(fit.pieces, camera.noise.segment, strict=False)):
        at = f"noise.segment[{number}]" if many else "noise"
        if isfinite(piece.slope_error):
            errors = piece.slope_error, segment.slope_se or 0.0
            row(f"{at}.slope", segment.slope, partial(_slope, number), errors)
        if isfinite(piece.intercept_error):
            errors = piece.intercept_error, segment.intercept_se or 0.0
            row(f"{at}.intercept", segment.intercept, partial(_intercept, number), errors)
    black = [e for e in fit.black_error_dn.values() if isfinite(e)]
    if black:
        error = sqrt(sum(e**2 for e in black)) / len(black)
        offset = layout.black_dn
        row("black_level", camera.black_level, lambda one: offset + _mean_black(one), (error, 0.0))
    return _contradicted(rows, camera, calibrated)


def _slope(number: int, fit: BaseFit) -> float:
    return fit.pieces[number].slope if number < len(fit.pieces) else nan


def _intercept(number: int, fit: BaseFit) -> float:
    return fit.pieces[number].intercept if number < len(fit.pieces) else nan


def _mean_black(fit: BaseFit) -> float:
    return float(np.mean(list(fit.black_dn.values())))


def _wider(error: float, values: Sequence[float]) -> float:
    """Return the error, or the scatter of simulated values where that is clearly larger."""
    if len(values) < 2:
        return error
    scatter = float(np.std(values, ddof=1))
    certain = 1 + 3 / sqrt(2 * (len(values) - 1))
    return scatter if scatter > certain * error else error


def _contradicted(
    rows: Sequence[_Row], camera: Camera, calibrated: Calibrated
) -> tuple[ParameterError, ...]:
    found = []
    if rows:
        off = np.array([one.recorded - one.own for one in rows])
        moves = np.array([one.moves for one in rows]).reshape(len(rows), -1)
        covariance = np.diag([one.error**2 for one in rows]) + moves @ moves.T
        errors = np.sqrt(np.diag(covariance))
        z = off / errors
        single = float(scipy.stats.norm.isf(P_PARAMETERS / 4 / len(rows)))
        square = float(off @ np.linalg.solve(covariance, off))
        joint = float(scipy.stats.chi2.sf(square, len(rows)))
        least = single
        if joint < P_PARAMETERS / 2:
            least = min(single, max(2.0, float(np.abs(z).max())))
        found = [
            ParameterError(one.name, one.own, one.recorded, float(error))
            for one, error, departure in zip(rows, errors, z, strict=True)
            if abs(departure) >= least
        ]
    stated = [s.upper_dn for s in camera.noise.segment if s.upper_dn is not None]
    for own, recorded in zip(stated, calibrated.switches, strict=False):
        if own != recorded:
            found.append(ParameterError("noise.switch_dn", own, recorded, abs(recorded - own) / 4))
    return tuple(found)
