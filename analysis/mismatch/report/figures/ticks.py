"""Ticks with plain numbers, for the style of figures draws no mathematics."""

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from analysis.mismatch.report.numbers import plain

_MOST = 5  # ticks on either side of 0


def plain_numbers(axis: Axis) -> None:
    """Label the decades of an axis, and nothing between them."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axis.set_minor_formatter(NullFormatter())


def symmetric_scale(axes: Axes, low: float, high: float, linear: float) -> None:
    """Make y linear within +-`linear` and logarithmic beyond, from `low` to `high`; say so."""
    axes.set_yscale("symlog", linthresh=linear)
    axes.set_ylim(low, high)
    steps = [10.0**e * step for e in range(-12, 13) for step in (1, 3)]
    seen = [step for step in steps if 0.3 * linear <= step <= max(-low, high)]
    while len(seen) > _MOST:
        seen = seen[-1::-2][::-1]
    ticks = [0.0, *seen, *(-step for step in seen)]
    axes.yaxis.set_major_locator(FixedLocator([t for t in ticks if low <= t <= high]))
    axes.yaxis.set_minor_locator(NullLocator())
    plain_numbers(axes.yaxis)
    axes.set_ylabel(f"{axes.get_ylabel()}\nlogarithmic beyond ±{plain(linear)}")
