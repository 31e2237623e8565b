"""Photon transfer: the paper's camera model fitted to a recording, and EMVA 1288's figures.

Public: `fit_camera` gives a `Fit`; `write_fit` writes camera.toml, figures and numbers, `summary` a
table to read.
"""

from analysis.photon_transfer.beyond import FittedEffect
from analysis.photon_transfer.files import camera_text, fit_values, summary, write_fit
from analysis.photon_transfer.fit import ChannelFit, Fit, fit_camera
from analysis.photon_transfer.levels import FittedLevel
from analysis.photon_transfer.lines import Line
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.segments import SegmentFit, Switch, fit_segments

__all__ = [
    "ChannelFit",
    "Fit",
    "FittedEffect",
    "FittedLevel",
    "Line",
    "Quantity",
    "SegmentFit",
    "Switch",
    "camera_text",
    "fit_camera",
    "fit_segments",
    "fit_values",
    "summary",
    "write_fit",
]
