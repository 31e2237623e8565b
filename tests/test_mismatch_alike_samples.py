"""Noise of whole lines, and samples that are alike along them: frames made here, by numpy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.alikesamples import of_alike_samples
from analysis.mismatch.displaced import displaced
from analysis.mismatch.state import State
from mismatch_recordings import FEW_LEVELS, camera, recorded, state_of

Array = NDArray[np.float64]
KINDS = {"row_noise": 2, "column_noise": 1}  # and the axis along which the samples of a line lie
SIGNALS = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": s for i, s in enumerate(FEW_LEVELS)}
SLOPE, READ, BLACK = 0.5, 20.0, 64.0


def _noise(signal: float, shape: tuple[int, ...], seed: int, axis: int, alike: float) -> Array:
    """Return noise that takes a share of each of the two samples before along an axis."""
    rng = np.random.default_rng([seed, round(signal)])
    noise = rng.normal(0, (SLOPE * signal + READ) ** 0.5, shape)
    made = noise + alike * (np.roll(noise, 1, axis) + np.roll(noise, 2, axis))
    return np.asarray(made / (1 + 2 * alike**2) ** 0.5)


@cache
def _state(cfa: str, line: int, along: int, alike: float, lines_dn: float) -> State:
    """Return a state of samples alike along an axis, and offsets of lines that lie along one."""
    true = camera(cfa=cfa)
    recording = recorded(true, 5, levels=FEW_LEVELS)
    assert recording.stacks is not None
    for i, (name, frames) in enumerate(recording.stacks.items()):
        made = _noise(SIGNALS[name], frames.shape, i, along, alike)
        lines = [1 if k == line else n for k, n in enumerate(frames.shape)]
        made += np.random.default_rng([9, i]).normal(0, lines_dn, lines)
        codes = np.rint(BLACK + SIGNALS[name] + made)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return state_of(recording, true)


def _explained(state: State, kind: str) -> Array:
    """Return the numbers with offsets of lines, alike at all signals, that explain most."""
    own = f"{kind.removesuffix('_noise')}_variance"
    lines = np.array([key.statistic == own for key in state.vector.keys]) & state.null.known
    shape = np.array([1 / (SLOPE * SIGNALS.get(k.exposure, 0) + READ) for k in state.vector.keys])
    excess = np.where(lines, state.vector.values**3 - state.null.mean**3, 0.0)
    factor = float(excess @ shape) / float((lines * shape) @ shape)
    cubes = state.null.mean**3 + factor * lines * shape
    return np.where(lines, np.cbrt(cubes), state.null.mean)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("kind", KINDS)
def test_samples_that_are_alike_are_no_noise_of_lines(kind: str, cfa: str) -> None:
    state = _state(cfa, KINDS[kind], KINDS[kind], 0.15, 0.0)
    mean = _explained(state, kind)
    found = of_alike_samples(state, kind, mean, state.null.mean)
    assert displaced(state, kind, mean) == found  # which the search and the judge ask
    assert found is not None
    assert found.share < 0.35


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("kind", KINDS)
def test_noise_of_lines_stays_beside_samples_alike_the_other_way(kind: str, cfa: str) -> None:
    state = _state(cfa, KINDS[kind], 3 - KINDS[kind], 0.15, 0.7)
    mean = _explained(state, kind)
    assert of_alike_samples(state, kind, mean, state.null.mean) is None


@pytest.mark.parametrize("kind", KINDS)
def test_noise_of_lines_stays_beside_samples_that_explain_little_of_it(kind: str) -> None:
    state = _state("MONO", KINDS[kind], KINDS[kind], 0.05, 1.4)
    mean = _explained(state, kind)
    assert of_alike_samples(state, kind, mean, state.null.mean) is None
    others = replace(state, mismatches=())  # samples that are alike are explained
    assert of_alike_samples(others, kind, mean, state.null.mean) is None


@pytest.mark.parametrize("kind", ["row_fpn", "row_banding", "crosstalk"])
def test_other_effects_are_not_asked(kind: str) -> None:
    state = _state("MONO", 2, 2, 0.15, 0.0)
    assert of_alike_samples(state, kind, state.vector.values, state.null.mean) is None


def test_blocks_of_read_out_are_no_noise_of_columns() -> None:
    """Offsets of blocks, new in each frame, are a smaller share of the noise of bright flats."""
    true, side = camera(), 8
    recording = recorded(true, 6, rows=96, columns=128, levels=FEW_LEVELS)
    assert recording.stacks is not None
    for i, (name, frames) in enumerate(recording.stacks.items()):
        rng = np.random.default_rng([11, i])
        sd = (SLOPE * SIGNALS[name] + READ) ** 0.5
        blocks = rng.normal(0, 0.8, (len(frames), 96 // side, 128 // side))
        made = rng.normal(0, sd, frames.shape) + blocks.repeat(side, 1).repeat(side, 2)
        codes = np.rint(BLACK + SIGNALS[name] + made)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    state = state_of(recording, true)
    for kind in KINDS:
        mean = _explained(state, kind)
        found = of_alike_samples(state, kind, mean, state.null.mean)
        assert found is not None
        assert found.share < 0.5
