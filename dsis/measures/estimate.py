"""A measured value with its errors."""

from math import inf, isfinite, nan
from typing import NamedTuple


class Estimate(NamedTuple):
    """A measured value, its standard error, and what the base model alone would give.

    Two errors are needed, for an error taken from the data grows with what it should detect: with T
    frames no frame variance could ever stand sqrt(T/2) of its own errors above zero.

    Attributes
    ----------
    value
        In the unit of the measure; nan where the recording cannot tell (too few frames, no noise).
    standard_error
        Standard deviation of `value` about the truth, whatever that is; its square is unbiased.
        inf where `value` is nan.
    null_value
        Expected value where all noise is white, Gaussian and fixed patterns are absent; nan for
        measures of the base model's own numbers (level, pixel variance).
    null_error
        Standard deviation of `value` in that case: the denominator of a test.
    """

    value: float
    standard_error: float
    null_value: float = nan
    null_error: float = nan

    @property
    def known(self) -> bool:
        """Whether the recording could tell."""
        return isfinite(self.value) and isfinite(self.standard_error)

    @property
    def departure(self) -> float:
        """(value - null_value) / null_error: standard normal where nothing is there."""
        return (self.value - self.null_value) / self.null_error


def unknown(null_value: float = nan) -> Estimate:
    """Return the estimate of what a recording cannot tell."""
    return Estimate(nan, inf, null_value, inf)


def estimate(value: float, variance: float, null_value: float, null_variance: float) -> Estimate:
    """Return an estimate from variances; unknown where one of the numbers is not finite."""
    if not (isfinite(value) and isfinite(variance) and isfinite(null_variance)):
        return unknown(null_value)
    error = float(variance) ** 0.5 if variance > 0 else 0.0
    return Estimate(float(value), error, null_value, float(null_variance) ** 0.5)
