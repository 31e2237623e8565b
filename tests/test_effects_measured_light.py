"""Light of a measured shape, and bands of mains light whose phase moves on."""

import numpy as np
import pytest

from dsis.cfa import Cfa
from dsis.effects.line_flicker import LineFlicker
from dsis.effects.shading import Shading, Surface
from dsis.grid import PixelGrid
from exposing import SIDE, apply, camera, flat

ROWS, COLUMNS = 30, 44
SITES = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}


def _field(seed: int) -> Surface:
    values = np.random.default_rng(seed).normal(0, 3, (4, 3))
    return tuple(tuple(row) for row in values.tolist())


def _expected(own: Surface, fall: float) -> np.ndarray:
    """Return 1 - f r^2 / R^2 + sum g L(v) L(u), as numpy has the polynomials."""
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(np.float64)
    v, u = (y - (ROWS - 1) / 2) / (ROWS / 2), (x - (COLUMNS - 1) / 2) / (COLUMNS / 2)
    square = ((v * ROWS) ** 2 + (u * COLUMNS) ** 2) / (ROWS**2 + COLUMNS**2)
    added = np.polynomial.legendre.legval2d(v, u, np.asarray(own) / 100)
    return np.asarray(1 - fall / 100 * square + added)


def test_a_field_adds_polynomials_to_each_colour() -> None:
    fields = tuple(_field(k) for k in range(4))
    one = Shading(falloff_percent=20.0, field=fields)
    grid = PixelGrid(ROWS, COLUMNS, Cfa.RGGB)
    made = apply(one, np.full((ROWS, COLUMNS), 1000.0), grid=grid)
    for own, (y, x) in zip(fields, SITES.values(), strict=True):
        expected = 1000 * _expected(own, 20.0)[y::2, x::2]
        np.testing.assert_allclose(made[y::2, x::2], expected, rtol=1e-5)
    crop = PixelGrid(10, 12, Cfa.RGGB, 6, 4, ROWS, COLUMNS)
    part = apply(one, np.full((10, 12), 1000.0), grid=crop)
    np.testing.assert_array_equal(part, made[6:16, 4:16])


def test_planes_have_the_field_of_their_colour() -> None:
    fields = tuple(_field(k) for k in range(4))
    grid = PixelGrid(ROWS, COLUMNS)
    made = apply(Shading(falloff_percent=0, field=fields), np.ones((ROWS, COLUMNS, 3)), grid=grid)
    red, *greens, blue = (_expected(own, 0.0) for own in fields)
    expected = np.stack([red, np.mean(greens, axis=0), blue], 2)
    np.testing.assert_allclose(made, expected, rtol=1e-5)


def test_a_monochrome_field_says_what_it_does_to_the_mean() -> None:
    one = Shading(falloff_percent=10.0, field=(_field(5),))
    expected = _expected(_field(5), 10.0)
    made = apply(one, np.full((ROWS, COLUMNS), 100.0))
    np.testing.assert_allclose(made, 100 * expected, rtol=1e-5)


def test_fields_that_no_camera_can_have_are_refused() -> None:
    with pytest.raises(ValueError, match="must have 1, or 4 of a mosaic"):
        Shading(falloff_percent=1.0, field=(_field(1), _field(2)))
    with pytest.raises(ValueError, match="equally many coefficients"):
        Shading(falloff_percent=1.0, field=(((1.0, 2.0), (3.0,)),))
    with pytest.raises(ValueError, match="field of 1 surfaces"):
        camera(Shading(falloff_percent=1.0, field=(_field(1),)), cfa=Cfa.RGGB)


def test_bands_of_a_lamp_and_frames_that_keep_their_rates_move_on() -> None:
    """By 0.3 of a turn in each frame; frames before the first one are behind it."""
    one = LineFlicker(depth_percent=1.0, cycles_per_frame=5.0, turns_per_frame=0.3)
    phases = {}
    for frame in (0, 1, 2, 7, 2**32 - 1):
        image = apply(one, flat(3000.0), frame)
        phases[frame] = np.angle(np.fft.fft(image[:, 0])[5]) / (2 * np.pi)
        assert 2 * np.abs(np.fft.fft(image[:, 0])[5]) / SIDE == pytest.approx(30.0, rel=1e-4)
    for frame, turns in ((1, 0.3), (2, 0.6), (7, 2.1), (2**32 - 1, -0.3)):
        moved = (phases[frame] - phases[0] - turns + 0.5) % 1 - 0.5
        assert moved == pytest.approx(0, abs=1e-3)
