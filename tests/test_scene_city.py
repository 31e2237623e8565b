"""City: reproducible, free of grain, with true perspective, shadows and the range a test needs."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dsis.scenes import Strip, panorama, preset_strip, render
from dsis.scenes.city import light as sunlight
from dsis.scenes.city.cells import sort_into_cells
from dsis.scenes.city.lighting import Light
from dsis.scenes.city.panorama import city
from dsis.scenes.city.patterns import bars, smooth
from dsis.scenes.city.plan import Ground, is_bridged, street_plan
from dsis.scenes.city.rays import outward, trace
from dsis.scenes.city.solids import DETAILED_M, Kind, Solid, table
from dsis.scenes.city.streets import plan_place
from dsis.scenes.city.tracer import trace_columns

REC709_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # ITU-R BT.709-6, item 3.2
GREY = (0.5, 0.5, 0.5)
EXAMPLES = settings(max_examples=60, deadline=None)


@cache
def quick() -> NDArray[np.float32]:
    """Return what comes with dsis: `test_scenes_shipped.py` holds it against the renderer."""
    return panorama(preset_strip("quick", "city", 1))


def pixels() -> NDArray[np.float32]:
    """Return the picture as a sensor of half the resolution has it."""
    means: NDArray[np.float32] = quick().reshape(270, 2, 730, 2, 3).mean(axis=(1, 3))
    return means


def test_more_samples_sharpen_edges_and_surfaces_do_not_sparkle() -> None:
    """The same points in every pixel; the sky is painted once, whatever the samples."""
    coarse, fine = (render(Strip("city", 5, 48, 40, samples)) for samples in (2, 12))
    difference = np.abs(coarse - fine).max(axis=2)
    assert np.median(difference) < 0.03
    assert difference[:8].max() < 1e-5


def test_a_wide_pan_meets_no_end() -> None:
    """More than half a turn: everywhere a city, no column far darker than others."""
    image = render(Strip("city", 3, 32, 300, 1, 1))
    assert np.isfinite(image).all()
    columns = image[16:].mean(axis=(0, 2))
    assert np.percentile(columns, 2) > 0.2 * np.median(columns)


def test_exposure_and_range() -> None:
    assert np.isfinite(quick()).all()
    assert quick().min() >= 0
    luminance = pixels() @ REC709_LUMINANCE
    dark, bright = np.percentile(luminance, [0.1, 99.9])
    assert math.log2(bright / dark) >= 7
    assert (luminance < 0.01).mean() > 0.001  # courts, and under cars
    assert 0.8 < bright < 1.3
    assert quick().max() > 1.2  # glints
    assert (luminance > 1).mean() < 0.006
    assert 0.15 < luminance.mean() < 0.35


def test_shadows_are_bluer_than_sunlight() -> None:
    """Roofs and streets share their colours; what the sky alone lights is bluer."""
    city = pixels()[120:, :600]  # below the sky, and not only the river
    luminance = city @ REC709_LUMINANCE
    low, high = np.percentile(luminance, [30, 70])
    blueness = city[..., 2] / luminance
    assert np.median(blueness[luminance < low]) > 1.05 * np.median(blueness[luminance > high])


@given(x=st.floats(-900, 900), y=st.floats(60, 2500), seed=st.integers(0, 50))
@EXAMPLES
def test_plan_and_world_are_inverse(x: float, y: float, seed: int) -> None:
    plan = street_plan(seed)
    a, b = plan_place(plan, x, y)
    # Each of the 8 fixed-point steps shrinks the error at least fivefold, from 60 m.
    assert plan.world(a, b) == pytest.approx((x, y), abs=60 * 5.0**-8 * 2)


def test_the_plan_has_a_river_and_houses_and_no_overlap() -> None:
    plan = street_plan(7)
    assert (plan.grounds == Ground.RIVER).all(axis=1).sum() == 1
    assert (plan.grounds == Ground.HOUSES).mean() > 0.5
    bridged = [j for j in range(60) if is_bridged(7, j)]
    assert 5 <= len(bridged) <= 20
    assert min(np.diff(bridged)) >= 3
    assert len(set(np.diff(bridged))) > 1
    for low, high in ((plan.a_low, plan.a_high), (plan.b_low, plan.b_high)):
        assert (high > low).all()
        assert (low[1:] - high[:-1] >= 10).all()  # streets


SOLIDS = st.builds(
    Solid,
    x=st.floats(-8, 8), y=st.floats(-8, 8), base=st.floats(0, 4), yaw=st.floats(-3, 3),
    half_x=st.floats(1, 6), half_y=st.floats(1, 6), height=st.floats(0.5, 9),
    kind=st.just(Kind.PLAIN), wall=st.just(GREY),
    slope_x=st.sampled_from([0.0, 0.7, 2.0]), slope_y=st.sampled_from([0.0, 0.9, 3.0]),
    rise=st.sampled_from([math.inf, 1.5]),
)  # fmt: skip
DIRECTIONS = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)).filter(
    lambda d: math.hypot(*d) > 0.1
)


def holds(solid: Solid, place: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether places (..., 3) are inside a solid, as its docstring defines it."""
    cos, sin = math.cos(solid.yaw), math.sin(solid.yaw)
    gx, gy = place[..., 0] - solid.x, place[..., 1] - solid.y
    x, y = np.abs(cos * gx + sin * gy), np.abs(cos * gy - sin * gx)
    roof = np.minimum(solid.slope_y * (solid.half_y - y), solid.rise)
    if solid.slope_x and solid.slope_y:
        roof = np.minimum(roof, solid.slope_x * (solid.half_x - x))
    up = place[..., 2] - solid.base
    inside = (x <= solid.half_x) & (y <= solid.half_y) & (up >= 0)
    return np.asarray(inside & (up <= solid.height + roof))


