"""Lines that were made of their neighbours have less noise, and are no filter of the sensor."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.fields import interpolated

ROWS, COLUMNS, FRAMES = 60, 80, 40


def _state(frames: Any, left: str = "row_variance_spread", z: float = 46.0) -> Any:
    variance = frames.var(0, ddof=1)
    image = (variance / variance.mean() - 1) * (FRAMES - 1)
    noise = (2 * (FRAMES - 1)) ** 0.5
    seen = SimpleNamespace(images={("MONO", "variance"): (image, noise)})
    return SimpleNamespace(
        setting=SimpleNamespace(seen=seen), mismatches=[SimpleNamespace(statistic=left, z=z)]
    )


def _woven(axis: int, seed: int) -> Any:
    """Return frames of which every second line is the mean of its neighbours."""
    frames = np.moveaxis(np.random.default_rng(seed).normal(0, 1, (FRAMES, ROWS, COLUMNS)), axis, 1)
    frames[:, 1:-1:2] = (frames[:, :-2:2] + frames[:, 2::2]) / 2
    return np.moveaxis(frames, 1, axis)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("axis", "left"), [(1, "row"), (2, "column")])
def test_every_second_line_of_less_noise_is_interpolated(axis: int, left: str, seed: int) -> None:
    state = _state(_woven(axis, seed), f"{left}_variance_spread")
    for kind in ("readout_memory", "spatial_filtering", "adc_dnl"):
        denial = interpolated(state, kind)
        assert denial is not None
        assert f"every second {left}" in denial.why
    assert interpolated(state, "row_noise") is None
    weak = _state(_woven(axis, seed), f"{left}_variance_spread", 5.0)
    assert interpolated(weak, "adc_dnl") is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("axis", "left"), [(1, "row"), (2, "column")])
def test_some_lines_of_far_less_noise_are_corrected(axis: int, left: str, seed: int) -> None:
    """A mean of both neighbours has half of their noise, and is alike to both."""
    rng = np.random.default_rng(seed)
    frames = np.moveaxis(rng.normal(0, 1, (FRAMES, ROWS, COLUMNS)), axis, 1)
    for line in rng.choice(np.arange(2, frames.shape[1] - 2, 4), 5, replace=False).tolist():
        frames[:, line] = (frames[:, line - 1] + frames[:, line + 1]) / 2
    state = _state(np.moveaxis(frames, 1, axis), f"{left}_variance_spread")
    denial = interpolated(state, "spatial_filtering")
    assert denial is not None
    assert f"some {left}s" in denial.why


@pytest.mark.parametrize("seed", range(3))
def test_lines_that_differ_anyhow_and_white_noise_are_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 1, (FRAMES, ROWS, COLUMNS))
    assert interpolated(_state(noise), "spatial_filtering") is None
    other = noise * np.exp(rng.normal(0, 0.3, (1, ROWS, 1)))
    assert interpolated(_state(other), "spatial_filtering") is None
    noise[:, 5::12] *= 1.5
    assert interpolated(_state(noise), "spatial_filtering") is None


@pytest.mark.parametrize("seed", range(3))
def test_light_that_falls_off_and_edges_that_are_dark_are_not(seed: int) -> None:
    """Lines of less shot noise, side by side, are made of no neighbours."""
    rng, lines = np.random.default_rng(seed), np.linspace(-1, 1, ROWS)
    noise = rng.normal(0, 1, (FRAMES, ROWS, COLUMNS))
    fallen = noise * np.sqrt(1 - 0.5 * lines**2)[:, np.newaxis]
    fallen[:, 7::13] *= 1.1
    assert interpolated(_state(fallen), "adc_dnl") is None
    noise[:, :4] *= 0.7
    assert interpolated(_state(noise), "adc_dnl") is None
