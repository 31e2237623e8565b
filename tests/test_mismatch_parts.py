"""Amplifiers' parts that are no halves: where they meet, and that light is not so uneven."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from analysis.mismatch.candidates.parts import unequal_parts
from analysis.mismatch.gainodds import Cause, evidences
from dsis.effects.tap_mismatch import TapMismatch

Array = NDArray[np.float64]
ROWS, COLUMNS, SCALE, NOISE = 96, 128, 500.0, 2.0
STEP = 3e-3


def _clues(image: Array, seed: int, channels: int = 1) -> Any:
    """Return clues that hold maps of the gain with white noise, DN."""
    maps = {
        f"C{k}": (image + np.random.default_rng([seed, k]).normal(0, NOISE, image.shape), NOISE)
        for k in range(channels)
    }
    return SimpleNamespace(image=lambda _: maps, scale=lambda *_: SCALE)


def _stepped(seam: float, axis: int) -> Array:
    place = np.arange((ROWS, COLUMNS)[axis]) >= seam * (ROWS, COLUMNS)[axis]
    line = SCALE * STEP * (place - place.mean())
    return np.broadcast_to(line[:, None] if axis == 0 else line, (ROWS, COLUMNS)).astype(float)


@settings(max_examples=30, deadline=None)
@given(
    seam=st.sampled_from([0.2, 0.3, 0.37, 0.62, 0.7, 0.8]),
    axis=st.integers(0, 1),
    channels=st.sampled_from([1, 4]),
    seed=st.integers(0, 2**16),
)
def test_parts_are_found_where_they_meet(seam: float, axis: int, channels: int, seed: int) -> None:
    found = unequal_parts(_clues(_stepped(seam, axis), seed, channels), axis)
    assert found is not None
    assert found.seam == pytest.approx(seam, abs=0.03)
    assert found.step == pytest.approx(STEP, rel=0.5)


def test_noise_halves_and_smooth_light_are_no_unequal_parts() -> None:
    y, x = np.linspace(-1, 1, ROWS)[:, None], np.linspace(-1, 1, COLUMNS)
    light = SCALE * STEP * (0.7 * y + 0.4 * x - y**2 - x**2)
    found = [
        unequal_parts(_clues(image, seed), axis)
        for image in (np.zeros((ROWS, COLUMNS)), _stepped(0.5, 0), _stepped(0.5, 1), light)
        for axis in (0, 1)
        for seed in range(25)
    ]
    assert sum(one is not None for one in found) <= 0.05 * len(found)


@pytest.mark.parametrize("seam", [1 / 3, 0.37, 2 / 3])
def test_a_step_is_likelier_than_light_wherever_it_lies(seam: float) -> None:
    image, _ = _clues(3 * _stepped(seam, 0), 1).image("gain")["C0"]
    odds = evidences(image)
    assert odds[Cause.HALVES_OF_ROWS] > odds[Cause.LIGHT] + 3


@pytest.mark.parametrize("bow", [0.5, 1.0])
def test_light_is_likelier_than_a_step(bow: float) -> None:
    y = np.linspace(-1, 1, ROWS)[:, None]
    light = np.broadcast_to(3 * SCALE * STEP * (0.5 * y - bow * y**2), (ROWS, COLUMNS))
    image, _ = _clues(light, 2).image("gain")["C0"]
    odds = evidences(image)
    assert odds[Cause.LIGHT] > odds[Cause.HALVES_OF_ROWS] + 3


def test_halves_are_written_as_ever() -> None:
    assert "seam" not in TapMismatch(gain_percent=1.0).model_dump()
    assert TapMismatch(gain_percent=1.0, seam=0.4).model_dump()["seam"] == 0.4
