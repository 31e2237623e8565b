"""Noise that is larger in one part of the sensor is no noise of single pixels.

Recordings are numpy's noise; nothing of them is made by the effects.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
BLACK, SLOPE, INTERCEPT = 64.0, 0.5, 40.0  # DN, DN, DN^2
LEVELS = (250.0, 900.0)
BASE = camera(segments=((SLOPE, INTERCEPT, None),), black=BLACK)
Y, X = np.mgrid[-1:1:64j, -1:1:80j]
DRAWS = np.random.default_rng(8)
# Read noise relative to its usual; each has a mean square near one.
NOISE = {
    "place": 0.9 + 0.3 * (Y**2 + X**2) / 2,
    "column": np.repeat(np.exp(0.12 * DRAWS.standard_normal((1, 80))), 64, 0),
}
WORDS = frozenset({"read_noise_spread", "rts"})


def noisy(read: Array, light: Array | float = 1.0) -> InMemory:
    """Return noise of the base model, the read noise of each pixel its own."""
    draws = np.random.default_rng(5)
    like = recorded(BASE, 1, rows=64, columns=80, levels=LEVELS)
    assert like.stacks is not None
    stacks = {}
    for exposure in like.exposures:
        signal = (exposure.light or 0.0) * light
        noise = draws.standard_normal(like.stacks[exposure.name].shape)
        sd = np.sqrt(SLOPE * signal + INTERCEPT * (read**2 / (read**2).mean()))
        stacks[exposure.name] = np.rint(BLACK + signal + noise * sd).astype(np.uint16)
    return replace(like, stacks=stacks)


@pytest.mark.parametrize("where", ["place", "column"])
def test_noise_of_a_place_stays_unexplained(where: str) -> None:
    found = find_mismatch(BASE, noisy(NOISE[where]), seed=1, vocabulary=WORDS)
    assert found.omitted_physics == ()
    assert "variance_persistence" in {one.statistic for one in found.unexplained}
    assert any(f"pixels of one {where} are noisy alike" in one for one in found.remarks)


def test_noise_of_pixels_is_named() -> None:
    """Light that falls off by 30 % makes shot noise a matter of place as well."""
    spread = np.exp(0.15 * np.random.default_rng(2).standard_normal((64, 80)))
    light = 1 - 0.3 * (Y**2 + X**2) / 2
    recording = noisy(spread, light / light.mean())
    found = find_mismatch(BASE, recording, seed=1, vocabulary=WORDS | {"shading"})
    assert "read_noise_spread" in [one.effect for one in found.omitted_physics]
