"""The rendered landscape: reproducible, free of grain, with real blacks and lights."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dsis.scenes import Strip, landscape, panorama, preset_strip, render
from dsis.scenes.landscape import crown, house, planting, water
from dsis.scenes.landscape.relief import LAKE_M, Relief

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709-6, item 3.2


@cache
def picture() -> NDArray[np.float32]:
    """Return what comes with dsis: `test_scenes_shipped.py` holds it against the renderer."""
    return panorama(preset_strip("quick", "landscape", 1))


def test_the_pan_may_go_all_around_the_eye() -> None:
    image = render(Strip("landscape", 2, 32, 480, 1, 1))  # 6.8 rad
    assert np.isfinite(image).all()
    turn = round(2 * math.pi * 32 * 16 / 9 / landscape.FIELD_RAD)
    sky_and_hills = slice(0, 16)
    difference = image[sky_and_hills, turn : turn + 30] - image[sky_and_hills, :30]
    assert np.abs(difference).mean() < 0.05  # columns do not fall on the same azimuths


def test_exposure_range_and_detail() -> None:
    light = picture() @ REC709_LUMINANCE
    assert np.isfinite(light).all()
    dark, bright = np.percentile(light, [0.1, 99.9])
    assert math.log2(bright / dark) >= 7
    assert dark < 0.01
    assert 0.8 < bright < 4.5  # glints
    assert 0.12 < light.mean() < 0.4
    pixels = picture().reshape(270, 2, 730, 2, 3).mean(axis=(1, 3))
    assert 0.001 < (pixels.max(axis=2) > 1).mean() < 0.003  # the sun's glitter, whatever is clipped
    linear = np.clip(pixels, 0, 1) @ REC709_LUMINANCE
    luma = 255 * np.where(linear < 0.018, 4.5 * linear, 1.099 * linear**0.45 - 0.099)
    spread = luma[:264, :728].reshape(33, 8, 91, 8).std(axis=(1, 3))
    assert (spread < 2).mean() > 0.03  # of 8 x 8 pixels; 0.15 at 1920 x 1080, where they see less
    assert (spread > 8).mean() > 0.3


def test_no_grain_shows_between_one_sampling_and_another() -> None:
    """Sky and water are alike whatever the number of points: what differs lies on edges."""
    fine, coarse = (render(Strip("landscape", 4, 120, 60, n)) for n in (9, 4))
    gradient = np.abs(np.diff(fine, axis=0)).max(axis=2)[:, :-1]
    smooth = np.pad(gradient[:40], ((1, 0), (0, 1)))[:40] < 0.004
    difference = np.abs(fine - coarse)[:40].max(axis=2)
    assert smooth.mean() > 0.2
    assert np.percentile(difference[smooth], 95) < 0.002


def test_trees_stand_on_dry_land_and_houses_keep_clear_of_them() -> None:
    relief = Relief.of(7)
    things = planting.things(relief, 7, 0.0, 0.7)
    assert np.all(np.diff(things[:, planting.RANGE]) >= 0)
    far = things[things[:, planting.RANGE] > 230]
    ground = relief.at(relief.height, far[:, planting.X], far[:, planting.Y])
    assert ground.min() > LAKE_M
    kinds = np.unique(things[:, planting.KIND])
    assert set(kinds) == set(range(5))
    part = planting.things(relief, 7, 0.2, 0.5)
    known = {tuple(row) for row in things.round(9)}
    assert all(tuple(row) in known for row in part.round(9))  # the sector does not matter


def test_a_ray_crosses_a_house_as_its_plan_says() -> None:
    """A ray along x at 2 m height crosses 12 m; above the eaves it meets the roof's slope."""
    row = np.zeros(planting.COLUMNS)
    row[[planting.X, planting.HALF_X, planting.HALF_Y, planting.EAVES]] = 50.0, 6.0, 4.0, 5.0
    row[[planting.PITCH_Y, planting.COS]] = 1.0, 1.0
    found = np.empty(5)
    assert house.cross(found, (0.0, 0.0, 2.0), (1.0, 0.0, 0.0), row) == pytest.approx(56)
    assert found[0] == pytest.approx(44)
    assert tuple(found[1:4]) == (-1.0, 0.0, 0.0)
    leave = house.cross(found, (50.0, -20.0, 7.0), (0.0, 1.0, 0.0), row)
    assert found[0] == pytest.approx(18)  # 2 m above the eaves, 2 m inside them
    assert leave == pytest.approx(22)
    assert found[4] >= house.ROOF
    assert house.cross(found, (0.0, 0.0, 9.1), (1.0, 0.0, 0.0), row) == -1e9  # over the ridge


def test_a_crown_weakens_light_by_the_length_of_the_way_through_it() -> None:
    """One sphere of radius 0.82 r: exp(-depth), depth = extinction x chord."""
    tree = np.zeros(planting.COLUMNS)
    tree[[planting.X, planting.RADIUS, planting.HEIGHT]] = 30.0, 5.0, 10.0
    shape = np.zeros((planting.LOBES, 4))
    point, ray = (0.0, 0.0, 1.05 * 5.0), (1.0, 0.0, 0.0)
    depth = crown.optical_depth(point, ray, 0.0, 100.0, tree, shape, True)
    assert depth == pytest.approx(crown.FOLIAGE_PER_M * 2 * 0.82 * 5.0)
    half = crown.optical_depth(point, ray, 30.0, 100.0, tree, shape, True)
    assert half == pytest.approx(depth / 2)
    assert crown.optical_depth(point, ray, 40.0, 100.0, tree, shape, True) == 0


def test_the_glitter_is_as_bright_as_cox_and_munk_say() -> None:
    """Over a patch of lake seen against the sun: the mean of its cells is that of the slopes.

    Facets that lean as half-way between eye and sun have the density p of a normal law of the
    clean sea's variances (their table, mean of both axes); each mirrors L = pi F p / (4 cos^4 b
    cos v) of a white surface's radiance (b the lean, v the eye's angle from the vertical).
    """
    dip, rise, variance = 0.20, 0.55, 0.0015 + 0.00256 * water.GUST_M_PER_S
    sun = np.array([0.0, math.cos(rise), math.sin(rise)])
    ray = (0.0, 1.0, -math.tan(dip))
    x, y = (0.35 * (axis.ravel() + 0.5) for axis in np.meshgrid(np.arange(400), np.arange(400)))
    cells = [water._glitter(ray, a, b, sun, 1.0, 0.1) for a, b in zip(x, y, strict=True)]
    lean = (rise - dip) / 2
    density = math.exp(-(math.tan(lean) ** 2) / (2 * variance)) / (2 * math.pi * variance)
    fresnel = 0.02 + 0.98 * (1 - math.cos(math.pi / 2 - (rise + dip) / 2)) ** 5
    open_water = math.pi * fresnel * density / (4 * math.cos(lean) ** 4 * math.sin(dip))
    mean, error = np.mean(cells), np.std(cells) / math.sqrt(len(cells))
    # Wavelets hide little of one another where the eye looks down by 1.7 standard deviations.
    assert 0.93 * open_water - 5 * error < mean < open_water + 5 * error
