"""Coefficients of unweighted straight lines, as EMVA 1288 draws them, with errors that hold.

The levels' scatter about a line tells little where there are few of them, and nothing where they
are as many as the coefficients: what is known of every level beforehand, from the number of its
samples, is propagated through the same fit. Scatter beyond that is real - light that drifts, a
response that bends - and then it is the scatter that counts, with Student's factor for how few
levels show it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from analysis.photon_transfer.black import P_SCALED

Floats = NDArray[np.float64]

_TWO_SIGMA = float(stats.norm.cdf(2.0))  # errors are for intervals of two of them


@dataclass(frozen=True)
class Estimate:
    """A weighted sum of measured values.

    Attributes
    ----------
    value, standard_error
        The sum, and its error.
    shares
        The weight of each value.
    """

    value: float
    standard_error: float
    shares: Floats


def first_coefficient(design: Floats, y: Floats, covariance: Floats) -> Estimate:
    """Return the first coefficient of the unweighted least-squares fit of `y`.

    Parameters
    ----------
    design
        One row for each value, one column for each coefficient, all independent.
    y
        The values.
    covariance
        Their covariance, of sampling alone.

    Its error is the propagated one, or that of the scatter where this is larger: HC2 (MacKinnon &
    White, Journal of Econometrics 29, 1985), by which no variance is taken to be equal. Where the
    scatter is too large for chance, the latter gets Student's factor for the degrees of freedom of
    Bell & McCaffrey (Survey Methodology 28, 2002), which a level that decides the line makes few.
    """
    shares = np.linalg.pinv(design)[0]
    sampled = float(np.sqrt(max(shares @ covariance @ shares, 0.0)))
    value = float(shares @ y)
    if y.size <= design.shape[1]:
        return Estimate(value, sampled, shares)
    onto = design @ np.linalg.pinv(design)
    kept = np.eye(y.size) - onto
    # A level that alone decides the line keeps nothing of its own scatter.
    weights = shares**2 / np.maximum(np.diag(kept), 1e-12)
    scattered = float(np.sqrt(weights @ (kept @ y) ** 2))
    if scattered > 0 and _rare(design, y, covariance):
        spread = kept @ (weights[:, None] * kept)
        freedom = float(np.trace(spread) ** 2 / (spread * spread.T).sum())
        scattered *= float(stats.t.ppf(_TWO_SIGMA, freedom)) / 2
    return Estimate(value, max(sampled, scattered), shares)


def _rare(design: Floats, y: Floats, covariance: Floats) -> bool:
    """Tell whether the values scatter about the line more than sampling alone makes them."""
    least = 1e-12 * max(float(np.trace(covariance)), 1e-12)  # for values without any noise
    root = np.linalg.cholesky(covariance + least * np.eye(y.size))
    whitened, seen = np.linalg.solve(root, design), np.linalg.solve(root, y)
    left = seen - whitened @ np.linalg.lstsq(whitened, seen, rcond=None)[0]
    return bool(stats.chi2.sf(float(left @ left), y.size - design.shape[1]) < P_SCALED)
