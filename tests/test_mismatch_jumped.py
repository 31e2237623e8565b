"""Pixels that jump may stand out by themselves: where nothing grows with time, none is hot."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.jumped import jumped, turned
from dsis.effects.dsnu import Dsnu
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

HOT = HotPixels(pixel_fraction=0.0005, mean_dn_per_s=400.0)


def _state(times: tuple[float, ...], jumping: float, left: tuple[str, ...] = ()) -> Any:
    rts = Rts(pixel_fraction=jumping, amplitude_dn=40.0)
    exposures = [SimpleNamespace(exposure_time_s=t) for t in times]
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(uniform=exposures), seen=SimpleNamespace(images={})
        ),
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


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("change", "short_s", "denied"),
    [(-1.0, 0.01, True), (0.0, 0.01, False), (1.0, 0.01, False), (-1.0, 0.25, False)],
)
def test_pixels_that_are_dark_before_they_are_bright_have_jumped(
    change: float, short_s: float, denied: bool, seed: int
) -> None:
    """Two darks: what a pixel has at no time is a hot one's offset, or the other state's."""
    rng = np.random.default_rng(seed)
    short, long = rng.normal(0, 1, (2, 60, 80))
    few = rng.choice(short.size, 3, replace=False)
    short.flat[few] += 12 * change
    long.flat[few] += 24.0 if change >= 0 else 12.0
    state = _state((short_s, 0.5), 0.0)
    images = {("MONO", "offset"): (short, 1.0), ("MONO", "time"): (long - short, 2**0.5)}
    state.setting.seen.images.update(images)
    assert (jumped(state, HOT) is not None) == denied
    assert turned(state) == denied


@pytest.mark.parametrize("ratio", [0.02, 0.1, 0.2, 0.5])
def test_the_noise_of_a_hot_current_is_no_jump(ratio: float) -> None:
    """Currents of 3000 electrons: what their shot noise extrapolates to is far below zero."""
    denied = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        dark = np.zeros((60, 80))
        dark.flat[rng.choice(dark.size, 4, replace=False)] = rng.exponential(3000, 4)
        short, long = (
            (rng.poisson(dark * t, (8, 60, 80)) + rng.normal(0, 3, (8, 60, 80))).mean(0)
            for t in (ratio, 1.0)
        )
        slope = (long - short) / (1 - ratio)
        noise = 3 / 8**0.5 / (1 - ratio)
        state = _state((ratio, 1.0), 0.0)
        images = {("MONO", "offset"): (short - slope * ratio, noise * (1 + ratio**2) ** 0.5)}
        images["MONO", "time"] = (slope, noise * 2**0.5)
        state.setting.seen.images.update(images)
        denied += jumped(state, HOT) is not None
    assert denied == 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("below", "denied"), [(0, False), (1, False), (6, True)])
def test_no_current_is_negative(below: int, denied: bool, seed: int) -> None:
    """Of eight pixels that stand out above none or one is below by a defect, six by jumps."""
    rng = np.random.default_rng(seed)
    image = rng.normal(0, 1, (60, 80))
    few = rng.choice(image.size, 8 + below, replace=False)
    image.flat[few] += np.where(np.arange(8 + below) < 8, 15.0, -15.0)
    state = _state((0.05,), 0.0)
    state.setting.seen.images["MONO", "offset"] = (image, 1.0)
    state.camera.effect = (HOT,)
    assert (jumped(state, HOT) is not None) == denied
    state.camera.effect = (HOT, Rts(pixel_fraction=1e-5, amplitude_dn=15.0))
    assert (jumped(state, HOT) is not None) == denied  # as many above jump as do below
    times = _state((0.05, 0.5), 0.0)
    times.setting.seen, times.camera = state.setting.seen, state.camera
    assert jumped(times, HOT) is None  # time tells them


def test_a_cold_column_is_no_pixel_that_stands_out() -> None:
    rng = np.random.default_rng(1)
    image = rng.normal(0, 1, (60, 80))
    image[:, 30] -= 8.0
    image.flat[rng.choice(image.size, 8, replace=False)] += 25.0
    state = _state((0.05,), 0.0)
    state.setting.seen.images["MONO", "offset"] = (image, 1.0)
    state.camera.effect = (HOT,)
    assert jumped(state, HOT) is None


@pytest.mark.parametrize("seed", range(3))
def test_strong_hot_pixels_push_none_below(seed: int) -> None:
    """One of a thousand standard deviations moves its line's mean by more than noise reaches."""
    rng = np.random.default_rng(seed)
    image = rng.normal(0, 1, (96, 128))
    few = rng.choice(image.size, 49, replace=False)
    image.flat[few] += rng.exponential(600, 49)
    state = _state((0.05,), 0.0)
    state.setting.seen.images["MONO", "offset"] = (image, 1.0)
    state.camera.effect = (HOT,)
    assert jumped(state, HOT) is None


@pytest.mark.parametrize("shape", ["ramp", "wave"])
@pytest.mark.parametrize("seed", range(3))
def test_steep_maps_push_none_below(shape: str, seed: int) -> None:
    """What neighbours have in common goes on beyond the edges."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:96, :128]
    surface = y * x / 12.0 if shape == "ramp" else 30 * np.sin(2 * np.pi * (0.05 * y + 0.02 * x))
    image = rng.normal(0, 1, (96, 128)) + surface
    image.flat[rng.choice(image.size, 8, replace=False)] += 40.0
    state = _state((0.05,), 0.0)
    state.setting.seen.images["MONO", "offset"] = (image, 1.0)
    state.camera.effect = (HOT,)
    assert jumped(state, HOT) is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("tails", [True, False])
def test_offsets_of_heavy_tails_are_no_hot_pixels(seed: int, *, tails: bool) -> None:
    """Of few that stand out a little: as many lie below; hot ones of one time all lie above."""
    rng = np.random.default_rng(seed)
    image = rng.normal(0, 1, (96, 128))
    few = rng.choice(image.size, 24, replace=False)
    image.flat[few] = rng.uniform(3.6, 4.6, 24) * (
        np.where(np.arange(24) % 2, 1, -1) if tails else 1
    )
    state = _state((0.01,), 0.0)
    state.camera.effect = (HOT,)
    state.setting.seen.images = {("MONO", "offset"): (image, 1.0)}
    assert (jumped(state, HOT) is not None) == tails
