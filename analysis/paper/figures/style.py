"""What the figures of the paper's page share: how they are begun and saved."""

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from analysis.figures import STYLE, save


def draw(
    path: Path,
    title: str,
    size_inch: tuple[float, float],
    fill: Callable[[Figure], None],
    simulated_share: float = 0.0,
) -> None:
    """Write `path`.svg and .png of a figure that `fill` draws into; the same call, the same bytes.

    With a share of simulated votes above 0 the figure says so across it.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size_inch, layout="constrained")
        fill(figure)
        save(figure, title, simulated_share, path)
