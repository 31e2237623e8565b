"""A second read-out path that the camera model does not have: dual gain."""

from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np

from analysis.mismatch.basefit import fit_base
from analysis.mismatch.recalibrate import with_numbers
from analysis.mismatch.state import State
from dsis.camera import Camera

_NU = 6.0
_PENALTY = 4.0  # two numbers, and the choice among the gaps


@dataclass(frozen=True)
class Path:
    """A second segment: the camera with it, its switch and error, and what it gains."""

    camera: Camera
    switch_dn: float
    error_dn: float
    gain: float


def second_path(state: State) -> Path | None:
    """Return the second segment that explains the variances best; None where levels are too few."""
    setting, calibrated = state.setting, state.calibrated
    layout, seen = setting.layout, setting.seen
    if len(calibrated.switches) > 0:
        return None
    means = sorted(
        {
            round(float(np.mean([calibrated.fit.signal_dn[e.name, c] for c in layout.channels])), 3)
            for e in layout.uniform
        }
    )
    which = [
        i
        for i, key in enumerate(state.vector.keys)
        if key.statistic == "pixel_variance" and key.scope == "exposure" and state.null.known[i]
    ]
    before = _loglik((state.vector.values[which] - state.null.mean[which]) / state.null.sd[which])
    best: Path | None = None
    for low, high in pairwise(means[1:-1]):
        switch = sqrt(max(low, high / 50) * high)
        try:
            fit = fit_base(
                layout, seen.levels, (switch,), calibrated.offsets,
                black_dn=calibrated.model.camera.black_level - layout.black_dn,
                left_out=calibrated.left_out,
            )  # fmt: skip
        except (ValueError, np.linalg.LinAlgError):
            continue
        if any(p.slope < 0 for p in fit.pieces):
            continue
        z = []
        for i in which:
            key = state.vector.keys[i]
            place = (key.exposure, key.channel)
            expected = fit.expected_dn2[place]
            if expected <= 0:
                break
            own = np.log(seen.levels[place].variance_dn2 / expected)
            z.append(own / state.null.sd[i])
        if len(z) < len(which):
            continue
        gain = _loglik(np.array(z)) - before - _PENALTY
        if best is None or gain > best.gain:
            camera = with_numbers(state.camera, fit, (switch,), layout.black_dn)
            best = Path(camera, switch, (high - low) / sqrt(12), gain)
    return best


def _loglik(z: np.ndarray) -> float:
    return float(-((_NU + 1) / 2 * np.log1p(z**2 / _NU)).sum())
