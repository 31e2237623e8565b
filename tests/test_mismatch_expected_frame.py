"""The expected frame that maps are freed from is what the camera makes of light without noise."""

import numpy as np
import pytest

from analysis.mismatch.gainmap import mean_frame
from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.effects import Effect
from dsis.grid import PixelGrid
from exposing import camera, effect

MEMORY = effect("readout_memory", fraction=0.3, lag_pixels=3, along="columns")


@pytest.mark.parametrize(
    "response",
    [
        effect("nonlinearity", percent_full_scale=-3.0),
        effect("saturation", full_well_dn=1500.0, softness_dn=400.0),
        effect("tap_mismatch", gain_percent=2.0, regions="left_right"),
    ],
    ids=lambda own: own.kind,
)
def test_beside_memory_it_is_what_a_response_gives(response: Effect) -> None:
    light, grid = np.full((32, 48), 1800, np.float32), PixelGrid(32, 48, Cfa.MONO)
    own = camera(response, MEMORY)
    made = mean_frame(light, own.effect, grid, own.read_out, 0.01)
    np.testing.assert_array_equal(made, mean_frame(light, [response], grid, own.read_out, 0.01))
    codes = own.expose(light, Draw(1), Draw(2), 0, grid)
    np.testing.assert_allclose(made, codes, atol=0.51)  # which are whole
