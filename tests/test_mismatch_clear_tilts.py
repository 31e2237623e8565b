"""A clear tilt in units of a noise that scatters would be off by many standard errors."""

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.parts import parts, sure_of_lines
from dsis.effects import registry
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS = 64, 96
TILT = 60.0  # of a map of noise 1: from edge to edge 120


def test_the_noise_of_lines_counts_beyond_chance_only() -> None:
    dof = 60.0
    chance = (2 / dof) ** 0.5
    assert sure_of_lines(1 + 2.9 * chance, 1.0, dof) == 1
    assert sure_of_lines(0.5, 1.0, dof) == 1
    assert sure_of_lines(10.0, 1.0, dof) == pytest.approx(10 / (1 + 3 * chance))


def test_a_clear_tilt_scatters_as_little_as_none() -> None:
    """Its coefficient has an error of 1 in units of the noise, whatever chance makes of lines."""
    rng = np.random.default_rng(1)
    tilt = TILT * np.linspace(-1, 1, ROWS)[:, np.newaxis]
    drawn = [rng.standard_normal((ROWS, COLUMNS)) for _ in range(200)]
    name = "fixed_smooth_tilt of rows"
    plain, tilted = (
        np.array([parts(image + more, 1.0).numbers[name][0] for image in drawn])
        for more in (0.0, tilt)
    )
    assert plain.std() == pytest.approx(1, rel=0.15)
    # The mean square of all pixels is known to 1.8 %: so is its root to 0.9 %.
    relative = (2 / (ROWS * COLUMNS)) ** 0.5 / 2
    expected = np.hypot(1, relative * tilted.mean())
    assert tilted.std() == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("seed", [8, 10])
def test_uneven_light_that_the_model_has_is_a_match(seed: int) -> None:
    true = camera(registry()["shading"](falloff_percent=0.0, tilt_down_percent=-1.5))
    found = find_mismatch(true, recorded(true, seed), seed=1, vocabulary=frozenset())
    assert found.verdict == "match"


def test_a_map_whose_pixels_are_all_alike_is_no_error() -> None:
    """As of frames that a limit cuts off altogether."""
    numbers = parts(np.full((48, 64), 3.0), 1.0).numbers
    assert not any(np.isinf(value) for value, _ in numbers.values())
    assert numbers["fixed_pixel_variance"][0] == pytest.approx(0, abs=1e-6)
