"""Few patches or a normal field of gains: by likelihood, where single tails do not tell."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.likepatches import as_patches
from dsis.cfa import Cfa
from dsis.effects import registry
from dsis.grid import PixelGrid
from mismatch_recordings import camera

ROWS, COLUMNS = 92, 172
SITES = {"R": (0, 1), "Gr": (0, 0), "Gb": (1, 1), "B": (1, 0)}
NOISE = {"MONO": 0.7, "R": 0.95, "Gr": 0.6, "Gb": 0.6, "B": 1.0}  # % of a pixel
Array = NDArray[np.float64]


def _state(gain: Array, cfa: Cfa, seed: int) -> Any:
    """Return a state with a map of the gain, %, drawn apart from the effects."""
    rng, sites = np.random.default_rng(seed), {"MONO": (0, 0)} if cfa is Cfa.MONO else SITES
    step, images = 1 + (len(sites) > 1), {}
    for name, (y, x) in sites.items():
        own = gain[y::step, x::step]
        images[name] = (own + rng.normal(0, NOISE[name], own.shape), NOISE[name])
    clues = SimpleNamespace(
        layout=SimpleNamespace(
            sites=sites,
            rows=ROWS,
            columns=COLUMNS,
            cfa=cfa,
            grid=PixelGrid(ROWS, COLUMNS, cfa),
            seen=lambda frame: frame,
        ),
        image=lambda _: images,
        scale=lambda *_: 100.0,
        camera=camera(cfa=cfa.value),
    )
    return SimpleNamespace(clues=lambda: clues)


def _field(seed: int, sigma: float, length: float) -> Array:
    """Return a normal field of exponential covariance, a part of a torus of twice the size, %."""
    y, x = (np.minimum(np.arange(2 * k), 2 * k - np.arange(2 * k)) for k in (ROWS, COLUMNS))
    power = np.maximum(fft.rfft2(np.exp(-np.hypot(y[:, None], x) / length)).real, 0.0)
    white = np.random.default_rng(seed).normal(size=(2 * ROWS, 2 * COLUMNS))
    made = fft.irfft2(fft.rfft2(white) * np.sqrt(power), white.shape)
    return np.asarray(sigma * made[:ROWS, :COLUMNS])


def _dust(seed: int, depth: float) -> Array:
    rng, found = np.random.default_rng(seed), np.zeros((ROWS, COLUMNS))
    y, x = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    for _ in range(9):
        apart = np.hypot(y - rng.integers(ROWS), x - rng.integers(COLUMNS))
        size = rng.uniform(2, 10)
        found -= depth * rng.uniform(0.4, 0.9) / (1 + np.exp((apart - size) / (0.2 * size)))
    return found


def _denied(gain: Array, cfa: Cfa, seed: int, length: float) -> bool:
    effect = registry()["smooth_prnu"](sigma_percent=0.15, length_pixels=length)
    return as_patches(_state(gain, cfa, seed), effect) is not None


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GRBG])
@pytest.mark.parametrize("depth", [0.7, 2.0])
def test_shadows_of_dust_are_no_field_whether_deep_or_faint(cfa: Cfa, depth: float) -> None:
    assert sum(_denied(_dust(seed, depth), cfa, seed, 9.0) for seed in range(10)) >= 9


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GRBG])
@pytest.mark.parametrize("sigma", [0.1, 0.2, 1.0])
@pytest.mark.parametrize("length", [2.0, 5.0, 10.0, 20.0])
def test_a_normal_field_is_believed(cfa: Cfa, sigma: float, length: float) -> None:
    """Also where its length is known to a factor of one and a half only."""
    for seed in range(6):
        gain = _field(seed, sigma, length)
        assert not _denied(gain, cfa, seed, 1.5 ** (seed % 3 - 1) * length)


def test_nothing_and_other_effects_are_not_denied() -> None:
    nothing = np.zeros((ROWS, COLUMNS))
    assert not any(_denied(nothing, Cfa.GRBG, seed, 9.0) for seed in range(6))
    state = _state(_dust(1, 2.0), Cfa.MONO, 1)
    assert as_patches(state, registry()["prnu"](sigma_percent=0.4)) is None
