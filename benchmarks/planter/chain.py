"""The mechanisms in the order in which light and charge meet them: one frame of codes."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planter.case import Case
from planter.charge import NEIGHBOURS, WELLS, counted
from planter.converter import AFTER, converted
from planter.light import LIGHT, clean_signal
from planter.offsets import OFFSETS
from planter.readout import AMPLIFIERS, MEMORY, PIXELS, read
from planter.view import Image, Mechanism, View

KINDS = frozenset(
    {
        *LIGHT,
        *NEIGHBOURS,
        *WELLS,
        *AMPLIFIERS,
        *PIXELS,
        *OFFSETS,
        *MEMORY,
        *AFTER,
        # Those that change a law of the base model instead of adding a step:
        "dual_gain",
        "poisson_shot_noise",
        "heavy_tailed_read_noise",
        "read_noise_spread",
        "image_lag",
        "quantisation",
        "adc_dnl",
    }
)


def frame_codes(case: Case, exposure: int, frame: int) -> np.ndarray:
    """Return one frame, uint16 (row, column)."""
    view, charge = _collected(View(case, exposure, frame))
    lag = case.planted("image_lag")
    if lag is not None:
        _, before = _collected(View(case, exposure, frame - 1))
        charge = (1 - lag["fraction"]) * charge + lag["fraction"] * before
        charge = charge.astype(np.float32)
    signal = _amplified(charge, view)
    signal = through(OFFSETS, through(PIXELS, read(signal, view), view), view)
    # What is noise to a memory is beyond what wells and amplifiers make of the expected charge.
    steady = replace(view, expected=_amplified(view.expected, view))
    signal = through(AFTER, through(MEMORY, signal, steady), view)
    return converted(signal, view)


def _amplified(charge: Image, view: View) -> Image:
    return through(AMPLIFIERS, through(WELLS, charge, view), view)


def stack(case: Case, exposure: int) -> np.ndarray:
    """Return all frames of an exposure, uint16 (frame, row, column)."""
    frames = range(case.exposures[exposure].frames)
    return np.stack([frame_codes(case, exposure, frame) for frame in frames])


def _collected(view: View) -> tuple[View, Image]:
    """Return the view with its expected signal, and the charge with shot noise."""
    expected = through(LIGHT, clean_signal(view), view)
    view = replace(view, expected=expected)
    return view, through(NEIGHBOURS, counted(expected, view), view)


def through(steps: Mapping[str, Mechanism], image: Image, view: View) -> Image:
    """Return what the planted mechanisms among some make of an image."""
    for kind, step in steps.items():
        parameters = view.case.planted(kind)
        if parameters is not None:
            image = step(image, parameters, view)
    return image
