"""Black level and dark current of one channel: the mean of darks against exposure time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

P_SCALED = 0.01  # scatter rarer than this is real: errors are scaled by it


@dataclass(frozen=True)
class DarkLine:
    """A straight line through dark means (DN) against exposure time, black level its start.

    Attributes
    ----------
    black_dn, black_se_dn
        Mean code at zero exposure time.
    current_dn_per_s, current_se_dn_per_s
        Growth with exposure time; None where the exposure times do not tell.
    chi2, dof
        Scatter about the line; the errors are scaled by it where it is too large for chance.
    """

    black_dn: float
    black_se_dn: float
    current_dn_per_s: float | None
    current_se_dn_per_s: float | None
    chi2: float
    dof: int

    def at(self, exposure_time_s: float) -> float:
        """Return the dark mean at an exposure time, DN."""
        return self.black_dn + (self.current_dn_per_s or 0.0) * exposure_time_s


def dark_line(
    times_s: Sequence[float], levels_dn: Sequence[float], errors_dn: Sequence[float]
) -> DarkLine:
    """Return the weighted least-squares line; a constant where there are fewer than three times.

    With two exposure times a line fits whatever the darks did; they count as one level each, so a
    current is stated from three times on, as EMVA 1288 (section 7) asks.
    """
    t, y = np.asarray(times_s, float), np.asarray(levels_dn, float)
    error = np.maximum(np.asarray(errors_dn, float), 1e-9)
    line = len(set(times_s)) >= 3
    design = np.stack([np.ones_like(t), t], 1) if line else np.ones((t.size, 1))
    scale = np.array([1.0, max(float(np.abs(t).max()), 1e-30)])[: design.shape[1]]
    whitened = design / scale / error[:, None]
    solution, *_ = np.linalg.lstsq(whitened, y / error, rcond=None)
    covariance = np.linalg.inv(whitened.T @ whitened)
    chi2 = float(((y / error - whitened @ solution) ** 2).sum())
    dof = t.size - design.shape[1]
    if dof > 0 and stats.chi2.sf(chi2, dof) < P_SCALED:
        covariance *= chi2 / dof
    value, sd = solution / scale, np.sqrt(np.diag(covariance)) / scale
    current = float(value[1]) if line else None
    current_se = float(sd[1]) if line else None
    return DarkLine(float(value[0]), float(sd[0]), current, current_se, chi2, dof)
