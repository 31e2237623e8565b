"""Numbers as a report prints them: as many digits as their error leaves, a typographic minus."""

from math import floor, isfinite, isnan, log10

DASH = "\u2013"
_MOST_DECIMALS, _SMALL = 6, 0.01


def plain(value: float | None, digits: int = 3) -> str:
    """Return a number of so many significant digits; a dash where there is none."""
    if value is None or isnan(value):
        return DASH
    if not isfinite(value):
        return "\u2212\u221e" if value < 0 else "\u221e"
    text = f"{value:.{digits}g}"
    if "e" in text and 1 <= abs(value) < 1e9:
        text = f"{value:.0f}"
    return text.replace("-", "\u2212")


def measured(value: float, standard_error: float) -> str:
    """Return value ± standard error, rounded to two digits of the error; 0: an exact value."""
    if standard_error == 0:
        return plain(value, 4)
    if not (isfinite(value) and isfinite(standard_error)):
        return f"{plain(value, 4)} ± {DASH}"
    decimals = 1 - floor(log10(standard_error))
    if decimals > _MOST_DECIMALS and abs(value) < _SMALL:  # 0.000012 ± 0.000003 is 1.2e-05
        return f"{plain(value, 4)} ± {plain(standard_error, 2)}"
    return f"{_rounded(value, decimals)} ± {_rounded(standard_error, decimals)}"


def interval(low: float, high: float) -> str:
    """Return an interval, its ends to three digits."""
    return f"{plain(low)} … {plain(high)}"


def _rounded(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.replace("-", "\u2212")
