"""Pixels that jump may stand out by themselves: where nothing grows with time, none is hot."""

from types import SimpleNamespace
from typing import Any

import pytest

from analysis.mismatch.jumped import jumped
from dsis.effects.dsnu import Dsnu
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

HOT = HotPixels(pixel_fraction=0.0005, mean_dn_per_s=400.0)


def _state(times: tuple[float, ...], jumping: float, left: tuple[str, ...] = ()) -> Any:
    rts = Rts(pixel_fraction=jumping, amplitude_dn=40.0)
    exposures = [SimpleNamespace(exposure_time_s=t) for t in times]
    return SimpleNamespace(
        setting=SimpleNamespace(layout=SimpleNamespace(uniform=exposures)),
        camera=SimpleNamespace(effect=(HOT, rts)),
        mismatches=[SimpleNamespace(statistic=name) for name in left],
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


@pytest.mark.parametrize(
    ("left", "denied"),
    [
        (("jumping_pixels", "outlying_pixels"), True),
        (("jumping_pixels",), False),  # hot ones explain all that stand out
        (("outlying_pixels",), False),
    ],
)
def test_pixels_that_jump_and_have_no_word_are_no_hot_ones(
    left: tuple[str, ...], denied: bool
) -> None:
    assert (jumped(_state((0.05, 0.4), 0.001, left), HOT) is not None) == denied
