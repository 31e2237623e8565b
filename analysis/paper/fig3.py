"""Fig. 3: how the errors of two neighbouring pixels are distributed."""

from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.paper.figures.fig3 import draw_scatter
from analysis.paper.images import image, remarks
from analysis.paper.part import Part, Picture, Row
from analysis.paper.published import TABLE_1
from analysis.paper.setting import Setting
from analysis.paper.table1 import CFA, NAMES, SIGMA
from dsis.cfa import mosaic
from dsis.covariance import measured_covariance
from dsis.demosaic import demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid

Image: TypeAlias = NDArray[np.float32]

METHODS = ("none", "bilinear", "lu_tan")
CHANNELS = {"G": 1, "B": 2}
SPAN = 60.0  # codes, three standard deviations
_BINS = 81


def recompute(setting: Setting, folder: Path) -> Part:
    """Draw the 2-D histograms of right-hand neighbours' errors in green and blue."""
    clean = image(setting, 0)
    grid = PixelGrid(clean.shape[0], clean.shape[1])
    noisy = clean + np.float32(SIGMA) * Draw(setting.seed, ("fig. 3",)).normal("awgn", grid)
    noise = {
        method: _demosaicked(noisy, method) - _demosaicked(clean, method) for method in METHODS
    }
    densities = {
        (method, colour): _density(noise[method][..., channel])
        for method in METHODS
        for colour, channel in CHANNELS.items()
    }
    draw_scatter(densities, SPAN, folder / "fig3")
    rows = []
    for method in METHODS:
        moments = measured_covariance(noise[method])
        for colour, channel in CHANNELS.items():
            name = "without demosaicking" if method == "none" else NAMES[method]
            remark = "0 expected: independent"
            if method != "none":
                remark = f"Table 1 prints {TABLE_1[method][0, 1]:.4f}, all channels pooled"
            value = float(moments.of_channel(channel)[0, 1])
            rows.append(Row(f"{name}, {colour}: correlation", None, value, None, "", remark))
    name = "the first Kodak image" if setting.kodak else "the first frame of City"
    says = (
        (
            f"White noise of {SIGMA:g} codes on {name}; errors of a pixel (across) and of its "
            "right neighbour (up), as 2-D histograms. The paper shows densities only: what its "
            "picture says is the slant of the cloud, here also as a number."
        ),
        *remarks(setting),
    )
    caption = "Density of the errors of two neighbouring pixels, brighter is denser; lines: "
    caption += "one and two standard deviations of the Gaussian of the same covariance."
    return Part("fig3", "Fig. 3", says, tuple(rows), (Picture("fig3", caption),))


def _demosaicked(codes: Image, method: str) -> Image:
    if method == "none":
        return codes
    return demosaic(mosaic(codes, CFA), CFA, method, full_scale=255.0)


def _density(noise: Image) -> NDArray[np.float64]:
    """Return the density of (error, error of the right neighbour), per code squared."""
    edges = np.linspace(-SPAN, SPAN, _BINS + 1)
    here, right = noise[:, :-1].ravel(), noise[:, 1:].ravel()
    density, _, _ = np.histogram2d(right, here, [edges, edges], density=True)
    return density
