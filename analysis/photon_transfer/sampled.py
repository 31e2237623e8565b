"""Coefficients of unweighted straight lines, as EMVA 1288 draws them, with errors that hold.

The levels' scatter about a line tells little where there are few of them, and nothing where they
are as many as the coefficients: what is known of every level beforehand, from the number of its
samples, is propagated through the same fit. Scatter beyond that is real - light that drifts, a
response that bends - and what it adds is stated too, with Student's factor for how few levels show
it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

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

    The variance is the propagated one, and what the scatter has beyond it. The scatter is told by
    HC2 (MacKinnon & White, Journal of Econometrics 29, 1985), by which no variance is taken to be
    equal; what sampling alone makes of it is taken off, not below nought. No test decides whether
    the rest is real: few levels show scatter of a few times sampling too rarely. The rest gets
    Student's factor for the degrees of freedom of Bell & McCaffrey (Survey Methodology 28, 2002),
    which a level that decides the line makes few.
    """
    scale = np.abs(design).max(0)
    scale[scale == 0] = 1.0  # units of light are anyone's: squares of their shares may overflow
    design = design / scale
    back = np.linalg.pinv(design)
    shares = back[0]
    variance = max(float(shares @ covariance @ shares), 0.0)
    if y.size > design.shape[1]:
        kept = np.eye(y.size) - design @ back
        variance += _excess(shares, kept, y, covariance)
    unit = scale[0]
    return Estimate(float(shares @ y) / unit, float(np.sqrt(variance)) / unit, shares / unit)


def _excess(shares: Floats, kept: Floats, y: Floats, covariance: Floats) -> float:
    """Return the variance by scatter beyond sampling, times the square of Student's factor."""
    # A level that alone decides the line keeps nothing of its own scatter.
    weights = shares**2 / np.maximum(np.diag(kept), 1e-12)
    seen = float(weights @ (kept @ y) ** 2)
    spread = kept @ (weights[:, None] * kept)
    expected, freedom = _chi_square(spread @ covariance)
    if expected > 0:
        # Its median: of few degrees of freedom most draws lie below the mean, by which real
        # scatter would be lost.
        expected *= float(stats.chi2.median(freedom)) / freedom
    if seen <= expected:
        return 0.0
    factor = float(stats.t.ppf(_TWO_SIGMA, _chi_square(spread)[1])) / 2
    return factor**2 * (seen - expected)


def _chi_square(spread: Floats) -> tuple[float, float]:
    """Return the mean and degrees of freedom of the chi-square like a quadratic form's draws."""
    mean, square = float(np.trace(spread)), float((spread * spread.T).sum())
    return mean, mean**2 / square if square > 0 else 1.0
