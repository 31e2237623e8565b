"""Standard errors of parameters: no smaller than pixels, sensors or gaps between levels allow."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.polish import shifted
from analysis.mismatch.segments import second_path
from analysis.mismatch.state import State
from analysis.mismatch.uncertainty import _slope, inverse_information, settled
from dsis.camera import Camera
from dsis.effects.dsnu import Dsnu
from dsis.effects.hot_pixels import HotPixels
from mismatch_recordings import COLUMNS, ROWS, camera, recorded, state_of_all

NUMBERS = 100_000
SURE = 5.0  # standard errors


def _state(true: Camera, model: Camera, seed: int) -> State:
    return state_of_all(recorded(true, seed), model)


@pytest.mark.parametrize("scatter", [0.0, 1.0, 3.0])
def test_scatter_of_slopes_is_no_information(scatter: float) -> None:
    """Slopes of 1 and +-1 in 10^5 numbers, seen in 8 sensors that scatter: that of the true ones.

    The square of the mean slope is 1 + scatter^2 / 8 times too large. Products of different sensors
    scatter by 2 scatter / sqrt(8 10^5) and scatter^2 sqrt(2 / (8 10^5 7)): 1 % at most.
    """
    rng = np.random.default_rng(3)
    true = np.stack([np.ones(NUMBERS), rng.choice([-1.0, 1.0], NUMBERS)], 1)
    slopes = true + scatter * rng.standard_normal((8, NUMBERS, 2))
    inverse, share = inverse_information(slopes, np.full(NUMBERS, 4.0))
    expected = np.linalg.inv(4 * true.T @ true)
    assert np.diag(inverse) == pytest.approx(np.diag(expected), rel=SURE * 0.01)
    assert share == pytest.approx(1 / (1 + scatter**2 / 8), abs=SURE * 0.01)


@dataclass(frozen=True)
class _Squares:
    """What numbers do that go with the square of an effect."""

    def changes(self, camera: Camera) -> np.ndarray:
        (effect,) = camera.effect
        assert isinstance(effect, Dsnu)
        return np.full((1, 3), effect.sigma_dn**2)


def test_a_slope_is_that_of_the_middle_of_its_step() -> None:
    """Of sigma^2 = 4 by log sigma it is 8: from 1 to 1.12 sigma alone it would be 9."""
    effects = (Dsnu(sigma_dn=2.0),)
    free = [(0, "sigma_dn", False)]
    (up,), (down,) = (list(shifted(camera(), effects, free, way)) for way in (1, -1))
    assert up[1] == -down[1] > 0
    assert _slope(_Squares(), (up, down), 3) == pytest.approx(8, rel=0.01)
    assert _slope(_Squares(), ((None, 1.0), (None, 1.0)), 3) == pytest.approx(0)


def test_few_hot_pixels_tell_their_law_no_better_than_their_number_allows() -> None:
    """The bounds of Cramer and Rao: of n exponential heights 1 / sqrt(n), of their share as much.

    The recording holds 37 hot pixels, give or take 6; the fit cannot know them all.
    """
    share, mean = 0.003, 4000.0
    hot = HotPixels(pixel_fraction=share, mean_dn_per_s=mean)
    state = _state(camera(hot), camera(hot), 5)
    bare = state.camera.model_copy(update={"effect": ()})
    free = ("pixel_fraction", "mean_dn_per_s")
    told = settled(state, bare, [Proposal(hot, free)])
    (found,), (errors,) = told.effects, told.errors
    bound = 1 / sqrt(share * ROWS * COLUMNS)
    for name, true in zip(free, (share, mean), strict=True):
        value = getattr(found, name)
        assert errors[name] / value > bound
        assert abs(value - true) < 3 * errors[name]


@pytest.mark.parametrize(("slope", "sure"), [(1.0, True), (0.51, False)])
def test_the_error_of_a_switch_counts_every_gap_it_may_lie_in(slope: float, sure: bool) -> None:
    """A switch at 1200 DN lies in the gap from 900 to 1600 DN, uniformly about 1250 DN.

    A second slope that is 2 % steeper could begin anywhere.
    """
    state = _state(camera(segments=((0.5, 20.0, 1200.0), (slope, 20.0, None))), camera(), 6)
    path = second_path(state)
    assert path is not None
    uniform = sqrt(700**2 / 12 + 50**2)
    if sure:
        assert 900 < path.switch_dn < 1600
        assert path.error_dn == pytest.approx(uniform, rel=0.02)
    else:
        assert path.error_dn > 1.2 * uniform
