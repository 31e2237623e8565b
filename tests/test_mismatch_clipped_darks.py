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
from dsis.effects import Effect
from dsis.effects.dsnu import Dsnu
from dsis.effects.prnu import Prnu
from dsis.recording import Recording
from mismatch_recordings import InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

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


OFFSETS, SPREAD, NOISE, SLOPE = 2.0, 0.02, 3.0, 0.5


def _with_offsets(black: float, seed: int) -> InMemory:
    """Return numpy's own recording of pixels of their own offsets and gains, cut off at code 0."""
    recording = recorded(camera(), seed, rows=64, columns=64, levels=LEVELS[1:])
    assert recording.stacks is not None
    rng = np.random.default_rng(seed)
    offset, gain = rng.normal(0, OFFSETS, (64, 64)), rng.normal(1, SPREAD, (64, 64))
    for name, frames in recording.stacks.items():
        level = 0.0 if name.startswith("dark") else LEVELS[1 + int(name[-1])]
        noise = rng.normal(0, 1, frames.shape) * np.sqrt(NOISE**2 + SLOPE * level * gain)
        codes = np.rint(black + offset + level * gain + noise)
        recording.stacks[name] = np.clip(codes, 0, 4095).astype(np.uint16)
    return recording


def _user(black: float, *effects: Effect) -> Camera:
    return camera(*effects, segments=((SLOPE, NOISE**2, None),), black=black)


@pytest.mark.parametrize(("black", "seed"), [(0.0, 11), (3.0, 12)])
def test_offsets_that_the_user_states_are_cut_off_pixel_by_pixel(black: float, seed: int) -> None:
    """Half of what is dark lies below code 0, of each pixel another part: no physics of its own."""
    own = Dsnu(sigma_dn=OFFSETS), Prnu(sigma_percent=100 * SPREAD)
    found = find_mismatch(_user(black, *own), _with_offsets(black, seed), seed=1)
    assert found.verdict == "match"
    black_dn = found.camera.black_level
    assert black_dn == pytest.approx(black, abs=0.15)  # where darks lie 2 DN above it


@pytest.mark.long
def test_offsets_beside_a_cut_are_named_with_their_size() -> None:
    user = _user(0.0, Prnu(sigma_percent=100 * SPREAD))
    (one,) = find_mismatch(user, _with_offsets(0.0, 13), seed=1).omitted_physics
    assert one.effect == "dsnu"
    told = one.parameters["sigma_dn"]
    assert abs(told.value - OFFSETS) < 4 * told.standard_error < 1.0


class _Darks(InMemory):
    """The darks of a recording alone."""

    @classmethod
    def of(cls, own: InMemory) -> Recording:
        darks = tuple(e for e in own.exposures if e.kind == "dark")
        return cls(own.sensor, darks, own.rows, own.columns, own.folder, own.stacks)


@pytest.mark.long
def test_darks_of_which_half_is_cut_off_prove_nothing() -> None:
    """Nothing is left to be proven on; what differs is located."""
    recording = _with_offsets(0.0, 14)
    assert recording.stacks is not None
    rng = np.random.default_rng(14)
    hot = rng.random((64, 64)) < 0.01
    recording.stacks["dark-1"] += (60 * hot).astype(np.uint16)
    words = frozenset({"hot_pixels", "dsnu", "dark_current", "rts"})
    found = find_mismatch(_user(0.0), _Darks.of(recording), seed=1, vocabulary=words)
    assert not found.omitted_physics
    assert "outlying_pixels" in {own.statistic for own in found.unexplained}
    assert all("nan" not in own for own in found.remarks)
