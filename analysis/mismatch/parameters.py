"""Which of the camera model's numbers the recording contradicts."""

from collections.abc import Sequence
from math import hypot, isfinite, sqrt

import numpy as np
import scipy.stats

from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.finding import ParameterError
from analysis.mismatch.layout import Layout
from analysis.mismatch.recalibrate import Calibrated
from dsis.camera import Camera

P_PARAMETERS = 0.004  # chance that numbers without error are called wrong


def parameter_errors(
    camera: Camera,
    calibrated: Calibrated,
    layout: Layout,
    simulated: Sequence[BaseFit],
    beside: Sequence[BaseFit] = (),
) -> tuple[ParameterError, ...]:
    """Return the numbers of the camera model that the recording contradicts.

    Judged together (chi-squared over all numbers, at `P_PARAMETERS`) and one by one (Bonferroni).
    The errors are those of the fit; larger ones where fits of simulated recordings scatter more,
    as row noise, drift and fixed patterns make them; and with those that sizes of effects have
    which numbers go with, as `beside` says: the fits beside each of these off by its error.
    """
    fit = calibrated.fit
    rows: list[tuple[str, float, float, float]] = []
    many = len(fit.pieces) > 1
    # A segment that the camera model does not have is physics, no wrong number.
    for number, (piece, segment) in enumerate(zip(fit.pieces, camera.noise.segment, strict=False)):
        at = f"noise.segment[{number}]" if many else "noise"
        others = [one.pieces[number] for one in simulated]
        off = [one.pieces[number] for one in beside if number < len(one.pieces)]
        if isfinite(piece.slope_error):
            error = _wider(piece.slope_error, [p.slope for p in others])
            error = _with(error, [p.slope - piece.slope for p in off])
            rows.append(
                (f"{at}.slope", segment.slope, piece.slope, hypot(error, segment.slope_se or 0.0))
            )
        if isfinite(piece.intercept_error):
            error = _wider(piece.intercept_error, [p.intercept for p in others])
            error = _with(error, [p.intercept - piece.intercept for p in off])
            error = hypot(error, segment.intercept_se or 0.0)
            rows.append((f"{at}.intercept", segment.intercept, piece.intercept, error))
    errors = [e for e in fit.black_error_dn.values() if isfinite(e)]
    if errors:
        recorded = layout.black_dn + _mean_black(fit)
        error = sqrt(sum(e**2 for e in errors)) / len(errors)
        error = _wider(error, [_mean_black(one) for one in simulated])
        error = _with(error, [_mean_black(one) - _mean_black(fit) for one in beside])
        rows.append(("black_level", camera.black_level, recorded, error))
    return _contradicted(rows, camera, calibrated)


def _mean_black(fit: BaseFit) -> float:
    return float(np.mean(list(fit.black_dn.values())))


def _with(error: float, off: Sequence[float]) -> float:
    """Return an error with what numbers are off by beside effects that are off by theirs."""
    return hypot(error, *(one for one in off if isfinite(one)))


def _wider(error: float, values: Sequence[float]) -> float:
    """Return the error, or the scatter of simulated values where that is clearly larger."""
    if len(values) < 2:
        return error
    scatter = float(np.std(values, ddof=1))
    certain = 1 + 3 / sqrt(2 * (len(values) - 1))
    return scatter if scatter > certain * error else error


def _contradicted(
    rows: list[tuple[str, float, float, float]], camera: Camera, calibrated: Calibrated
) -> tuple[ParameterError, ...]:
    found = []
    if rows:
        z = np.array([(recorded - own) / error for _, own, recorded, error in rows])
        single = float(scipy.stats.norm.isf(P_PARAMETERS / 4 / len(rows)))
        joint = float(scipy.stats.chi2.sf((z**2).sum(), len(rows)))
        least = single
        if joint < P_PARAMETERS / 2:
            least = min(single, max(2.0, float(np.abs(z).max())))
        found = [
            ParameterError(name, own, recorded, error)
            for (name, own, recorded, error), departure in zip(rows, z, strict=True)
            if abs(departure) >= least
        ]
    stated = [s.upper_dn for s in camera.noise.segment if s.upper_dn is not None]
    for own, recorded in zip(stated, calibrated.switches, strict=False):
        if own != recorded:
            found.append(ParameterError("noise.switch_dn", own, recorded, abs(recorded - own) / 4))
    return tuple(found)
