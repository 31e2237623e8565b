"""Few electrons, and darks that the lowest code cuts off: read noise is known by what is left."""

from math import isfinite

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.observe import observe
from analysis.mismatch.recalibrate import Calibrated, calibrate
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from dsis.camera import Camera
from mismatch_recordings import InMemory, camera, recorded

GAIN = 5.0  # DN per electron
LEVELS = (6.0, 20.0, 80.0, 300.0)


def _model(intercept: float, black: float) -> Camera:
    bare = camera(segments=((GAIN, intercept, None),), black=black)
    noise = bare.noise.model_copy(update={"shot": "poisson"})
    return bare.model_copy(update={"noise": noise})


def _recorded(read_dn: float, black: float, seed: int) -> InMemory:
    """Return numpy's own recording: Poisson electrons, normal read noise, rounded and clipped."""
    recording = recorded(_model(read_dn**2, black), seed, levels=LEVELS)
    assert recording.stacks is not None
    signals = {"dark-0": 0.0, "dark-1": 0.0} | {f"flat-{i}": own for i, own in enumerate(LEVELS)}
    rng = np.random.default_rng(seed)
    for name, frames in recording.stacks.items():
        light = GAIN * rng.poisson(signals[name] / GAIN, frames.shape)
        codes = np.rint(black + light + rng.normal(0, read_dn, frames.shape))
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return recording


def _fitted(recording: InMemory, model: Camera) -> Calibrated:
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    return calibrate(model, layout, seen, None, seed=1, jobs=1)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("given", [1.0, 1.44, 2.5])
def test_a_dark_of_which_some_is_cut_off_tells_the_read_noise(given: float, seed: int) -> None:
    """Black at 2 with 1.2 of noise: one sample in twenty is below, whatever the file says."""
    (piece,) = _fitted(_recorded(1.2, 2.0, seed), _model(given, 2.0)).fit.pieces
    assert piece.intercept_error < 0.03
    assert abs(piece.intercept - 1.44) < 4 * piece.intercept_error
    assert abs(piece.slope - GAIN) < 4 * piece.slope_error < 0.2


@pytest.mark.parametrize("scatter", [1.0, 2.0])
def test_offsets_that_scatter_beside_a_cut_are_no_read_noise(scatter: float) -> None:
    """What is cut off of each pixel is another's: the given number is kept, not a wrong one."""
    recording = _recorded(4.0, 6.0, 2)
    assert recording.stacks is not None
    rng = np.random.default_rng(3)
    offsets = rng.normal(0, scatter, (recording.rows, recording.columns))
    for name in ("dark-0", "dark-1"):
        frames = 6 + offsets + rng.normal(0, 4.0, recording.stacks[name].shape)
        recording.stacks[name] = np.clip(np.rint(frames), 0, 4095).astype(np.uint16)
    found = _fitted(recording, _model(16.0, 6.0))
    assert not found.cut
    (piece,) = found.fit.pieces
    assert found.held == 16.0 or abs(piece.intercept - 16.0) < 4 * piece.intercept_error


@pytest.mark.parametrize("seed", range(3))
def test_where_most_is_cut_off_the_given_read_noise_is_kept(seed: int) -> None:
    """Bright flats know it to more than itself: it is held in every simulation, too."""
    found = _fitted(_recorded(1.2, 0.0, seed), _model(1.44, 0.0))
    (piece,) = found.fit.pieces
    assert found.held == piece.intercept == 1.44
    assert not isfinite(piece.intercept_error)
    assert found.model.camera.noise.segment[0].intercept_se is None
    assert abs(piece.slope - GAIN) < 4 * piece.slope_error < 0.2


def test_a_given_read_noise_that_flats_rule_out_is_fitted() -> None:
    found = _fitted(_recorded(30.0, 4.0, 1), _model(1.44, 4.0))
    assert found.held is None
    assert found.fit.pieces[0].intercept > 100


def test_few_electrons_beside_a_low_black_are_no_uneven_codes() -> None:
    found = find_mismatch(_model(1.44, 2.0), _recorded(1.2, 2.0, 4), seed=1)
    assert not found.omitted_physics
    assert not found.unexplained
