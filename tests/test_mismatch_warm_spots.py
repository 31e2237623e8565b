"""Few pixels that grow with exposure time are no glow; nor do they hide one."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import warmspots
from analysis.mismatch.warmspots import warm_spots
from dsis.effects import registry

NOISE, SCALE = 0.4, 0.2  # of a pixel of the map, DN; seconds
SHAPE = (70, 110)


def _glow(extent: float) -> np.ndarray:
    y, x = np.indices(SHAPE)
    return np.asarray(np.exp(-np.hypot(y, SHAPE[1] - 1 - x) / (extent * SHAPE[1])))


def _denied(
    monkeypatch: pytest.MonkeyPatch, *, glow: float, trails: float, seed: int, warm: bool = True
) -> bool:
    """Return whether a glow at the top right is denied in a map of a glow and of trails there."""
    monkeypatch.setattr(warmspots, "warm_left", lambda _: warm)
    rng = np.random.default_rng(seed)
    image = glow * _glow(0.15) + rng.normal(0, NOISE, SHAPE)
    for _ in range(4):
        row, column = int(rng.integers(0, 12)), int(rng.integers(92, 108))
        image[row : row + 15, column] += trails * np.exp(-np.arange(15) / 8)
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "time"): (image, NOISE)}))
    )
    rate = max(glow, 0.4) / SCALE
    effect = registry()["amp_glow"](dn_per_s=rate, place="top_right", extent=0.15)
    return warm_spots(state, effect) is not None


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("trails", [25.0, 4000.0])
def test_trails_in_a_corner_are_no_glow(
    monkeypatch: pytest.MonkeyPatch, seed: int, trails: float
) -> None:
    assert _denied(monkeypatch, glow=0.0, trails=trails, seed=seed)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("glow", [4.0, 40.0])
def test_a_glow_that_has_more_than_half_is_believed(
    monkeypatch: pytest.MonkeyPatch, glow: float, seed: int
) -> None:
    assert not _denied(monkeypatch, glow=glow, trails=25.0, seed=seed)


def test_where_no_warm_pixels_are_left_nothing_is_denied(monkeypatch: pytest.MonkeyPatch) -> None:
    assert not _denied(monkeypatch, glow=0.0, trails=25.0, seed=0, warm=False)
