"""Pixels that jump may stand out by themselves: where nothing grows with time, none is hot."""

from types import SimpleNamespace
from typing import Any

import pytest

from analysis.mismatch.jumped import jumped
from dsis.effects.dsnu import Dsnu
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

HOT = HotPixels(pixel_fraction=0.0005, mean_dn_per_s=400.0)


def _state(times: tuple[float, ...], jumping: float) -> Any:
    rts = Rts(pixel_fraction=jumping, amplitude_dn=40.0)
    exposures = [SimpleNamespace(exposure_time_s=t) for t in times]
    return SimpleNamespace(
        setting=SimpleNamespace(layout=SimpleNamespace(uniform=exposures)),
        camera=SimpleNamespace(effect=(HOT, rts)),
    )


@pytest.mark.parametrize(
    ("times", "jumping", "denied"),
    [
        ((0.05, 0.05, 0.05), 0.001, True),
        ((0.05, 0.05, 0.05), 0.0002, False),  # more stand out than jump
        ((0.05, 0.4, 0.05), 0.001, False),  # what grows with time was asked of time
    ],
)
def test_hot_pixels_beside_more_that_jump(
    times: tuple[float, ...], jumping: float, denied: bool
) -> None:
    assert (jumped(_state(times, jumping), HOT) is not None) == denied
    assert jumped(_state(times, jumping), Dsnu(sigma_dn=1.0)) is None
