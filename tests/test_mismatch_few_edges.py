"""Outermost lines pull smooth surfaces along: they are no field of gains. Maps are numpy's own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from analysis.mismatch.fewedges import _alike, of_outermost_lines
from dsis.effects.prnu import Prnu
from dsis.effects.smooth_prnu import SmoothPrnu

FIELD = SmoothPrnu(sigma_percent=0.05, length_pixels=12.0)
NOISE = 2e-3


def _state(*maps: NDArray[np.float64]) -> Any:
    images = {(f"{k}", "gain"): (own, NOISE) for k, own in enumerate(maps)}
    return SimpleNamespace(setting=SimpleNamespace(seen=SimpleNamespace(images=images)))


def _map(seed: int, *, edge: float = 0.0, field: float = 0.0) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    smooth = gaussian_filter(rng.standard_normal((48, 64)), 8.0, mode="wrap")
    image = NOISE * rng.standard_normal((48, 64)) + field * NOISE * smooth / smooth.std()
    image[0] += edge * NOISE
    image[:, -1] -= edge * NOISE
    return image


@pytest.mark.parametrize("seed", range(4))
def test_lines_at_an_edge_are_no_field(seed: int) -> None:
    denial = of_outermost_lines(_state(*(_map(4 * seed + k, edge=1.2) for k in range(4))), FIELD)
    assert denial is not None
    assert denial.share < 0.5


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("edge", [0.0, 0.3])
def test_a_field_goes_on_inside(seed: int, edge: float) -> None:
    maps = [_map(4 * seed + k, edge=edge, field=0.3) for k in range(4)]
    assert of_outermost_lines(_state(*maps), FIELD) is None
    assert of_outermost_lines(_state(*maps), Prnu(sigma_percent=0.05)) is None


def _handed(image: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    sides = sum(np.roll(image, step, axis) for step in (-1, 1) for axis in (0, 1))
    return np.asarray((1 - 4 * share) * image + share * sides)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("length", [3.0, 5.0])
def test_pixels_inside_show_a_field_beside_lines_at_an_edge(seed: int, length: float) -> None:
    """A short field hardly shows in surfaces, which a darker edge pulls along."""
    rng = np.random.default_rng(40 + seed)
    maps = []
    for k in range(4):
        field = gaussian_filter(rng.standard_normal((48, 64)), length / 2, mode="wrap")
        maps.append(_map(4 * seed + k, edge=1.2) + 0.3 * NOISE * field / field.std())
    assert of_outermost_lines(_state(*maps), FIELD) is None


@pytest.mark.parametrize("seed", range(8))
def test_what_neighbours_hand_on_is_no_field(seed: int) -> None:
    """Of a sensor without colours: of a mosaic they have other colours."""
    handed = _handed(_map(seed), 0.04)
    handed[0] += 1.2 * NOISE
    handed[:, -1] -= 1.2 * NOISE
    assert of_outermost_lines(_state(handed), FIELD) is not None


@pytest.mark.parametrize("shape", [(3, 3), (5, 5), (4, 42)])
def test_tiny_maps_tell_nothing(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    for image in (np.zeros(shape), rng.standard_normal(shape)):
        assert of_outermost_lines(_state(image), Prnu(sigma_percent=0.05)) is None
        assert np.isfinite(_alike(image[1:-1, 1:-1], 1))


def test_nothing_is_denied_where_nothing_is_smooth() -> None:
    assert of_outermost_lines(_state(), FIELD) is None
