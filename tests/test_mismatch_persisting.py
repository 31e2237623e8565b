"""Tails, and pixels that are noisier in every exposure: frames made here, by numpy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.feigned import of_another
from analysis.mismatch.persisting import persisting
from analysis.mismatch.state import State
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded, state_of

Array = NDArray[np.float64]
KIND = "heavy_tailed_read_noise"
SIGNALS = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": s for i, s in enumerate(FEW_LEVELS)}
SLOPE, READ, BLACK = 0.5, 20.0, 64.0
TAIL = 16.0  # degrees of freedom: an excess kurtosis of a half


@cache
def _state(spread: float, df: float | None, cfa: str = "MONO") -> State:
    """Return a state with tails, beside read noise of pixels that differ, or with tails."""
    bare = camera(cfa=cfa)
    recording = recorded(bare, 5, levels=FEW_LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(8)
    for name, frames in recording.stacks.items():
        own = np.exp(spread * np.random.default_rng(1).normal(size=frames.shape[1:]))
        if df is None:
            read = rng.normal(size=frames.shape)
        else:
            read = rng.standard_t(df, frames.shape) * (1 - 2 / df) ** 0.5
        read *= READ**0.5 * own / (own**2).mean() ** 0.5
        light = rng.normal(0, (SLOPE * SIGNALS[name]) ** 0.5, frames.shape)
        codes = np.rint(BLACK + SIGNALS[name] + light + read)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return state_of(recording, camera(registry()[KIND](tail_df=TAIL), cfa=cfa))


def _without(state: State) -> Array:
    return state.predictor(8).mean(state.camera.model_copy(update={"effect": ()}))


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_pixels_that_are_noisier_everywhere_are_no_tails(cfa: str) -> None:
    """A kurtosis of a half, all of it of pixels whose variances have a spread of a sixth."""
    state = _state(np.log1p(1 / 6) ** 0.5 / 2, None, cfa)
    (effect,), without = state.camera.effect, _without(state)
    denial = persisting(state, KIND, without)
    assert denial is not None
    assert denial.share < 0.35
    assert of_another(state, effect, without) is not None  # which the judge asks


@pytest.mark.parametrize("spread", [0.0, 0.08])
@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
def test_tails_stay(cfa: str, spread: float) -> None:
    """Alone, and beside pixels whose spread feigns less than half of them."""
    state = _state(spread, TAIL, cfa)
    assert persisting(state, KIND, _without(state)) is None


def test_a_spread_that_is_explained_feigns_nothing() -> None:
    state = _state(np.log1p(1 / 6) ** 0.5 / 2, None)
    without = _without(state)
    assert persisting(state, "rts", without) is None
    others = tuple(m for m in state.mismatches if m.statistic != "variance_persistence")
    assert len(others) < len(state.mismatches)
    assert persisting(replace(state, mismatches=others), KIND, without) is None


def test_the_same_noisy_pixels_in_every_exposure_are_no_spikes() -> None:
    """Pixels that count frames, say: far out anew each time, but always they."""
    state = _state(np.log1p(1 / 6) ** 0.5 / 2, None)
    (own,) = (m for m in state.mismatches if m.statistic == "variance_persistence")
    assert own.z > 8.0
    assert persisting(state, "impulse", _without(state)) is not None
    weak = [replace(m, z=5.0) if m is own else m for m in state.mismatches]
    assert persisting(replace(state, mismatches=tuple(weak)), "impulse", _without(state)) is None
