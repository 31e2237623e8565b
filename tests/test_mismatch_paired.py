"""Frames of which every second repeats some of the one before are no image lag.

Recordings are numpy's noise; nothing of them is made by the effects.
"""

from dataclasses import replace

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

BLACK, SLOPE, INTERCEPT = 64.0, 0.5, 20.0  # DN, DN, DN^2
BASE = camera(segments=((SLOPE, INTERCEPT, None),), black=BLACK)
WORDS = frozenset({"image_lag"})
SHARED = 0.12


def recording(*, paired: bool) -> InMemory:
    """Return frames that share with the one before: every second noise, or each charge."""
    draws = np.random.default_rng(6)
    like = recorded(BASE, 1, rows=64, columns=80, levels=(250.0, 900.0))
    assert like.stacks is not None
    stacks = {}
    for exposure in like.exposures:
        signal = exposure.light or 0.0
        white = draws.standard_normal((9, 64, 80))
        if paired:
            noise = white[1:].copy()
            noise[1::2] = SHARED * white[1::2] + (1 - SHARED**2) ** 0.5 * white[2::2]
        else:
            charge = (1 - SHARED) * white[1:] + SHARED * white[:-1]
            charge /= ((1 - SHARED) ** 2 + SHARED**2) ** 0.5
            read = draws.standard_normal(charge.shape)  # darks keep nothing
            noise = charge * np.sqrt(SLOPE * signal) + read * np.sqrt(INTERCEPT)
            noise /= np.sqrt(SLOPE * signal + INTERCEPT)
        sd = np.sqrt(SLOPE * signal + INTERCEPT)
        stacks[exposure.name] = np.rint(BLACK + signal + noise * sd).astype(np.uint16)
    return replace(like, stacks=stacks)


@pytest.mark.parametrize("paired", [True, False])
def test_what_every_second_frame_shares_is_no_lag(*, paired: bool) -> None:
    found = find_mismatch(BASE, recording(paired=paired), seed=1, vocabulary=WORDS)
    assert [one.effect for one in found.omitted_physics] == ([] if paired else ["image_lag"])
    if paired:
        assert "frame_correlation" in {one.statistic for one in found.unexplained}
        assert any("image_lag: every second frame shares more" in one for one in found.remarks)
