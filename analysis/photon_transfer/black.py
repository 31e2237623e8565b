"""Black level and dark current of one channel: the mean of darks against exposure time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
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


def dark_line(times_s: ArrayLike, levels_dn: ArrayLike, errors_dn: ArrayLike) -> DarkLine:
    """Return the weighted least-squares line; a constant where there are fewer than three times.

    With two exposure times a line fits whatever the darks did; they count as one level each, so a
    current is stated from three times on, as EMVA 1288 (section 7) asks.
    """
    t, y = np.asarray(times_s, float), np.asarray(levels_dn, float)
    error = np.maximum(np.asarray(errors_dn, float), 1e-9)
    design = dark_design(t, t)
    line = design.shape[1] > 1
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


def dark_design(times_s: ArrayLike, at_s: ArrayLike) -> NDArray[np.float64]:
    """Return what black level and dark current count at some times, for darks of `times_s`.

    A row for each of `at_s`; the column of the current is there from three times of darks on.
    """
    at = np.asarray(at_s, float)
    line = np.unique(np.asarray(times_s, float)).size >= 3
    return np.stack([np.ones_like(at), at], 1) if line else np.ones((at.size, 1))


def dark_shares(times_s: ArrayLike, errors_dn: ArrayLike, at_s: ArrayLike) -> NDArray[np.float64]:
    """Return what each dark counts in the value of `dark_line` at some times; (time, dark)."""
    error = np.maximum(np.asarray(errors_dn, float), 1e-9)
    design = dark_design(times_s, times_s)
    scale = np.maximum(np.abs(design).max(0), 1e-30)
    solve = np.linalg.pinv(design / scale / error[:, None]) / error
    return np.asarray(dark_design(times_s, at_s) / scale @ solve)
