"""Promise: patterns of effects have the shape, strength and phase of their closed forms.

Measured without dsis's own measures; tolerances are five standard errors.
"""

import numpy as np
import pytest
from scipy import stats

from dsis.cfa import Cfa
from dsis.grid import PixelGrid
from exposing import P_MIN, SIDE, Z_MAX, apply, effect, flat


def test_line_flicker_is_a_sinusoid_of_its_depth() -> None:
    s, depth, cycles = 3000.0, 1.0, 5.0
    one = effect("line_flicker", depth_percent=depth, cycles_per_frame=cycles)
    phases = []
    for t in range(40):
        image = apply(one, flat(s), t)
        assert np.ptp(image, axis=1).max() == 0
        power = np.fft.rfft(image[:, 0] - s)
        assert np.abs(power).argmax() == cycles
        np.testing.assert_allclose(2 * np.abs(power[5]) / SIDE, depth / 100 * s, rtol=1e-4)
        assert image[:, 0].var() == pytest.approx((depth / 100 * s) ** 2 / 2, rel=1e-4)
        phases.append(np.angle(power[5]))
    assert stats.kstest(phases, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > P_MIN


@pytest.mark.parametrize("along", ["rows", "columns"])
def test_pink_noise_falls_as_one_over_f_along_the_read_out(along: str) -> None:
    sigma, shape = 5.0, (128, 128)
    one, order = effect("pink_noise", sigma_dn=sigma, along=along), "CF"[along == "columns"]
    series = np.stack([apply(one, np.zeros(shape), t).ravel(order) for t in range(60)])
    power = (np.abs(np.fft.rfft(series * np.hanning(series.shape[1]))) ** 2).mean(0)
    k = np.arange(power.size)
    octaves = [(2**j, 2 ** (j + 1)) for j in range(2, 12)]
    mean_power = [power[a:b].mean() for a, b in octaves]
    centre = [1 / np.mean(1 / k[a:b]) for a, b in octaves]
    slope = np.polyfit(np.log(centre), np.log(mean_power), 1)[0]
    assert abs(slope + 1) < 0.05  # the lowest octave averages 4 bins x 60 frames: 6 %
    assert abs((series**2).mean() / sigma**2 - 1) < 0.1  # each frame mean: a tenth of the variance
    crop = apply(one, np.zeros((30, 40)), 7, grid=PixelGrid(30, 40, Cfa.MONO, 50, 60, *shape))
    np.testing.assert_array_equal(crop, series[7].reshape(shape, order=order)[50:80, 60:100])
    assert ("along" in one.model_dump()) == (along == "columns")  # what is usual is not written


@pytest.mark.parametrize(("u", "w"), [(17, 40), (128, 3), (0, 9)])
def test_periodic_noise_is_one_bin_of_free_phase(u: int, w: int) -> None:
    a = 3.0
    one = effect("periodic_noise", amplitude_dn=a, frequency=(u / SIDE, w / SIDE))
    phases = []
    for t in range(30):
        image = apply(one, flat(0.0), t)
        power = np.fft.fft2(image)
        assert np.unravel_index(np.abs(power).argmax(), power.shape) in {
            (w, u),
            (-w % SIDE, -u % SIDE),
        }
        phases.append(np.angle(power[w, u]))
        assert image.var() == pytest.approx(a**2 / 2, rel=1e-4)
    assert stats.kstest(phases, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > P_MIN


def test_a_bistable_pattern_has_two_states() -> None:
    one = effect("bistable_pattern", amplitude_dn=2.0, frequency=(0.5, 0.5))
    board = 2.0 * (-1.0) ** np.add.outer(np.arange(16), np.arange(16))
    signs = []
    for t in range(200):
        image = apply(one, flat(0.0, 16), t)
        sign = image[0, 0] / 2
        np.testing.assert_allclose(image, sign * board, atol=1e-5)
        signs.append(sign)
    assert abs(np.sum(signs)) < Z_MAX * np.sqrt(200)
    assert abs(np.sum(np.multiply(signs[1:], signs[:-1]))) < Z_MAX * np.sqrt(200)


@pytest.mark.parametrize(
    ("kind", "axis"), [("row_fpn", 1), ("column_fpn", 0), ("row_noise", 1), ("column_noise", 0)]
)
def test_line_patterns_are_constant_along_their_lines(kind: str, axis: int) -> None:
    image = apply(effect(kind, sigma_dn=5.0), flat(0.0, 1024))
    assert np.ptp(image, axis=axis).max() == 0
    assert stats.kstest(image.mean(axis), stats.norm(0, 5).cdf).pvalue > P_MIN


@pytest.mark.parametrize(("kind", "axis"), [("row_prnu", 1), ("column_prnu", 0)])
def test_gains_of_lines_are_constant_along_them_and_grow_with_the_signal(
    kind: str, axis: int
) -> None:
    one = effect(kind, sigma_percent=2.0)
    gains = apply(one, flat(1.0, 1024)) - 1
    assert np.ptp(gains, axis=axis).max() == 0
    assert stats.kstest(gains.mean(axis), stats.norm(0, 0.02).cdf).pvalue > P_MIN
    np.testing.assert_allclose(apply(one, flat(3000, 1024)) / 3000 - 1, gains, atol=1e-6)


def test_dsnu_is_an_offset_and_prnu_a_gain() -> None:
    offsets = apply(effect("dsnu", sigma_dn=4.0), flat(0.0))
    np.testing.assert_allclose(
        apply(effect("dsnu", sigma_dn=4.0), flat(3000)) - 3000, offsets, atol=1e-3
    )
    assert stats.kstest(offsets.ravel(), stats.norm(0, 4).cdf).pvalue > P_MIN
    gains = apply(effect("prnu", sigma_percent=2.0), flat(1.0)) - 1
    np.testing.assert_allclose(
        apply(effect("prnu", sigma_percent=2.0), flat(3000)) / 3000 - 1, gains, atol=1e-6
    )
    assert stats.kstest(gains.ravel(), stats.norm(0, 0.02).cdf).pvalue > P_MIN


def test_shading_falls_off_towards_the_corners() -> None:
    image = apply(effect("shading", falloff_percent=20.0), np.ones((301, 401)))
    assert image[150, 200] == 1
    np.testing.assert_allclose(image[[0, 0, -1, -1], [0, -1, 0, -1]], 0.8, atol=2e-3)
    np.testing.assert_allclose(image[150, 0], 1 - 0.2 * 0.64, atol=2e-3)  # 200^2 / 250^2
    np.testing.assert_allclose(image, image[::-1, ::-1], atol=1e-6)


def test_uneven_light_tilts_about_the_centre_and_moves_it() -> None:
    tilts = {"tilt_down_percent": -6.0, "tilt_right_percent": 4.0}
    image = apply(effect("shading", falloff_percent=0.0, **tilts), np.ones((301, 401)))
    assert image[150, 200] == 1
    np.testing.assert_allclose(image[[0, -1], 200], [1.06, 0.94], atol=2e-3)
    np.testing.assert_allclose(image[150, [0, -1]], [0.96, 1.04], atol=2e-3)
    np.testing.assert_allclose(image.mean(), 1, atol=1e-6)
    bows = {"bow_down_percent": 6.0, "bow_right_percent": -3.0}
    image = apply(effect("shading", falloff_percent=0.0, **bows), np.ones((301, 401)))
    np.testing.assert_allclose(image[150, 200], 1 - 0.02 + 0.01, atol=1e-4)
    np.testing.assert_allclose(image[[0, -1], 200], 1 + 0.04 + 0.01, atol=1e-3)
    np.testing.assert_allclose(image[150, [0, -1]], 1 - 0.02 - 0.02, atol=1e-3)
    np.testing.assert_allclose(image.mean(), 1, atol=1e-5)
    # A part of a sensor that falls off about its centre: about another centre, with a tilt.
    whole = apply(effect("shading", falloff_percent=20.0), np.ones((600, 800)))
    part = whole[:300, :400]
    own = apply(
        effect("shading", falloff_percent=5 / 0.95, tilt_down_percent=20 * 0.18 / 0.95,
               tilt_right_percent=20 * 0.32 / 0.95),
        np.ones((300, 400)),
    )  # fmt: skip
    np.testing.assert_allclose(part / part[150, 200], own, atol=1e-3)


def test_light_that_falls_with_the_fourth_power_of_the_cosine_has_a_ring() -> None:
    """Natural illumination of a corner 30 degrees off the axis, to 0.4 % of the light."""
    y, x = np.arange(301)[:, None] - 150, np.arange(401) - 200
    tangent_square = (y**2 + x**2) / (150.5**2 + 200.5**2) / 3
    fall = 100 * (1 - (1 + 1 / 3) ** -2)
    image = apply(
        effect("shading", falloff_percent=fall, ring_percent=-0.43 * fall), np.ones((301, 401))
    )
    np.testing.assert_allclose(image, (1 + tangent_square) ** -2, atol=0.004)
    one_colour = np.ones((301, 401, 3))
    colours = apply(
        effect("shading", falloff_percent=fall, ring_percent=-0.43 * fall),
        one_colour,
        grid=PixelGrid(301, 401, None),
    )
    np.testing.assert_allclose(colours[..., 1], image, atol=1e-6)


@pytest.mark.parametrize("place", ["top", "bottom", "left", "right", "top_left", "bottom_right"])
def test_glow_falls_off_exponentially_from_its_place(place: str) -> None:
    one = effect("amp_glow", dn_per_s=100.0, place=place, extent=0.2)
    image = apply(one, flat(0.0), time_s=2.0)
    lines = {
        "top": image[:, 7],
        "bottom": image[::-1, 7],
        "left": image[7],
        "right": image[7, ::-1],
        "top_left": image.diagonal(),
        "bottom_right": image.diagonal()[::-1],
    }
    step = np.sqrt(2) if "_" in place else 1.0
    distance = (np.arange(SIDE) + 0.5) * step
    np.testing.assert_allclose(lines[place], 200 * np.exp(-distance / (0.2 * SIDE)), rtol=1e-5)
