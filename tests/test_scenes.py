"""City and Landscape: reproducible, free of grain, with the range and the detail a test needs."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import sobel

from dsis.errors import InputError
from dsis.scenes import SCENES, Strip, panorama, preset_strip, render
from dsis.scenes.renderer import _prepared
from dsis.workers import Workers, workers

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # ITU-R BT.709-6, item 3.2
SCENE = pytest.mark.parametrize("name", SCENES)


@cache
def rendered(name: str, rows: int, columns: int) -> NDArray[np.float32]:
    return render(Strip(name, 3, rows, columns))


@cache
def quick(name: str) -> NDArray[np.float32]:
    return panorama(preset_strip("quick", name, 1))


def sensor_luma(image: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the 8-bit luma of the picture at half the resolution, by the curve of BT.709."""
    rows, columns = (n // 2 * 2 for n in image.shape[:2])
    pixels = image[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
    light = np.clip(pixels, 0, 1)
    curve = np.where(light < 0.018, 4.5 * light, 1.099 * light**0.45 - 0.099)
    luma: NDArray[np.float32] = 255 * curve @ REC709_LUMINANCE
    return luma


def spatial_information(luma: NDArray[np.float32]) -> float:
    """ITU-T P.910, 7.2: standard deviation of the Sobel-filtered frame."""
    gradient = np.hypot(sobel(luma, 0), sobel(luma, 1))[1:-1, 1:-1]
    return float(gradient.std())


@SCENE
def test_a_seed_fixes_every_byte_whoever_renders_and_a_wider_strip_shows_more_of_the_same(
    name: str, processes: Workers
) -> None:
    """To the last bit, on one thread, two, and two processes: the cache serves a part of each."""
    told: list[tuple[int, int, str]] = []
    strip = Strip(name, 3, 48, 135)
    wide = render(strip, 2, lambda *words: told.append(words))
    apart = render(strip, pool=processes)
    narrow = render(replace(strip, columns=64), 1)
    assert _prepared.cache_info().currsize == 0  # what it was made from holds no memory
    assert narrow.dtype == np.float32
    assert narrow.shape == (48, 64, 3)
    assert wide.tobytes() == apart.tobytes()
    assert wide[:, :64].tobytes() == narrow.tobytes()
    assert [done for done, _, _ in told] == sorted(done for done, _, _ in told)
    assert len(told) == 3
    assert told[-1] == (135, 135, name)


@SCENE
def test_another_seed_is_another_place(name: str) -> None:
    one = rendered(name, 90, 100)[:, :31]
    other = render(Strip(name, 2**63 - 1, 90, 31))
    assert np.abs(one - other).mean() > 0.02


@pytest.fixture(scope="module")
def processes() -> Iterator[Workers]:
    with workers(2, kind="processes") as pool:
        yield pool


@SCENE
@pytest.mark.parametrize(("rows", "columns"), [(32, 1), (90, 100), (180, 200)])
def test_light_is_finite_and_not_negative(name: str, rows: int, columns: int) -> None:
    image = rendered(name, rows, columns)
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
    assert (quick(name).max(axis=2) > 1).mean() > 0.0005
    assert (light > 1).mean() < 0.01
    assert 0.1 < light.mean() < 0.4


def test_flat_and_textured_areas_in_both_and_more_detail_in_the_city() -> None:
    detail = {}
    for name in SCENES:
        luma = sensor_luma(quick(name))
        rows, columns = (n // 8 for n in luma.shape)
        blocks = luma[: 8 * rows, : 8 * columns].reshape(rows, 8, columns, 8)
        spread = blocks.std(axis=(1, 3))
        # Blocks of 8 x 8 hold four times the scene that they hold at 1920 x 1080, of which 15 % are
        # flat: `python benchmarks/scenes.py --presets lab`.
        assert (spread < 2).mean() >= 0.05
        assert (spread > 8).mean() >= 0.30
        detail[name] = spatial_information(luma)
    assert detail["city"] >= 1.1 * detail["landscape"]


@SCENE
def test_clear_sky_is_free_of_grain(name: str) -> None:
    """The bluest patch: second differences below 1e-4 of its level, and a gradient all the same."""
    sky = rendered(name, 180, 200)[:32]
    size = 8
    places = [(r, c) for r in range(0, 32, size) for c in range(0, 200, size)]
    patches = [sky[r : r + size, c : c + size] for r, c in places]
    patch = max(patches, key=lambda patch: float((patch[..., 2] / patch[..., 0]).min()))
    for axis in (0, 1):
        assert np.abs(np.diff(patch, 2, axis)).max() < 1e-4 * patch.mean()
    assert patch.std() > 0


@SCENE
def test_presets_look_alike(name: str) -> None:
    """Half the size is the average of the full size: what is too fine fades and does not alias."""
    small, large = rendered(name, 90, 100), rendered(name, 180, 200)
    shown = sensor_luma(large)
    light = np.clip(small, 0, 1)
    curve = np.where(light < 0.018, 4.5 * light, 1.099 * light**0.45 - 0.099)
    difference = float(np.std(255 * curve @ REC709_LUMINANCE - shown))
    # Unrelated pictures would differ by sqrt(2) standard deviations; a fifth of that leaves room
    # for the few points of a pixel, leaves and glitter.
    assert difference < 0.2 * math.sqrt(2) * float(np.std(shown))


def test_everything_out_of_range_is_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        panorama(Strip("seaside", -1, 8, 0, 0, 0))
    keys = [fault.key for fault in caught.value.faults]
    assert keys == ["scene", "scene_seed", "rows", "columns", "samples", "ambient"]
    assert "city, landscape" in str(caught.value)
