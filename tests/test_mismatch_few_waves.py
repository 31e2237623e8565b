"""A grid before the sensor, or a display, is no field of gains."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.fewwaves import of_few_waves
from dsis.effects import registry

ROWS, COLUMNS = 120, 160
NOISE = 2.0  # DN, at 1000 DN: 0.2 %
Array = NDArray[np.float64]


def _field(length: float) -> Any:
    return registry()["smooth_prnu"](sigma_percent=0.1, length_pixels=length)


def _state(gain: Array, seed: int, *left: str) -> Any:
    """Return a state with a map of the gain, DN at 1000, and what is unexplained."""
    image = 1000 * gain + np.random.default_rng(seed).normal(0, NOISE, gain.shape)
    images = {("MONO", "gain"): (image - image.mean(), NOISE)}
    clues = SimpleNamespace(
        layout=SimpleNamespace(sites={"MONO": (0, 0)}, rows=ROWS, columns=COLUMNS),
        image=lambda name: {c: one for (c, kind), one in images.items() if kind == name},
        scale=lambda *_: 1000.0,
    )
    mismatches = [SimpleNamespace(statistic=name) for name in left]
    return SimpleNamespace(clues=lambda: clues, mismatches=mismatches)


def _wave(seed: int, bend: float) -> Array:
    rng = np.random.default_rng(seed)
    fx, fy = rng.uniform(0.06, 0.15, 2)
    y, x = np.arange(ROWS)[:, None], np.arange(COLUMNS)
    bent = bend * (x / COLUMNS - 0.5) ** 2
    return np.asarray(0.0015 * np.cos(2 * np.pi * (fx * x + fy * y) + bent + rng.uniform(0, 6)))


def _drawn(seed: int, length: float) -> Array:
    """Return a field whose neighbours have exp(-r / length) in common, by a sum of waves."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=(ROWS, COLUMNS))
    fy, fx = np.fft.fftfreq(ROWS)[:, None], np.fft.fftfreq(COLUMNS)
    power = (1 + (2 * np.pi * length) ** 2 * (fx**2 + fy**2)) ** -1.5  # of exp(-r / length)
    field = np.fft.ifft2(np.fft.fft2(white) * np.sqrt(power)).real
    return np.asarray(0.001 * field / field.std())


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("bend", [0.0, 6.0])
def test_a_wave_that_stands_still_is_no_field(seed: int, bend: float) -> None:
    state = _state(_wave(seed, bend), seed, "fixed_spectral_peak")
    said = of_few_waves(state, _field(2.0))
    assert said is not None
    assert said.share < 0.5
    assert "wave" in said.why


@pytest.mark.parametrize("length", [1.5, 4.0, 10.0])
def test_a_field_is_believed_beside_a_weaker_wave(length: float) -> None:
    for seed in range(6):
        gain = _drawn(seed, length) + 0.3 * _wave(seed, 0.0)
        assert of_few_waves(_state(gain, seed, "fixed_spectral_peak"), _field(length)) is None


def test_nothing_is_asked_where_no_wave_is_left() -> None:
    assert of_few_waves(_state(_wave(1, 0.0), 1), _field(2.0)) is None
    other = registry()["prnu"](sigma_percent=0.1)
    assert of_few_waves(_state(_wave(1, 0.0), 1, "fixed_spectral_peak"), other) is None