@given(solid=SOLIDS, aim=st.tuples(*[st.floats(-5, 5)] * 3), direction=DIRECTIONS)
@EXAMPLES
def test_a_ray_enters_a_solid_where_the_solid_begins(
    solid: Solid, aim: tuple[float, float, float], direction: tuple[float, float, float]
) -> None:
    d = np.array(direction) / math.hypot(*direction)
    start = np.array([solid.x, solid.y, solid.base + 4]) + aim - 40 * d
    rows = table([solid])
    cells = sort_into_cells(rows, 100.0, 7.0)
    t, which, face = trace(rows, cells, tuple(start), tuple(d), 90.0, 1e-3, False)
    along = np.linspace(0, 90, 9001)
    inside = holds(solid, start + along[:, None] * d)
    if which < 0:
        assert inside.sum() <= 1  # a corner may be grazed between two steps
        return
    before, after = holds(solid, start + np.array([[t - 1e-6], [t + 1e-6]]) * d)
    assert not before
    first = along[inside][0] if inside.any() else t
    assert t <= first + 1e-6
    assert first - t < 0.01 + 1e-6 or not after  # else the stretch is shorter than a step
    normal = np.array(outward(rows[0], face, tuple(start + t * d)))
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert normal @ d < 1e-9  # seen from outside


@given(solids=st.lists(SOLIDS, min_size=2, max_size=9), direction=DIRECTIONS)
@EXAMPLES
def test_cells_lose_no_solid(solids: list[Solid], direction: tuple[float, float, float]) -> None:
    """The raster finds what a search through all solids finds."""
    d = tuple(float(c) for c in np.array(direction) / math.hypot(*direction))
    rows = table(solids)
    start = (-20 * d[0] + 0.3, -20 * d[1] - 0.2, 3.0 - 20 * d[2])
    found = [
        trace(rows, sort_into_cells(rows, 64.0, size), start, d, 90.0, 1e-3, False)
        for size in (1.7, 128.0)
    ]
    assert found[0][0] == pytest.approx(found[1][0], abs=1e-9)
    assert (found[0][1] < 0) == (found[1][1] < 0)


