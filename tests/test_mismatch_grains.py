"""Light that interferes in grains bends variances, and is no second read-out path.

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
LEVELS = (100.0, 250.0, 500.0, 900.0, 1600.0, 2600.0)


def speckled(contrast: float) -> InMemory:
    """Return noise of the base model in light that grains of 2 x 2 pixels modulate anew."""
    draws = np.random.default_rng(6)
    like = recorded(BASE, 1, rows=64, columns=80, levels=LEVELS)
    assert like.stacks is not None
    stacks = {}
    for exposure in like.exposures:
        frames = like.stacks[exposure.name].shape[0]
        white = draws.standard_normal((frames, 65, 81))
        grains = (white[:, 1:] + white[:, :-1])[:, :, 1:] + (white[:, 1:] + white[:, :-1])[
            :, :, :-1
        ]
        signal = (exposure.light or 0.0) * (1 + contrast * grains / 2)
        noise = draws.standard_normal(signal.shape) * np.sqrt(SLOPE * signal + INTERCEPT)
        stacks[exposure.name] = np.rint(BLACK + signal + noise).astype(np.uint16)
    return replace(like, stacks=stacks)


def test_grains_are_no_second_path_and_no_crosstalk() -> None:
    """At 2600 DN they add a third to the variance."""
    words = frozenset({"crosstalk", "dual_gain", "dual_gain_mismatch", "nonlinearity"})
    found = find_mismatch(BASE, speckled(0.008), seed=1, vocabulary=words)
    assert found.omitted_physics == ()
    left = {one.statistic for one in found.unexplained}
    assert {"correlation_0_1", "pixel_variance"} <= left
