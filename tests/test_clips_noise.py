"""Promise: noise of delivered clips is new everywhere, white, and of the stated strength."""

import math
from pathlib import Path

import numpy as np
import pytest

from delivered import (
    CAMERA,
    COLUMNS,
    INTERCEPT,
    ROWS,
    SLOPE,
    WHITE_DN,
    Z_MAX,
    built,
    codes_of,
    flat,
)
from dsis.effects.prnu import Prnu
from dsis.manifest import read_manifest

Z_MAX_OF_MANY = 6.0  # of 10^5 z-values at once: one in 5000 sets of them reaches that by chance
CODES_PER_DN = 255 / WHITE_DN

# Sheppard: rounding to whole steps adds 1/12 to the variance of noise far wider than a step.
ROUNDING = 1 / 12
FLAT_FRAMES = 20  # more than 16: no short cycle of the fields goes unseen
FLATS = {"one": 0.5, "two": 0.45}
FLAT_LEVELS = (0, 2)


@pytest.fixture(scope="module")
def flats(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two uniform greys: no code of them comes near 0 or 255."""
    return built(
        tmp_path_factory.mktemp("flats"),
        {name: {"light": flat(light)} for name, light in FLATS.items()},
        frames=FLAT_FRAMES,
        awgn={"match": "psnr"},
        noise=["awgn", "sd"],
        levels=list(FLAT_LEVELS),
    )


def noise_clips(out: Path) -> dict[str, np.ndarray]:
    clips = [clip for clip in read_manifest(out).clips if clip.role == "test"]
    return {clip.stimulus: codes_of(out, clip.stimulus) for clip in clips}


def test_noise_is_new_in_every_frame_channel_clip_and_content(flats: Path) -> None:
    """Every pair of 480 planes is uncorrelated: frames, channels, levels, contents, both noises."""
    clips = np.concatenate(list(noise_clips(flats).values()))
    planes = clips.transpose(0, 3, 1, 2).reshape(-1, ROWS * COLUMNS)
    assert len(planes) == len(FLATS) * 2 * len(FLAT_LEVELS) * FLAT_FRAMES * 3
    z = np.corrcoef(planes) * math.sqrt(ROWS * COLUMNS)
    np.fill_diagonal(z, 0)
    assert np.abs(z).max() < Z_MAX_OF_MANY


def test_noise_is_white_within_a_frame(flats: Path) -> None:
    """The circular autocorrelation at every lag, averaged over frames and channels of a clip."""
    for name, clip in noise_clips(flats).items():
        residual = clip - clip.mean(axis=(1, 2), keepdims=True)
        power = np.abs(np.fft.fft2(residual / residual.std(), axes=(1, 2))) ** 2
        correlation = np.fft.ifft2(power, axes=(1, 2)).real.mean(axis=(0, 3)) / (ROWS * COLUMNS)
        z = correlation * math.sqrt(clip.size)
        z[0, 0] = 0
        # A lag that is its own opposite counts every product twice.
        z[[0, 0, ROWS // 2, ROWS // 2], [0, COLUMNS // 2, 0, COLUMNS // 2]] /= math.sqrt(2)
        assert np.abs(z).max() < Z_MAX, name


@pytest.mark.parametrize("content", FLATS)
@pytest.mark.parametrize("level", FLAT_LEVELS)
def test_delivered_noise_has_the_stated_strength(flats: Path, content: str, level: int) -> None:
    """Of the manifest's sigma (white noise), of m x + t at x / 2^level (camera noise)."""
    sigma = read_manifest(flats).clip(f"{content}__awgn__none__{level}").awgn_sigma
    signal_dn = FLATS[content] * WHITE_DN
    raw_dn2 = SLOPE * signal_dn / 2**level + INTERCEPT + ROUNDING
    expected = {"awgn": sigma**2, "sd": raw_dn2 * (2**level * CODES_PER_DN) ** 2}
    for noise, variance in expected.items():
        codes = codes_of(flats, f"{content}__{noise}__none__{level}")
        total = variance + ROUNDING
        z_mean = (codes.mean() - FLATS[content] * 255) / math.sqrt(total / codes.size)
        z_variance = (codes.var() / total - 1) / math.sqrt(2 / codes.size)
        assert abs(z_mean) < Z_MAX, noise
        assert abs(z_variance) < Z_MAX, noise


def test_one_sensor_takes_all_contents_and_levels(tmp_path: Path) -> None:
    """Fixed gains of 5 % are the same pattern in all clips; the expected r is its share of all."""
    gain, frames = 0.05, 8
    camera = CAMERA.model_copy(update={"effect": (Prnu(sigma_percent=100 * gain),)})
    contents = {name: {"light": flat(light)} for name, light in FLATS.items()}
    out = built(tmp_path, contents, frames=frames, camera=camera, levels=[0, 1])
    patterns, shares = [], []
    for content, light in FLATS.items():
        for level in (0, 1):
            clip = codes_of(out, f"{content}__sd__none__{level}")
            patterns.append(clip.mean(axis=0).ravel())
            signal = light * WHITE_DN
            temporal = (SLOPE * signal / 2**level + INTERCEPT + ROUNDING) * 4**level
            temporal += ROUNDING / CODES_PER_DN**2
            shares.append(1 / (1 + temporal / frames / (gain * signal) ** 2))
    expected = np.sqrt(np.outer(shares, shares))
    z = (np.corrcoef(patterns) - expected) * math.sqrt(len(patterns[0])) / (1 - expected**2)
    np.fill_diagonal(z, 0)
    assert expected.min() > 0.6
    assert np.abs(z).max() < Z_MAX
