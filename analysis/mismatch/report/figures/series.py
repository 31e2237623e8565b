"""Means of whole frames in the order recorded: drift and flicker."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from analysis.figures import ALARM, COLOURS, GREY, INK
from analysis.figures_camera import CHANNEL_COLOURS
from analysis.mismatch.evidence import Series

SIZE_INCHES = (9.6, 2.9)
_SPREAD = 2.0  # standard deviations: the bands


def draw(figure: Figure, shown: Mapping[str, Sequence[Series]]) -> None:
    """Draw frame means less their mean, a panel per exposure; hollow: locked for the proof.

    Frames that were not looked at are left out.
    """
    panels = np.ravel(figure.subplots(1, len(shown), squeeze=False))
    for axes, (name, channels) in zip(panels, shown.items(), strict=True):
        for one in channels:
            _series(axes, one)
        _bands(axes, channels[0])
        by_frame(axes, name)
    panels[0].set_ylabel("frame mean less its mean, DN")
    handles = panels[-1].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=min(len(handles[0]), 6))


def by_frame(axes: Axes, title: str) -> None:
    """Let a panel have a title, and frames along its axis."""
    axes.set_title(title, loc="left")
    axes.set_xlabel("frame")
    axes.xaxis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 2.5, 5, 10], integer=True))
    axes.grid(visible=True)
    axes.set_axisbelow(True)


def _series(axes: Axes, one: Series) -> None:
    mono = one.channel in ("", "MONO")
    colour = INK if mono else CHANNEL_COLOURS.get(one.channel, INK)
    seen = np.isfinite(one.frame_means_dn)
    numbers = np.flatnonzero(seen)
    means = one.frame_means_dn[seen] - one.frame_means_dn[seen].mean()
    locked = np.isin(numbers, one.locked)
    axes.plot(numbers, means, color=colour, lw=0.7, alpha=0.6)
    label = "frames searched" if mono else one.channel
    axes.plot(numbers[~locked], means[~locked], "o", color=colour, ms=3.8, label=label)
    if not locked.any():
        return
    label = "locked for the proof" if mono else f"_{one.channel}"
    axes.plot(numbers[locked], means[locked], "o", mfc="white", mec=colour, ms=3.8, label=label)


def _bands(axes: Axes, one: Series) -> None:
    axes.axhline(0, color=GREY, lw=0.8, zorder=0)
    if one.sd_before_dn is not None:
        reach = _SPREAD * one.sd_before_dn
        axes.axhspan(-reach, reach, color=ALARM, alpha=0.22, lw=0, label="base model, ± 2 sd")
    if one.sd_after_dn is not None:
        reach = _SPREAD * one.sd_after_dn
        axes.axhline(reach, color=COLOURS[0], ls=(0, (5, 3)), lw=1.1, label="physics named, ± 2 sd")
        axes.axhline(-reach, color=COLOURS[0], ls=(0, (5, 3)), lw=1.1)
