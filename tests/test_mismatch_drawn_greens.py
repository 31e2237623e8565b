"""Greens that chance draws unequal: the gains of lines scatter their ratio from sensor to sensor.

Of C columns each green has half, whose gains scatter by s: ln(Gr / Gb) has 4 s^2 / C, the same at
all levels, beside the noise of the frames.
"""

import numpy as np
import pytest

from analysis.mismatch.vector import RELATIVE_RATIO
from dsis.effects import registry
from mismatch_recordings import COLUMNS, LEVELS, ROWS, camera, recorded, state_of

FRAMES = 6  # that are not locked
SLOPE, INTERCEPT = 0.5, 20.0  # of the camera's variance, DN and DN^2


@pytest.mark.parametrize("percent", [0.0, 0.1, 1.0])
def test_the_null_knows_how_far_lines_of_unequal_gain_set_greens_apart(percent: float) -> None:
    lines = (registry()["column_prnu"](sigma_percent=percent),) if percent else ()
    model = camera(*lines, cfa="RGGB")
    state = state_of(recorded(model, 3), model)
    drawn = 4 * (percent / 100) ** 2 / COLUMNS
    level = np.array(LEVELS)
    noise = (SLOPE * level + INTERCEPT + 1 / 12) / (ROWS * COLUMNS / 4 * FRAMES) / level**2
    expected = np.sqrt(2 * noise + drawn + RELATIVE_RATIO**2)
    keys = [(key.statistic, key.scope, key.detail) for key in state.null.keys]
    single = [i for i, key in enumerate(keys) if key[:2] == ("channel_ratio", "exposure")]
    assert state.null.sd[single] == pytest.approx(expected, rel=0.35)
    row = keys.index(("channel_ratio", "contrast", "at all levels"))
    weights = 1 / expected / np.linalg.norm(1 / expected)
    shared = np.sqrt(drawn) / expected
    together = 1 + (weights @ shared) ** 2 - weights**2 @ shared**2
    sd = state.null.contrast_sd[row - state.null.mean.size]
    assert sd == pytest.approx(np.sqrt(together), rel=0.3)
    assert (sd > 1.8) == (percent > 0.5)
