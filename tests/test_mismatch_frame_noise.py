"""Frames of one exposure that are not equally noisy: a sensor that warms, a burst in one frame."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.scalars import scalars
from dsis.measures import measure_exposure
from mismatch_recordings import FEW_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]


def _score(noise: Array) -> float:
    frames = len(noise)
    codes = np.rint(500 + noise).astype(np.uint16)
    found = measure_exposure(codes).channels["MONO"]
    value, error = scalars(found, frames)["frame_noise"]
    return (value - 1) / error


def _white(seed: int, frames: int = 10) -> Array:
    return 10 * np.random.default_rng(seed).normal(size=(frames, 48, 64))


@pytest.mark.parametrize("frames", [4, 7, 10, 30])
def test_of_white_noise_its_cube_is_chi_squared(frames: int) -> None:
    free = frames // 2 - 1
    scores = np.array([_score(_white(seed, frames)) for seed in range(100)])
    squares = (1 + scores * np.sqrt(2 / (9 * free))) ** 3 * free
    assert kstest(squares, "chi2", (free,)).pvalue > 0.01


def test_lines_and_frames_that_move_are_no_noise_of_pixels() -> None:
    rng = np.random.default_rng(2)
    moved = rng.normal(0, 8, (10, 48, 1)) + rng.normal(0, 8, (10, 1, 64))
    moved += rng.normal(0, 20, (10, 1, 1))
    assert _score(_white(2) + moved) == pytest.approx(_score(_white(2)), abs=0.2)


def test_of_fewer_than_four_frames_nothing_is_known() -> None:
    assert np.isnan(_score(_white(1, 3)))


def test_noise_that_grows_or_bursts_is_seen() -> None:
    growing = _white(3) * (1 + 0.2 * np.arange(10) / 9)[:, np.newaxis, np.newaxis]
    burst = _white(4)
    burst[6] *= 1.2
    assert _score(growing) > 3
    assert _score(burst) > 3


@pytest.mark.long
def test_a_sensor_that_warms_is_located_and_named_nothing() -> None:
    """Read noise that grows by 11 % from the first frame of each exposure to the last."""
    recording = recorded(camera(), 6, rows=64, columns=96, levels=FEW_LEVELS)
    rng, stacks = np.random.default_rng(6), dict(recording.stacks or {})
    for name, frames in stacks.items():
        grown = 20.0 * ((1 + 0.11 * np.arange(len(frames)) / (len(frames) - 1)) ** 2 - 1)
        added = rng.normal(size=frames.shape) * np.sqrt(grown)[:, np.newaxis, np.newaxis]
        dithered = np.floor(frames + added + rng.random(frames.shape))
        stacks[name] = dithered.clip(0, 4095).astype(np.uint16)
    found = find_mismatch(camera(), replace(recording, stacks=stacks), seed=1)
    assert not found.omitted_physics
    (noise,) = (m for m in found.unexplained if m.statistic == "frame_noise")
    assert "dark-0" in noise.where.exposures
