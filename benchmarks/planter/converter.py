"""Mechanisms of the converter and of what a camera does after it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from planter.charge import from_neighbours
from planter.view import Image, Mechanism, View

PINNED = 129  # codes


def spatial_filtering(signal: Image, p: Mapping[str, Any], view: View) -> Image:
    """Smooth over the four nearest pixels of the same colour."""
    step = 1 if view.case.cfa == "MONO" else 2
    return signal + np.float32(p["fraction"]) * from_neighbours(signal, step=step)


def code_edges(view: View, p: Mapping[str, Any]) -> np.ndarray:
    """Return the lower edges of codes 1, 2 ... of a converter whose widths scatter by `rms_lsb`.

    "edges": each edge moves on its own by rms / sqrt(2), so neighbouring widths are opposed.
    "widths": each width is its own; what piles up over `PINNED` codes is calibrated away.
    """
    codes = np.arange(1, view.case.white_level + 1)
    moved = p["rms_lsb"] * view.of_sensor("adc_dnl").standard_normal(codes.size)
    if p.get("law", "edges") == "widths":
        walk = np.cumsum(moved)
        moved = walk - uniform_filter1d(walk, PINNED)
    else:
        moved /= np.sqrt(2)
    return np.sort(codes - 0.5 + moved)


def converted(signal: Image, view: View) -> np.ndarray:
    """Return whole codes of a signal above black, uint16."""
    analogue = signal + np.float32(view.case.black_level)
    unequal, coarse = view.case.planted("adc_dnl"), view.case.planted("quantisation")
    if unequal is not None:
        codes = np.searchsorted(code_edges(view, unequal), analogue, side="right")
    elif coarse is not None:
        step = coarse["step_dn"]
        codes = step * np.rint(analogue / step)
        codes = np.minimum(codes, view.case.white_level // step * step)
    else:
        codes = np.rint(analogue)
    return np.clip(codes, 0, view.case.white_level).astype(np.uint16)


AFTER: dict[str, Mechanism] = {"spatial_filtering": spatial_filtering}
