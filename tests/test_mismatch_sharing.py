"""By which law neighbours are alike: noise made here, by each law, foreign to effects."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import convolve

from analysis.mismatch.displaced import displaced
from analysis.mismatch.sharing import Law, evidences, shared_otherwise
from analysis.mismatch.state import State
from analysis.mismatch.straight import bent
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

Array = NDArray[np.float64]
LEVELS = (60.0, 250.0, 700.0, 1600.0, 2800.0)
SLOPE, READ, BLACK, BRIGHTEST = 0.5, 20.0, 64.0, 2800.0
CORRELATION = 0.05  # of neighbours, about, where it is largest
KINDS = {"spatial_filtering": Law.ALL, "crosstalk": Law.LIGHT}


def _smoothed(white: Array, share: float) -> Array:
    """Return frames whose pixels took a share of each of four neighbours."""
    kernel = share * np.array([[0.0, 1, 0], [1, 0, 1], [0, 1, 0]])
    kernel[1, 1] = 1 - 4 * share
    return convolve(white, kernel[np.newaxis], mode="wrap")


def _frames(law: Law | None, signal: float, shape: tuple[int, ...], seed: int) -> Array:
    """Return frames whose neighbours are alike by a law; None: they are not."""
    rng = np.random.default_rng([seed, round(signal)])
    light = rng.normal(0, (SLOPE * signal) ** 0.5, shape)
    read = rng.normal(0, READ**0.5, shape)
    share = CORRELATION / 2
    match law:
        case Law.ALL:
            noise = _smoothed(light + read, share)
        case Law.LIGHT:
            noise = _smoothed(light, share) + read
        case Law.CHARGE:
            noise = _smoothed(light, 2 * share * signal / BRIGHTEST) + read
        case _:
            noise = light + read
    return np.rint(BLACK + signal + noise)


@cache
def _state(law: Law | None, seed: int = 3) -> State:
    recording = recorded(camera(), seed, levels=LEVELS)
    assert recording.stacks is not None
    for name, frames in recording.stacks.items():
        signal = 0.0 if name.startswith("dark") else LEVELS[int(name.removeprefix("flat-"))]
        seen = _frames(law, signal, frames.shape, seed + (name == "dark-1"))
        recording.stacks[name] = np.clip(seen, 0, 4095).astype(np.uint16)
    return state_of(recording, camera())


@pytest.mark.parametrize("law", list(Law))
def test_the_law_by_which_noise_was_made_is_the_likeliest(law: Law) -> None:
    state = _state(law)
    found = evidences(state, state.null.mean)
    others = [gain for own, gain in found.items() if own is not law]
    assert found[law] > max(others) + 10


def test_gains_are_those_of_least_squares() -> None:
    """Half of chi-squared that a line through the origin takes away, by numpy's solver."""
    state = _state(Law.LIGHT)
    clues, gain = state.clues(), 0.0
    for statistic in ("correlation_0_1", "correlation_1_0", "correlation_0_2", "correlation_2_0"):
        own = {place: one for place, one in clues.excess(statistic).items() if place[1] == "MONO"}
        sd = np.array([sd for _, sd in own.values()])
        values = np.array([value for value, _ in own.values()]) / sd
        shape = np.array([clues.shot_share(place) for place in own]) / sd
        _, left, *_ = np.linalg.lstsq(shape[:, np.newaxis], values, rcond=None)
        gain += float(values @ values - left[0]) / 2
    assert evidences(state, state.null.mean)[Law.LIGHT] == pytest.approx(gain, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("law", list(Law))
def test_another_law_denies_a_filter_and_crosstalk(kind: str, law: Law) -> None:
    state = _state(law)
    denial = shared_otherwise(state, kind, state.null.mean)
    assert (denial is None) == (KINDS[kind] is law)
    asked = displaced(state, kind, state.null.mean)  # which the search and the judge ask
    assert asked == denial
    if denial is not None:
        assert denial.share < 1e-4
        assert law.value in denial.why


def test_bends_of_the_model_itself_say_nothing_of_charge() -> None:
    """A second read-out segment that the camera has: no line, and crosstalk is crosstalk."""
    two = ((0.5, 20.0, 1000.0), (0.8, 40.0, None))
    crosstalk = registry()["crosstalk"](fraction=CORRELATION / 2)
    model, true = camera(segments=two), camera(crosstalk, segments=two)
    state = state_of(recorded(true, 4, levels=LEVELS), model)
    assert bent(state)
    assert not bent(_state(Law.LIGHT))
    (other, *_) = _state(Law.LIGHT).mismatches
    off = replace(state, mismatches=(replace(other, statistic="pixel_variance"),))
    assert shared_otherwise(off, "crosstalk", off.null.mean) is None


def test_what_charge_takes_from_variances_counts() -> None:
    state = _state(Law.CHARGE)
    (other, *_) = state.mismatches
    off = replace(state, mismatches=(replace(other, statistic="pixel_variance"),))
    none = replace(state, mismatches=(replace(other, statistic="level"),))
    asked = [shared_otherwise(one, "crosstalk", one.null.mean) for one in (off, none)]
    assert all(asked)
    first, second = (one.share for one in asked if one is not None)
    assert first < second


@pytest.mark.parametrize("kind", ["brighter_fatter", "readout_memory", "prnu"])
def test_what_follows_no_law_of_its_own_is_not_asked(kind: str) -> None:
    state = _state(Law.ALL)
    assert shared_otherwise(state, kind, state.null.mean) is None


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_where_neighbours_are_not_alike_no_law_is_told(kind: str, seed: int) -> None:
    state = _state(None, seed)
    assert shared_otherwise(state, kind, state.null.mean) is None


def test_what_the_model_without_has_already_is_not_asked_again() -> None:
    """Beside crosstalk that the camera has, a filter is told by what is left."""
    crosstalk = registry()["crosstalk"](fraction=CORRELATION / 2)
    recording = recorded(camera(crosstalk), 4, levels=LEVELS)
    state = state_of(recording, camera(crosstalk))
    assert shared_otherwise(state, "spatial_filtering", state.null.mean) is None
    bare = state.camera.model_copy(update={"effect": ()})
    without = state.predictor(8).mean(bare)
    assert shared_otherwise(state, "spatial_filtering", without) is not None
    assert shared_otherwise(state, "crosstalk", without) is None
