"""Promise: pairs of conditions differ by demosaicking alone; noise is as strong as predicted."""

import numpy as np
import pytest

from dsis.camera import Camera
from dsis.cfa import mosaic, pattern
from dsis.color import Color, DisplayTransform
from dsis.spec import SHIPPED
from dsis.stimuli.conditions import Rendering
from ramp import COLUMNS, ROWS, scene


class Identity(DisplayTransform):
    """Shows scene light as it is."""

    def display_from_scene(self, rgb: np.ndarray) -> np.ndarray:
        return rgb


def rendering(camera: str, transform: type[DisplayTransform], seed: int = 1) -> Rendering:
    from dsis.camera import read_camera

    model: Camera = read_camera(SHIPPED / "cameras" / f"{camera}.toml")
    return Rendering(model, transform(Color()), seed, exposure_time_s=0.02)


@pytest.mark.parametrize("camera", ["dual_gain_cinema", "single_gain"])
@pytest.mark.parametrize("method", ["bilinear", "dlmmse", "lu_tan"])
def test_pairs_differ_by_demosaicking_alone(camera: str, method: str) -> None:
    """All three methods keep measured samples: sampled again, `dem` must be `rgb` sampled."""
    make = rendering(camera, Identity)
    clean = make.camera.clean_raw(scene(ROWS, COLUMNS))
    raw = make.noisy_raw(clean, "city", 1, 4)
    balanced = make.camera.scene_light(raw)
    full = make.display_demosaicked(raw, method)
    np.testing.assert_allclose(
        mosaic(full, make.camera.cfa), mosaic(balanced, make.camera.cfa), rtol=1e-6, atol=1e-7
    )
    codes = make.noisy_display(np.clip(scene(ROWS, COLUMNS), 0, 1), 4.0, "city", 1, 4)
    again = mosaic(make.mosaicked_display(codes, method), make.camera.cfa)
    np.testing.assert_allclose(again, mosaic(codes, make.camera.cfa), rtol=1e-6)


def test_a_display_frame_is_made_alike_in_all_its_rows() -> None:
    """Frames go through the transform in runs of rows: here three, the last one short."""
    make = rendering("dual_gain_cinema", DisplayTransform)
    raw = make.camera.clean_raw(scene(250, 160))
    at_once = make.transform.display_from_scene(make.camera.scene_light(raw))
    np.testing.assert_allclose(make.display(raw), at_once, rtol=1e-5, atol=1e-6)


def test_the_mosaic_of_sd_dem_is_the_raw_of_sd_rgb_sampled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit: what enters the demosaicker, less the white-balance gains."""
    from dsis.stimuli import conditions

    make = rendering("dual_gain_cinema", Identity)
    gain = np.array(make.camera.white_balance, np.float32)
    entered = []

    def spy(sampled: np.ndarray, cfa: object, method: str, **_: object) -> np.ndarray:
        entered.append((sampled, cfa, method))
        return np.repeat(sampled[:, :, np.newaxis], 3, axis=2)

    monkeypatch.setattr(conditions, "demosaic", spy)
    raw = make.noisy_raw(make.camera.clean_raw(scene(ROWS, COLUMNS)), "city", 0, 0)
    make.display_demosaicked(raw, "bilinear")
    colours = pattern(make.camera.cfa)
    for row in (0, 1):
        for column in (0, 1):
            c = colours[row, column]
            expected = raw[row::2, column::2, c] * gain[c]
            np.testing.assert_array_equal(entered[0][0][row::2, column::2], expected)


# Share of a raw variance that bilinear interpolation keeps, by site (red, green, green, blue) and
# channel: 1 where measured, 1/2 from two neighbours, 1/4 from four.
KEPT = {
    "sd_rgb": np.array([[1, 1, 1]]),
    "sd_dem": np.array(
        [[1, 1 / 4, 1 / 4], [1 / 2, 1, 1 / 2], [1 / 2, 1, 1 / 2], [1 / 4, 1 / 4, 1]]
    ),
}


def predicted_moments(
    make: Rendering, clean: np.ndarray, variance: np.ndarray, case: str
) -> np.ndarray:
    """Return the display variance of a flat chart (3,), by quadrature over the raw noise.

    The three channels of a site are independent and Gaussian: Gauss and Hermite's rule with 21^3
    points, averaged over the kinds of site.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    weights = weights / weights.sum()
    z = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(1, -1, 3)
    w = np.einsum("i,j,k->ijk", weights, weights, weights).ravel()
    first, second = np.zeros(3), np.zeros(3)
    for kept in KEPT[case]:
        raw = clean + z * np.sqrt(variance * kept)
        display = make.display(raw.astype(np.float32))[0].astype(np.float64)
        first += w @ display / len(KEPT[case])
        second += w @ display**2 / len(KEPT[case])
    return second - first**2


@pytest.mark.parametrize("light", [0.02, 0.18, 0.5])
@pytest.mark.parametrize("level", [0, 2])
@pytest.mark.parametrize("case", ["sd_rgb", "sd_dem"])
def test_display_variance_of_a_flat_chart(light: float, level: int, case: str) -> None:
    """Display variance = that of the colour transform under raw noise m x + t + 1/12 (rounding).

    Tolerance: z = 5 of the sampling error; bilinear's correlated noise counts as an eighth as
    many samples (the sum of its squared correlations is below 8).
    """
    make = rendering("dual_gain_cinema", DisplayTransform)
    camera, side = make.camera, 400
    clean = camera.clean_raw(np.full((side, side, 3), light, np.float32))
    stops = np.float32(2.0**level)
    variance = (camera.segments.variance_dn2(clean[0, 0] / stops) + 1 / 12) * stops**2
    predicted = predicted_moments(make, clean[0, 0].astype(np.float64), variance, case)
    raw = make.noisy_raw(clean, "chart", level, 0)
    display = make.display(raw) if case == "sd_rgb" else make.display_demosaicked(raw, "bilinear")
    samples = (display[2:-2, 2:-2].astype(np.float64) - display.mean(axis=(0, 1))) ** 2
    loss = 8 if case == "sd_dem" else 1
    error = samples.std(axis=(0, 1)) * np.sqrt(loss) / side
    z = (samples.mean(axis=(0, 1)) - predicted) / error
    assert np.abs(z).max() < 5, f"{samples.mean(axis=(0, 1))}, predicted {predicted}"
