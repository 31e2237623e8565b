"""Fig. 5: crops of noisy frames over their scaled differences from the reference."""

from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.paper.figures.frames import draw_crops
from analysis.paper.part import Part, Picture, Row
from analysis.paper.scene import scene
from analysis.paper.setting import Setting
from dsis.covariance import measured_covariance
from dsis.stimuli.figure import GAIN, OFFSET, fig5
from dsis.stimuli.quality import delivered, psnr_db

Image: TypeAlias = NDArray[np.float32]

METHOD = "bilinear"
NOISES = {"sd": "signal-dependent camera noise", "awgn": "white Gaussian noise"}


def recompute(setting: Setting, folder: Path) -> Part:
    """Draw the crops for camera noise and for white noise, and measure the grain."""
    city = scene("city", setting, 1)
    clean = city.clean(0)
    reference = city.rendering.reference(clean)
    white, noisy = city.white(reference, 0), city.noisy(clean, 0)
    make = city.rendering
    frames = {
        "sd": (make.display(noisy), make.display_demosaicked(noisy, METHOD)),
        "awgn": (white, city.white_demosaicked(white, METHOD)),
    }
    crops, rows = {}, []
    for noise, (rgb, dem) in frames.items():
        crops[NOISES[noise]] = fig5({"reference": reference, "none": rgb, METHOD: dem})
        grain = [_neighbours(shown, reference) for shown in (rgb, dem)]
        remark = f'"structured and of coarser grain": from {grain[0]:.3f} without'
        what = f"{NOISES[noise]}: correlation of I_d with its right neighbour, demosaicked"
        rows.append(Row(what, None, grain[1], None, "", remark))
        quality = [psnr_db(delivered(shown), delivered(reference)) for shown in (rgb, dem)]
        says = f"without demosaicking {quality[0]:.2f} dB"
        rows.append(Row(f"{NOISES[noise]}: PSNR, demosaicked", None, quality[1], None, "dB", says))
    draw_crops(crops, folder / "fig5")
    caption = (
        "Crops from the middle of City, 128 x 128 pixels: noisy (left) and noisy with bilinear "
        f"demosaicking (right); below, the difference from the reference, I_d x {GAIN} + {OFFSET}."
    )
    about = (
        "The paper shows one crop of its own City; the crops here are of the City of dsis with "
        "the paper's noise levels (31.51 and 35.51 dB without demosaicking)."
    )
    return Part("fig5", "Fig. 5", (about,), tuple(rows), (Picture("fig5", caption),))


def _neighbours(shown: Image, reference: Image) -> float:
    """Return the pooled correlation of the difference image with its right neighbour."""
    return float(measured_covariance(shown - reference).pooled()[0, 1])
