"""Promise: tables of curves are as exact as single precision, or are not used."""

import numpy as np
import PyOpenColorIO as ocio  # noqa: N813 - the name that its own examples use
import pytest

from dsis.color import STUDIO_CONFIG, Color, DisplayTransform, _steps
from dsis.curves import TOLERANCE, Curve

VIEWS = ("ACES 1.0 - SDR Video", "ACES 1.0 - SDR Video (D60 sim on D65)", "Un-tone-mapped", "Raw")
# A view subtracts nearly equal lights, which leaves single precision's 1e-7, and takes a root: its
# slope is 0.4 v / v^2.4 at the value v, 900 at 8-bit code 1, where 6e-5 is seen (a sixtieth of a
# code), and 10 at a tenth of white.
AT_BLACK, DARK, ELSEWHERE = 1e-4, 0.1, 5e-6


def gamma(pixels: np.ndarray) -> np.ndarray:
    """Return three different powers, computed in double precision."""
    base = np.maximum(np.where(np.isnan(pixels), 0, pixels), 0).astype(np.float64)
    return (base ** np.array([1 / 2.4, 0.5, 0.9])).astype(np.float32)


def test_a_smooth_curve_at_all_magnitudes() -> None:
    curve = Curve.of(gamma)
    assert curve is not None
    rng = np.random.default_rng(0)
    pixels = (10.0 ** rng.uniform(-37, 37, (100_000, 3))).astype(np.float32)
    wanted = gamma(pixels)
    curve.apply(pixels)
    np.testing.assert_allclose(pixels, wanted, rtol=2e-7)  # one or two units in the last place


def test_what_is_no_positive_number() -> None:
    curve = Curve.of(gamma)
    assert curve is not None
    odd = [0.0, -0.0, -1.0, -np.inf, np.nan, 1e-45]
    pixels = np.repeat(np.array(odd, np.float32)[:, np.newaxis], 3, axis=1)
    curve.apply(pixels)
    np.testing.assert_array_equal(pixels, 0)


def test_a_curve_that_a_table_cannot_hold_gets_none() -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        assert (
            Curve.of(lambda pixels: np.where(pixels > 0.300001, np.float32(1), np.float32(0)))
            is None
        )
        assert Curve.of(lambda pixels: np.sin(np.minimum(pixels, 1e6) * np.float32(50))) is None
        assert Curve.of(np.cbrt) is None  # negative numbers count


@pytest.mark.parametrize("view", VIEWS)
def test_the_display_transform_is_opencolorios(view: str) -> None:
    rng = np.random.default_rng(1)
    scene = rng.lognormal(-1.5, 1.5, (400, 300, 3)).astype(np.float32)
    scene[:100] = rng.normal(0.02, 0.03, (100, 300, 3))  # noise about black
    scene[0, :4] = [[0, 0, 0], [-1, -1, -1], [np.nan, 1, 1], [1e6, 1e6, 1e6]]
    color = Color(view=view)
    config = ocio.Config.CreateFromBuiltinConfig(STUDIO_CONFIG)
    processor = config.getProcessor(
        color.scene_space, color.display, view, ocio.TRANSFORM_DIR_FORWARD
    )
    wanted = scene.copy()
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(wanted)
    found = DisplayTransform(color).display_from_scene(scene)
    off = np.abs(found - wanted)[~np.isnan(wanted)]
    size = np.abs(wanted[~np.isnan(wanted)])
    assert off.max() < AT_BLACK * max(1, size.max())
    assert (off / np.maximum(1, size))[size > DARK].max() < ELSEWHERE
    np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted))


def test_the_slow_curves_are_tables() -> None:
    """Else the transform would be right, and three times slower."""
    kinds = [
        type(getattr(step, "__self__", None)).__name__ for step in _steps(Color(view=VIEWS[0]))
    ]
    assert kinds.count("Curve") == 2
    assert TOLERANCE < 1 / 255 / 255
