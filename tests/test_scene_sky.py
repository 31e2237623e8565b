"""One sky for both scenes: smooth where it is clear, the same from every side, never negative."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from dsis.scenes import sky

SUN = (math.radians(70), math.radians(35))
FOCAL_PX = 600.0


@pytest.fixture(scope="module")
def dome() -> sky.SkyDome:
    return sky.SkyDome.of(3, *SUN)


def painted(dome: sky.SkyDome, rows: int, columns: int) -> NDArray[np.float32]:
    image = np.empty((rows, columns, 3), np.float32)
    slopes, azimuths = 0.3 - (np.arange(rows) + 0.5) / FOCAL_PX, np.arange(columns) / FOCAL_PX
    sky.paint(dome, slopes, azimuths, image)
    return image


def test_the_same_bytes_every_time_and_another_sky_for_another_seed(dome: sky.SkyDome) -> None:
    image = painted(dome, 120, 200)
    assert image.tobytes() == painted(dome, 120, 200).tobytes()
    assert image[:, :90].tobytes() == painted(dome, 120, 90).tobytes()
    again, other = sky.SkyDome.of(3, *SUN), sky.SkyDome.of(4, *SUN)
    assert again.table.tobytes() == dome.table.tobytes()
    assert np.abs(other.table - dome.table).mean() > 0.005


def test_the_sun_stands_where_it_was_put(dome: sky.SkyDome) -> None:
    """Azimuth 0 is along y, a quarter turn along x; the glow is strongest around the sun."""
    east, north, up = dome.sun_direction
    assert math.atan2(east, north) == pytest.approx(SUN[0])
    assert math.asin(up) == pytest.approx(SUN[1])
    rows, columns = dome.table.shape[:2]
    row, column = round(up * (rows - 1)), round(SUN[0] / (2 * math.pi) * columns)
    there = dome.table[row, column].sum()
    assert there > 1.3 * dome.table[row, (column + columns // 2) % columns].sum()


def test_light_is_finite_and_clouds_are_white_in_the_sun(dome: sky.SkyDome) -> None:
    image = painted(dome, 180, 900)
    for light in (image, dome.table):
        assert np.isfinite(light).all()
        assert light.min() > 0
    blueness = image[..., 2] / image[..., 0]
    clouds = image[blueness < 1.15]
    assert 0.02 < len(clouds) / blueness.size < 0.7
    assert clouds.max() > 0.9  # sunlit sides near the white of the scene
    assert clouds.min() < 0.55  # grey bases


def test_clear_sky_has_no_scatter_beyond_its_gradient(dome: sky.SkyDome) -> None:
    """Second differences below 1e-4 of the level, in every cloudless block of 16 x 16."""
    image = painted(dome, 160, 800)
    blueness = image[..., 2] / image[..., 0]
    clear = blueness > 0.95 * blueness.max(axis=1, keepdims=True)  # no cloud is as blue
    found = 0
    for row in range(0, 96, 16):
        for column in range(0, 800, 16):
            patch = image[row : row + 16, column : column + 16].astype(np.float64)
            if clear[row : row + 16, column : column + 16].all():
                found += 1
                for axis in (0, 1):
                    assert np.abs(np.diff(patch, 2, axis)).max() < 1e-4 * patch.mean()
                assert np.ptp(patch) > 0
    assert found > 20


def test_the_sky_below_the_horizon_is_the_horizon(dome: sky.SkyDome) -> None:
    image = np.empty((3, 5, 3), np.float32)
    sky.paint(dome, np.array([0.0, -0.1, -0.4]), np.linspace(0, 6, 5), image)
    assert np.array_equal(image[0], image[1])
    assert np.array_equal(image[0], image[2])
