"""Fig. 3: 2-D histograms of neighbouring errors."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.paper.figures.style import draw

TITLES = {"none": "(a) no demosaicking", "bilinear": "(b) bilinear", "lu_tan": "(c) Lu-Tan"}


def draw_scatter(
    densities: Mapping[tuple[str, str], NDArray[np.float64]], span: float, path: Path
) -> None:
    """Draw a panel for each (method, channel): density on a square of +-span codes."""
    top = max(float(density.max()) for density in densities.values())

    def fill(figure: Figure) -> None:
        panels = figure.subplots(2, len(densities) // 2, sharex=True, sharey=True)
        for axes, ((method, colour), density) in zip(panels.T.flat, densities.items(), strict=True):
            shown = axes.imshow(
                density,
                origin="lower",
                extent=(-span, span, -span, span),
                vmin=0,
                vmax=top,
                cmap="viridis",
                interpolation="nearest",
            )
            _ellipses(axes, density, span)
            axes.set_title(f"{TITLES[method]}, {colour}", loc="left", fontsize=8.5)
        for axes in panels[1]:
            axes.set_xlabel("error, codes")
        for axes in panels[:, 0]:
            axes.set_ylabel("error of the\nright neighbour")
        figure.colorbar(shown, ax=panels, shrink=0.7, label="density, 1/code²")

    draw(path, "Errors of neighbouring pixels", (8.6, 5.2), fill)


def _ellipses(axes: Axes, density: NDArray[np.float64], span: float) -> None:
    """Draw one and two standard deviations of the Gaussian with the covariance of a density."""
    middle = (np.arange(len(density)) + 0.5) * 2 * span / len(density) - span
    share = density / density.sum()
    x, y = np.meshgrid(middle, middle)
    covariance = np.array([[(share * a * b).sum() for b in (x, y)] for a in (x, y)])
    turn = np.linspace(0, 2 * np.pi, 181)
    circle = np.linalg.cholesky(covariance) @ np.stack([np.cos(turn), np.sin(turn)])
    for radius in (1, 2):
        axes.plot(*(radius * circle), color="white", lw=0.7, alpha=0.9)
    axes.set_xlim(-span, span)
    axes.set_ylim(-span, span)
