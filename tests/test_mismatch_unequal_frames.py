"""Frames that are not equally noisy feign tails, and pixels that differ in noise."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.unequalframes import unequally_noisy
from dsis.effects import Effect
from dsis.effects.heavy_tailed_read_noise import HeavyTailedReadNoise
from dsis.effects.read_noise_spread import ReadNoiseSpread
from mismatch_recordings import TWO_LEVELS, InMemory, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

READ_DN2 = 20.0
SPREAD = ReadNoiseSpread(log_sigma=0.3)
FEIGNED = {
    "read_noise_spread": ReadNoiseSpread(log_sigma=0.05),
    "heavy_tailed_read_noise": HeavyTailedReadNoise(tail_df=25.0),
}


def _recorded(*effects: Effect, most: float, seed: int = 3) -> InMemory:
    """Return a recording whose read noise grows to so many times itself within each exposure."""
    sizes = {"rows": 72, "columns": 96, "frames": 16}
    recording = recorded(camera(*effects), seed, levels=TWO_LEVELS, **sizes)
    rng, stacks = np.random.default_rng(seed), dict[str, NDArray[np.uint16]]()
    for name, frames in (recording.stacks or {}).items():
        times = 1 + (most - 1) * np.arange(len(frames)) / (len(frames) - 1)
        sd = np.sqrt(READ_DN2 * (times**2 - 1))[:, np.newaxis, np.newaxis]
        added = sd * rng.standard_normal(frames.shape) + rng.random(frames.shape)
        stacks[name] = np.floor(frames + added).clip(0, 4095).astype(np.uint16)
    return replace(recording, stacks=stacks)


def _denial(recording: InMemory, effect: Effect) -> Denial | None:
    without = state_of(recording, camera()).null.mean
    return unequally_noisy(state_of(recording, camera(effect)), effect.kind, without)


@pytest.mark.parametrize("effect", FEIGNED.values(), ids=FEIGNED)
def test_noise_that_grows_from_frame_to_frame_feigns_them(effect: Effect) -> None:
    denial = _denial(_recorded(most=1.6), effect)
    assert denial is not None
    assert denial.share < 0.5
    assert "frames are not equally noisy" in denial.why


@pytest.mark.parametrize("effect", [SPREAD, HeavyTailedReadNoise(tail_df=6.0)])
def test_frames_that_are_equally_noisy_feign_nothing(effect: Effect) -> None:
    assert _denial(_recorded(effect, most=1.0), effect) is None


@pytest.mark.parametrize("effect", [SPREAD, HeavyTailedReadNoise(tail_df=5.0)])
def test_what_is_there_is_more_than_frames_that_differ_little_make(effect: Effect) -> None:
    assert _denial(_recorded(effect, most=1.15), effect) is None


def test_pixels_that_are_noisier_in_every_exposure_are_no_frames() -> None:
    """However much frames differ besides."""
    assert _denial(_recorded(SPREAD, most=1.6), SPREAD) is None


@pytest.mark.long
def test_neither_is_named_beside_them() -> None:
    found = find_mismatch(camera(), _recorded(most=1.5), seed=1)
    assert not found.omitted_physics
    assert "frame_noise" in {m.statistic for m in found.unexplained}
