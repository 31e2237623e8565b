"""Numbers at logarithmic axes: plain ones, for the style of figures draws no mathematics."""

from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, NullFormatter

from analysis.mismatch.report.numbers import plain


def plain_numbers(axis: Axis) -> None:
    """Label the decades of an axis, and nothing between them."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axis.set_minor_formatter(NullFormatter())