def test_perspective_and_shadow_have_the_right_size() -> None:
    """A lone tower on the axis: its outline in the picture, its shadow on the ground."""
    tower = Solid(0, 500, 0, 0, 10, 10, 124, Kind.PLAIN, (0.9, 0.9, 0.9))
    rows = table([tower])
    cells = sort_into_cells(rows, 1000.0, 12.0)
    dark = np.zeros((97, 384, 3), np.float32)
    light = Light(sunlight.sun_points(4), np.ones(3), sunlight.sky_sets(4, 2), dark, np.zeros(3),
                  np.zeros(3))  # fmt: skip
    pixel, horizon = 1 / 2000, 300.0
    image = np.zeros((300, 200, 3), np.float32)
    points = np.full((4, 2), 0.5)
    trace_columns(image, rows, cells, street_plan(1), light, points, 74.0, -100 * pixel, horizon,
                  pixel)  # fmt: skip
    seen = image[..., 1] > 0
    height, width = 2000 * (124 - 74) / 490, 2000 * 2 * math.atan(10 / 490)
    assert seen[:, 100].sum() == pytest.approx(height, abs=1.1)
    assert seen[250].sum() == pytest.approx(width, abs=2.1)
    sun = sunlight.SUNWARD
    reach = 124 / math.tan(sunlight.SUN_ELEVATION_RAD)
    away = -sun[:2] / np.hypot(*sun[:2])
    tip = reach + 10 / np.abs(away).max()  # from the tower's middle, whose far side casts it
    for beyond, shaded in ((-0.1, True), (0.1, False)):
        place = (*(np.array([0, 500]) + (tip + beyond) * away), 1e-9)
        _, which, _ = trace(rows, cells, place, tuple(sun), 400.0, 1e-3, True)
        assert (which >= 0) == shaded


def test_sky_and_sun_are_sampled_without_bias() -> None:
    sets = sunlight.sky_sets(4, 4)
    every = sets.reshape(-1, 3)
    assert np.linalg.norm(every, axis=1) == pytest.approx(1)
    # Means of cos, cos^2 under a density of cos / pi over the hemisphere: 2/3 and 1/2; 16 points of
    # a low-discrepancy sequence err by about log(16)/16.
    assert every[:, 2].mean() == pytest.approx(2 / 3, abs=math.log(16) / 16)
    assert (every[:, 2] ** 2).mean() == pytest.approx(1 / 2, abs=math.log(16) / 16)
    assert np.abs(every[:, :2].mean(axis=0)).max() < math.log(16) / 16
    disc = sunlight.sun_points(64) @ sunlight.SUNWARD
    assert np.arccos(np.minimum(disc, 1)).max() <= sunlight.SUN_RADIUS_RAD
    # A uniform disc: half of the points within radius / sqrt 2.
    within = np.arccos(np.minimum(disc, 1)) < sunlight.SUN_RADIUS_RAD / math.sqrt(2)
    assert within.mean() == pytest.approx(0.5, abs=1 / 64)


@given(duty=st.floats(0.05, 0.95), pixel=st.floats(0.01, 4), x=st.floats(-5, 5))
@EXAMPLES
def test_bars_are_averaged_over_a_pixel(duty: float, pixel: float, x: float) -> None:
    places = x + pixel * ((np.arange(20000) + 0.5) / 20000 - 0.5)
    share = float((places % 1 < duty).mean())
    edges = 2 * (pixel + 1)  # each edge may be off by one of the 20000 places
    assert bars(x, duty, pixel) == pytest.approx(share, abs=edges / 20000 + 1e-9)


@given(x=st.floats(-300, 300), y=st.floats(-300, 300), seed=st.integers(0, 1000))
@EXAMPLES
def test_noise_is_bounded_and_continuous(x: float, y: float, seed: int) -> None:
    here, near = smooth(x, y, seed), smooth(x + 1e-4, y - 1e-4, seed)
    assert abs(here) <= 1
    # Smoothstep's slope is at most 1.5, values span 2, two axes.
    assert abs(here - near) <= 2 * 1.5 * 2 * 1e-4 + 1e-9


def test_near_blocks_are_furnished() -> None:
    solids = city(street_plan(1), 0.2)
    near = {s.kind for s in solids if math.hypot(s.x, s.y) < DETAILED_M}
    assert near == set(Kind)
