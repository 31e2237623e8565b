"""Light that nobody wrote down: levels in proportion to exposure times tell that it is one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import mismatch_recordings as made
from analysis.mismatch import find_mismatch
from analysis.mismatch.source import Source
from analysis.mismatch.steadylight import with_steady_light

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
LEVELS = (150.0, 300.0, 600.0, 1100.0, 1900.0, 2900.0)


def _recording(
    seed: int,
    response: Callable[[Array], Array] = lambda charge: charge,
    *,
    lamp: float = 0.0,
    levels: tuple[float, ...] = LEVELS,
    times: tuple[float, ...] | None = None,
) -> made.InMemory:
    """Return numpy's recording whose times are its levels, by a lamp that scatters (a share)."""
    rng = np.random.default_rng(seed)
    lit = tuple(float(x) for x in np.array(levels) * (1 + lamp * rng.standard_normal(len(levels))))
    own = made.responding(seed, lit, response, side=48)
    told = dict(zip((f"flat-{i}" for i in range(len(levels))), times or levels, strict=True))
    exposures = tuple(
        replace(e, light=None, exposure_time_s=1e-4 * told[e.name]) if e.name in told else e
        for e in own.exposures
    )
    return replace(own, exposures=exposures)


def _lights(recording: made.InMemory) -> list[float | None]:
    return [e.light for e in with_steady_light(recording, Source(recording)).of_kind("flat")]


def _bent(charge: Array) -> Array:
    return charge - 40 * charge / 3480 * (1 - charge / 3480)


def _full(charge: Array) -> Array:
    return np.minimum(charge, 1500.0)


@pytest.mark.parametrize("response", [lambda charge: charge, _bent, _full])
def test_times_are_the_light_of_a_lamp_that_is_left_alone(
    response: Callable[[Array], Array],
) -> None:
    for seed in range(4):
        recording = _recording(seed, response)
        assert _lights(recording) == [e.exposure_time_s for e in recording.of_kind("flat")]


@pytest.mark.parametrize(
    "recording",
    [
        _recording(1, lamp=0.01),
        _recording(2, times=(500.0,) * len(LEVELS)),
        _recording(3, times=(150.0, 300.0, 600.0, 550.0, 950.0, 1450.0)),  # another lamp
        _recording(4, levels=LEVELS[:3]),
        made.recorded(made.camera(), 5, rows=32, columns=32, lit=False),
    ],
    ids=["a lamp that wanders", "one time", "two lamps", "few levels", "any times"],
)
def test_light_that_levels_do_not_tell_stays_unknown(recording: made.InMemory) -> None:
    assert set(_lights(recording)) == {None}


def test_light_that_is_given_stays() -> None:
    recording = made.recorded(made.camera(), 6, rows=32, columns=32)
    assert with_steady_light(recording, Source(recording)) is recording


@pytest.mark.long
def test_a_bend_is_named_by_the_times() -> None:
    found = find_mismatch(
        made.camera(), _recording(7, _bent), seed=1, vocabulary=frozenset({"nonlinearity"})
    )
    assert [one.effect for one in found.omitted_physics] == ["nonlinearity"]
    assert any("it is taken to be the same in all" in one for one in found.remarks)
