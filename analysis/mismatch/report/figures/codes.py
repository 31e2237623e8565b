"""How often each code occurs: coarse steps and unequal widths."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from analysis.figures import ALARM, COLOURS
from analysis.mismatch.evidence import Histogram

SIZE_INCHES = (9.6, 3.0)
_AROUND = 32  # codes shown on either side of the median


def draw(figure: Figure, histograms: Sequence[Histogram]) -> None:
    """Draw the counts of the codes around the median, a panel per channel; lines: the models."""
    panels = np.ravel(figure.subplots(1, len(histograms), squeeze=False))
    for axes, one in zip(panels, histograms, strict=True):
        part = _middle(one.counts)
        codes = one.lowest + np.arange(one.counts.size)[part]
        axes.bar(codes, one.counts[part], 0.85, color="#b9c2cb", label="recorded")
        models = (
            (one.before, ALARM, "base model"),
            (one.after, COLOURS[0], "physics named, another sensor"),
        )
        for counts, colour, label in models:
            if counts is not None:
                axes.step(codes, counts[part], where="mid", color=colour, lw=1.2, label=label)
        axes.set_xlabel("code, DN")
        of = "" if one.channel in ("", "MONO") else f"{one.channel}: "
        axes.set_title(f"{of}codes around the median", loc="left")
    panels[0].set_ylabel("samples")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=3)


def _middle(counts: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> slice:
    median = int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))
    return slice(max(median - _AROUND, 0), median + _AROUND + 1)
