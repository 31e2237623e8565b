"""A blot is no pattern of all pixels; nor does it hide one."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import expit

from analysis.mismatch.inpatches import in_patches

CHANNELS = {"MONO": (1, (0, 0)), "R": (2, (0, 1)), "Gr": (2, (0, 0)), "Gb": (2, (1, 1)),
            "B": (2, (1, 0))}  # fmt: skip
MONO, BAYER = ("MONO",), ("R", "Gr", "Gb", "B")
NOISE = 0.002  # of a pixel's gain
SCALE = 30_000.0  # DN


def _state(
    channels: tuple[str, ...],
    depth: float,
    pattern: float,
    *,
    seed: int = 0,
    size: tuple[int, int] = (126, 108),
    left: str = "fixed_patch_variance",
) -> Any:
    rng = np.random.default_rng(seed)
    apart = np.hypot(np.arange(size[0])[:, None] - 78, np.arange(size[1]) - 19)
    gain = pattern * rng.standard_normal(size) - depth * expit((6 - apart) / 0.6)
    images: dict[tuple[str, str], tuple[np.ndarray, float]] = {}
    for channel in channels:
        step, (y, x) = CHANNELS[channel]
        own = gain[y::step, x::step]
        noisy = own + rng.normal(0, NOISE, own.shape)
        images[channel, "gain"] = (SCALE * noisy, SCALE * NOISE)
    regressors = SimpleNamespace(scales={"gain": SCALE})
    return SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=left)],
        setting=SimpleNamespace(
            layout=SimpleNamespace(channels=channels, regressors=lambda _: regressors),
            seen=SimpleNamespace(images=images),
        ),
    )


@pytest.mark.parametrize("channels", [MONO, BAYER])
@pytest.mark.parametrize("seed", range(4))
def test_a_blot_is_no_pattern_of_all_pixels(channels: tuple[str, ...], seed: int) -> None:
    said = in_patches(_state(channels, 0.006, 0.0, seed=seed), "prnu")
    assert said is not None
    assert said.share < 0.5


@pytest.mark.parametrize("channels", [MONO, BAYER])
@pytest.mark.parametrize("seed", range(4))
def test_a_pattern_beside_a_blot_is_believed(channels: tuple[str, ...], seed: int) -> None:
    assert in_patches(_state(channels, 0.006, 0.001, seed=seed), "prnu") is None


@pytest.mark.parametrize(("depth", "pattern"), [(0.02, 0.001), (0.05, 0.001), (0.2, 0.005)])
@pytest.mark.parametrize("seed", range(2))
def test_however_deep_a_blot_the_other_pixels_say(depth: float, pattern: float, seed: int) -> None:
    assert in_patches(_state(MONO, depth, pattern, seed=seed), "prnu") is None


def test_a_blot_of_a_large_sensor_is_found_in_squares() -> None:
    large = _state(MONO, 0.02, 0.0, size=(600, 700))
    assert in_patches(large, "prnu") is not None
    assert in_patches(_state(MONO, 0.02, 0.001, size=(600, 700)), "prnu") is None


def test_nothing_is_said_of_other_kinds_maps_or_departures() -> None:
    assert in_patches(_state(MONO, 0.006, 0.0), "row_prnu") is None
    assert in_patches(_state(MONO, 0.006, 0.0), "dsnu") is None  # no map of offsets
    assert in_patches(_state(MONO, 0.006, 0.0, left="outlying_pixels"), "prnu") is None
    assert in_patches(_state(MONO, 0.0, 0.001), "prnu") is None  # no patch
