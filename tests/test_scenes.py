"""The stand-in scenes: reproducible, free of grain, with the range and the detail a test needs."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import sobel

from dsis.errors import InputError
from dsis.scenes import SCENES, panorama
from dsis.scenes.texture import Texture, pulse
from dsis.scenes.view import DILATION_PX, View

QUICK = (604, 1200)  # 480 x 270 at twice the resolution, with margins and some pan
REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # ITU-R BT.709-6, item 3.2
SCENE = pytest.mark.parametrize("name", SCENES)


@cache
def quick(name: str) -> NDArray[np.float32]:
    image = panorama(name, 1, *QUICK)
    image.flags.writeable = False
    return image


def sensor_luma(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the 8-bit luma of the picture at half the resolution, as a display would show it."""
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    pixels = image[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
    luma: NDArray[np.float32] = (255 * np.clip(pixels, 0, 1) ** (1 / 2.4)) @ REC709_LUMINANCE
    return luma


def spatial_information(luma: NDArray[np.float32]) -> float:
    """ITU-T P.910, 7.2: standard deviation of the Sobel-filtered frame."""
    gradient = np.hypot(sobel(luma, 0), sobel(luma, 1))[1:-1, 1:-1]
    return float(gradient.std())


@SCENE
def test_a_seed_fixes_every_byte_and_another_seed_is_another_place(name: str) -> None:
    first, again, other = (panorama(name, seed, 150, 120) for seed in (5, 5, 6))
    assert first.tobytes() == again.tobytes()
    assert first.dtype == np.float32
    assert first.shape == (150, 120, 3)
    assert np.abs(first - other).mean() > 0.02


@SCENE
def test_a_wider_strip_shows_more_of_the_same(name: str) -> None:
    narrow, wide = panorama(name, 2, 200, 120), panorama(name, 2, 200, 260)
    # Vectorised sine and exponential may round otherwise at another place in the array.
    assert np.mean(np.abs(wide[:, :120] - narrow) > 1e-4) < 1e-3


@SCENE
@pytest.mark.parametrize(("rows", "columns"), [(32, 1), (61, 97)])
def test_light_is_finite_and_not_negative(name: str, rows: int, columns: int) -> None:
    image = panorama(name, 0, rows, columns)
    assert image.shape == (rows, columns, 3)
    assert np.isfinite(image).all()
    assert image.min() >= 0


@SCENE
def test_exposure_and_range(name: str) -> None:
    light = quick(name) @ REC709_LUMINANCE
    dark, bright = np.percentile(light, [0.1, 99.9])
    assert math.log2(bright / dark) >= 7
    assert dark < 0.01
    assert 0.8 < bright < 4.5
    assert 0.0005 < (light > 1).mean() < 0.005
    assert 0.15 < light.mean() < 0.30


def test_flat_and_textured_areas_in_both_and_more_detail_in_the_city() -> None:
    detail = {}
    for name in SCENES:
        luma = sensor_luma(quick(name))
        rows, columns = (n // 8 for n in luma.shape)
        blocks = luma[: 8 * rows, : 8 * columns].reshape(rows, 8, columns, 8)
        spread = blocks.std(axis=(1, 3))
        assert (spread < 2).mean() >= 0.15
        assert (spread > 8).mean() >= 0.30
        detail[name] = spatial_information(luma)
    assert detail["city"] >= 1.5 * detail["landscape"]


@SCENE
def test_clear_sky_is_free_of_grain(name: str) -> None:
    sky = quick(name)[: QUICK[0] // 8]
    size = 24
    blue = (sky[..., 2] / sky[..., 0])[: len(sky) // size * size].reshape(
        -1, size, QUICK[1] // size, size
    )
    row, column = np.unravel_index(blue.min(axis=(1, 3)).argmax(), (blue.shape[0], blue.shape[2]))
    patch = sky[row * size : (row + 1) * size, column * size : (column + 1) * size]
    for axis in (0, 1):
        assert np.abs(np.diff(patch, 2, axis)).max() < 1e-4 * patch.mean()
    assert patch.std() > 0  # a gradient, not a constant


@SCENE
def test_presets_look_alike(name: str) -> None:
    """The half-size painting is the averaged full-size one: what is too fine fades, not aliases."""
    small, large = panorama(name, 3, 240, 200), panorama(name, 3, 480, 400)
    shown = sensor_luma(large)
    painted = (255 * np.clip(small, 0, 1) ** (1 / 2.4)) @ REC709_LUMINANCE
    difference = float(np.std(painted - shown))
    # Unrelated pictures would differ by sqrt(2) standard deviations; a fifth of that leaves room
    # for edges placed half a pixel apart (facets are dilated by pixels), leaves and glitter.
    assert difference < 0.2 * math.sqrt(2) * float(np.std(shown))


def test_everything_out_of_range_is_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        panorama("seaside", -1, 8, 0)
    assert [fault.key for fault in caught.value.faults] == [
        "scene",
        "scene_seed",
        "rows",
        "columns",
    ]
    assert "city, landscape" in str(caught.value)


@given(duty=st.floats(0.1, 0.9), share=st.floats(0.01, 1.0), cells=st.integers(1, 4))
@settings(max_examples=40, deadline=None)
def test_bars_keep_their_mean_however_wide_a_pixel(duty: float, share: float, cells: int) -> None:
    """An edge softened about its place covers the same area, as long as edges stay apart."""
    footprint = share * min(duty, 1 - duty, 0.3)
    u = (np.arange(4000 * cells) / np.float32(4000)).astype(np.float32)
    assert float(pulse(u, duty, footprint).mean()) == pytest.approx(duty, abs=2 / 4000)  # 2 edges
    assert np.ptp(pulse(u, duty, 0.9)) < 1e-6  # finer than a pixel: no bars are left


@given(u=st.floats(-300, 300), v=st.floats(-300, 300))
@settings(max_examples=60, deadline=None)
def test_texture_is_smooth(u: float, v: float) -> None:
    """Value noise in -1..1 with smoothstep weights: its slope is at most 2 x 1.5 per unit."""
    texture = Texture.of(7)
    path = np.linspace(0, 1, 400)
    a, b = (u + path).astype(np.float32)[None, :], (v + 0.5 * path).astype(np.float32)[None, :]
    values = texture.value(a, b)
    assert np.abs(values).max() <= 1
    moved = np.hypot(np.diff(a), np.diff(b))
    rounding = 1e-3  # coordinates near 300 are multiples of 3e-5, and the slope is at most 3
    assert np.all(np.abs(np.diff(values)) <= math.sqrt(2) * 3 * moved + rounding)


@given(
    x=st.floats(-0.6, 0.6),
    wide=st.floats(0.4, 3.0),
    tall=st.floats(0.4, 3.0),
    low=st.floats(-2, -0.5),
)
@settings(max_examples=40, deadline=None)
def test_a_facet_covers_its_area(x: float, wide: float, tall: float, low: float) -> None:
    """A wall straight ahead covers focal^2 w h / range^2 pixels, and its dilated rim."""
    view = View(np.zeros((200, 300, 3), np.float32), 400.0, 100.0, 0.0, air=0.0)
    distance, middle = 12.0, 150 / 400
    sin, cos = math.sin(middle), math.cos(middle)

    def at(right: float, up: float) -> tuple[float, float, float]:
        return distance * sin + right * cos, distance * cos - right * sin, up

    left, right = x - wide / 2, x + wide / 2
    corners = [at(left, low), at(right, low), at(right, low + tall), at(left, low + tall)]
    view.facet(
        corners,
        middle,
        lambda u, v, *_: np.ones((*np.broadcast_shapes(u.shape, v.shape), 3)),
        math.inf,
    )
    scale = 400 / distance
    width, height = scale * wide, scale * tall
    expected = (width + 2 * DILATION_PX) * (height + 2 * DILATION_PX)
    # 1.9 m aside at 12 m: azimuth and range differ from the tangent plane's by up to 2.5 %.
    assert view.image[..., 0].sum() == pytest.approx(expected, rel=0.04, abs=2)
    view.image[:] = 0
    view.facet(corners[::-1], middle, lambda u, *_: np.ones((*u.shape, 3)), math.inf)
    assert not view.image.any()  # its back is not painted
