"""Fig. 4 and Fig. 5: frames and crops, pixel for pixel."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.paper.figures.style import draw

Codes = NDArray[np.uint8]


def draw_frames(frames: Mapping[str, Codes], path: Path) -> None:
    """Show frames side by side, each under its name."""
    _draw(frames, path, "Reference frames", 5.0)


def draw_crops(crops: Mapping[str, Codes], path: Path) -> None:
    """Show the crops of each kind of noise side by side."""
    _draw(crops, path, "Noisy crops and scaled differences", 4.6)


def _draw(pictures: Mapping[str, Codes], path: Path, title: str, width_inch: float) -> None:
    shape = next(iter(pictures.values())).shape

    def fill(figure: Figure) -> None:
        panels = np.ravel(figure.subplots(1, len(pictures), squeeze=False))
        for axes, (name, picture) in zip(panels, pictures.items(), strict=True):
            axes.imshow(picture, interpolation="nearest")
            axes.set_title(name, loc="left")
            axes.set_axis_off()

    size = (width_inch * len(pictures), width_inch * shape[0] / shape[1] + 0.35)
    draw(path, title, size, fill)
