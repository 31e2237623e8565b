"""The pan: whole speeds are slices, all others a phase ramp that neither rings nor wraps around."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cinema import CINEMA
from dsis.optics import Pan, through_optics
from dsis.scenes import SCENES, panorama, preset_strip
from dsis.spec import Sequence
from dsis.stimuli.source import Slices, Window

Light = NDArray[np.float32]
ROWS, COLUMNS, TRAVEL = 72, 96, 24
SCENE = pytest.mark.parametrize("name", SCENES)
ROUTES_AGREE = 1e-5  # of a white surface: what a float32 Fourier transform of this size rounds


def strip(name: str, scale: int = 2) -> Light:
    """Return a part, below the sky, of a panorama that comes with dsis."""
    whole = panorama(preset_strip("quick", name, 1))
    return whole[150 : 150 + scale * ROWS, 400 : 400 + scale * (COLUMNS + TRAVEL)]


def pan(image: Light, speed: float, frames: int = 5, scale: int = 2) -> list[Light]:
    size = Sequence(width=COLUMNS, height=ROWS, fps=25.0, seconds=frames / 25)
    window = Window(image, CINEMA, size, scale, speed)
    return [window.light(frame) for frame in range(frames)]


@SCENE
@pytest.mark.parametrize("speed", [0.0, 0.5, 1.0, 3.0, -1.5])
def test_whole_speeds_are_slices_and_equal_the_fourier_route(name: str, speed: float) -> None:
    image = strip(name)
    size = Sequence(width=COLUMNS, height=ROWS, fps=25.0, seconds=5 / 25)
    window = Window(image, CINEMA, size, 2, speed)
    assert isinstance(window.slid, Slices)
    fourier = Pan.of(image, CINEMA, 2)
    peak = max(1.0, float(image.max()))
    for frame in range(5):
        column = float(window.start + window.step * frame)
        seen = fourier.window(column, ROWS, COLUMNS)
        assert np.abs(window.light(frame) - seen).max() < ROUTES_AGREE * peak


@SCENE
@pytest.mark.parametrize("part", [0.25, 0.5, 0.9])
def test_the_ramp_is_the_one_of_the_optics_step(name: str, part: float) -> None:
    """Shifted within the two-dimensional transform that applies the OTF: the same picture."""
    image = strip(name)
    seen = Pan.of(image, CINEMA, 2).window(10 + part, ROWS, COLUMNS)
    moved = through_optics(image, CINEMA, 2, shift_px=(0.0, -part / 2))
    expected = moved[::2, 10 : 10 + 2 * COLUMNS : 2]
    peak = max(1.0, float(image.max()))
    assert np.abs(seen - expected).max() < ROUTES_AGREE * peak


@pytest.mark.parametrize("fill_factor", [1.0, 0.5])
@pytest.mark.parametrize("separation", [0.0, 0.75])
@given(place=st.floats(30, 31), width=st.integers(1, 40))
def test_a_step_edge_does_not_ring(
    fill_factor: float, separation: float, place: float, width: int
) -> None:
    """Neither edge of a bar goes beyond its plateaus by 1 %, nor back by 1 % on its way up.

    Square pixels as a renderer gives them: the edge's pixel has the covered share.
    """
    optics = CINEMA.model_copy(
        update={"fill_factor": fill_factor, "low_pass_spot_separation_px": separation}
    )
    edge = np.clip(np.arange(200) + 0.5 - (60.3 - width), 0, 1) * np.clip(
        140.6 - np.arange(200), 0, 1
    )
    image = np.broadcast_to(edge.astype(np.float32)[None, :, None], (64, 200, 1))
    seen = Pan.of(image, optics, 2)
    # Two windows half a sensor pixel apart show every second place each.
    line = np.empty(120, np.float32)
    for first in (0, 1):
        line[first::2] = seen.window(place + first, 16, 60)[8, :, 0]
    assert line.min() > -0.01
    assert line.max() < 1.01
    up = line[:60]
    assert np.diff(up).min() > -0.01


@SCENE
def test_half_a_pixel_on_is_what_a_camera_half_a_pixel_on_sees(name: str) -> None:
    """A twice finer panorama, averaged by twos from its column 1, is the scene half a pixel on."""
    fine = strip(name, 4)
    rows, columns = 2 * ROWS, 2 * (COLUMNS + TRAVEL)
    here = fine.reshape(rows, 2, columns, 2, 3).mean(axis=(1, 3))
    on = fine[:, 1:-1].reshape(rows, 2, columns - 1, 2, 3).mean(axis=(1, 3))
    shifted = Pan.of(here, CINEMA, 2).window(10.5, ROWS, COLUMNS)
    rendered = Pan.of(on, CINEMA, 2).window(10.0, ROWS, COLUMNS)
    still = Pan.of(here, CINEMA, 2).window(10.0, ROWS, COLUMNS)
    # 1 % of white; what remains is what square pixels alias, and far less than the step's effect.
    difference = float(np.sqrt(np.mean((shifted - rendered) ** 2)))
    assert difference < 0.01
    assert difference < 0.5 * float(np.sqrt(np.mean((still - rendered) ** 2)))


@SCENE
def test_light_stays_light(name: str) -> None:
    """No negative light beyond rounding: the point spread function is nowhere negative."""
    for frame in pan(strip(name), 0.3):
        assert np.isfinite(frame).all()
        assert frame.min() > -1e-3


def test_the_ends_of_the_panorama_do_not_meet() -> None:
    image = np.zeros((64, 300, 3), np.float32)
    image[:, -20:] = 100.0
    seen = Pan.of(image, CINEMA, 2).window(0.5, 32, 20)
    # Across the 2 x 32 reflected pixels the tail of a lens is 0.95 / (2 pi x)^2 per pixel of light.
    assert np.abs(seen).max() < 100 * 0.95 / (2 * math.pi) ** 2 * sum(
        1 / x**2 for x in range(50, 80)
    )


@SCENE
def test_to_the_left_is_the_same_film_backwards(name: str) -> None:
    image = strip(name)
    right, left = pan(image, 1.3), pan(image, -1.3)
    for one, other in zip(right, reversed(left), strict=True):
        np.testing.assert_allclose(one, other, atol=ROUTES_AGREE)


@pytest.mark.parametrize("speed", [1.0, 1.01, 0.3, -1.0, -1.01])
def test_the_window_lies_in_the_middle_and_moves_as_told(speed: float) -> None:
    """On a picture whose light is the place itself, larger than the window on all sides."""
    rows, columns, frames = 240, 460, 51
    row, column = np.indices((rows, columns), np.float32)
    image = np.stack([row, column, column], axis=2)
    size = Sequence(width=60, height=40, fps=25.0, seconds=frames / 25)
    window = Window(image, CINEMA, size, 2, speed)
    travel = 2 * speed * (frames - 1)
    top, left = (rows - 2 * 40) // 2, (columns - 2 * 60 - travel) / 2
    for frame in (0, frames - 1):
        light = window.light(frame)
        # The optics keep a slope as it is but for what their tails see of the reflected margin.
        at = np.indices((40, 60))
        np.testing.assert_allclose(light[..., 0], top + 2 * at[0], atol=0.3)
        moved = travel * frame / (frames - 1)
        # It begins at a whole place: up to one before the exact middle.
        np.testing.assert_allclose(light[..., 1] + 0.5, left + moved + 2 * at[1], atol=0.8)
    one = window.light(frames // 2)[20, 30, 1] - window.light(0)[20, 30, 1]
    assert one == pytest.approx(travel / 2, abs=0.1)


@SCENE
def test_temporal_information_grows_with_the_speed(name: str) -> None:
    """ITU-T P.910's TI, the standard deviation of frame differences: linear in small steps."""
    image = strip(name)

    def information(speed: float) -> float:
        frames = pan(image, speed)
        return max(float(np.std(b - a)) for a, b in pairwise(frames))

    assert information(0.0) == 0.0
    assert information(0.2) / information(0.1) == pytest.approx(2.0, rel=0.05)
    assert information(4.0) > 1.5 * information(1.0) > 2 * information(0.25)
