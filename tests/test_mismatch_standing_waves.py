"""Waves that stand still in the mean frame: found where they are, and nowhere else."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.scalars import Number
from analysis.mismatch.bank.standing import NAME, standing
from analysis.mismatch.bank.waves import Waves, WaveSums
from mismatch_recordings import InMemory, camera, recorded, state_of

Array = NDArray[np.float64]
SURE = 5.0
MONO = {"MONO": (0, 0)}
BAYER = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}


def _moving(shape: tuple[int, int], step: int, frames: Array) -> WaveSums:
    """Return the power of what moves in frames (frame, row, column) of noise 1."""
    sums, waves = WaveSums(shape, step), Waves(shape)
    for _ in waves.watching(frames):
        pass
    sums.weight = float(len(frames) - 1)
    sums.squares = sums.weight
    waves.add_to(sums.power, sums.weight)
    return sums


def _seen(mean: Array, frames: Array, step: int = 1) -> tuple[Number, Peak | None]:
    """Return what is seen in a map and in frames, rows and columns of each plane at 0."""
    planes = {}
    for name, (y, x) in (MONO if step == 1 else BAYER).items():
        own = mean[y::step, x::step]
        planes[name] = own - own.mean(0) - own.mean(1)[:, np.newaxis] + own.mean()
    sites = MONO if step == 1 else BAYER
    return standing(planes, dict.fromkeys(planes, 1.0), sites, _moving(mean.shape, step, frames))


def _wave(shape: tuple[int, int], fx: float, fy: float, z: float, bend: float = 0.0) -> Array:
    """Return a wave whose template is z standard errors in white noise of 1."""
    y, x = np.indices(shape)
    turns = fx * x + fy * y + bend * ((x / shape[1] - 0.5) ** 2 + (y / shape[0] - 0.5) ** 2)
    wave = np.cos(2 * np.pi * turns + 1.0)
    return np.asarray(z * wave / np.sqrt((wave**2).sum()))


def _smooth(rng: np.random.Generator, shape: tuple[int, int], length: float) -> Array:
    """Return a field of variance 1 that neighbours share, by its spectrum."""
    size = [2 * n for n in shape]
    f = np.hypot(np.fft.fftfreq(size[0])[:, np.newaxis], np.fft.fftfreq(size[1]))
    bins = np.fft.fft2(rng.normal(size=size)) * (1 + (2 * np.pi * length * f) ** 2) ** -0.75
    field = np.fft.ifft2(bins).real[: shape[0], : shape[1]]
    return np.asarray((field - field.mean()) / field.std())


@pytest.mark.parametrize("kind", ["white", "patterns", "few pixels"])
@pytest.mark.parametrize(("shape", "step"), [((96, 128), 1), ((97, 131), 1), ((96, 128), 2)])
def test_without_a_wave_the_score_is_as_rare_as_it_says(
    kind: str, shape: tuple[int, int], step: int
) -> None:
    scores = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        mean = rng.normal(size=shape)
        if kind == "patterns":
            mean = 2 * mean + 3 * _smooth(rng, shape, 4.0) + np.linspace(-5, 5, shape[1])
        if kind == "few pixels":
            mean += 300 * rng.exponential(size=shape) * (rng.random(shape) < 0.001)
        (score, error), _ = _seen(mean, rng.normal(size=(5, *shape)), step)
        assert error == 1.0
        scores.append(score)
    for limit in (1.0, 2.0):
        expected = len(scores) * norm.sf(limit)
        assert np.sum(np.array(scores) > limit) < expected + 3 * np.sqrt(expected) + 1
    assert max(scores) < 4.0


@pytest.mark.parametrize("bend", [0.0, 0.3])
@pytest.mark.parametrize(("shape", "step"), [((96, 128), 1), ((97, 131), 1), ((96, 180), 2)])
def test_a_wave_is_found_where_it_is(shape: tuple[int, int], step: int, bend: float) -> None:
    rng = np.random.default_rng(4)
    for fx, fy in ((0.0513, -0.0985), (0.171, 0.093), (0.104, -0.21)):
        frames = rng.normal(size=(6, *shape))
        patterns = rng.normal(size=shape) + 0.5 * _smooth(rng, shape, 20.0)
        (score, _), peak = _seen(patterns + _wave(shape, fx, fy, 17.0, bend), frames, step)
        assert score > SURE
        assert peak is not None
        assert peak.fx / step == pytest.approx(fx, abs=2 / shape[1])
        assert peak.fy / step == pytest.approx(fy, abs=2 / shape[0])


def test_pixels_that_stand_out_hide_no_wave() -> None:
    rng = np.random.default_rng(8)
    mean = rng.normal(size=(96, 128)) + 300 * (rng.random((96, 128)) < 0.003)
    wave = _wave((96, 128), 0.171, 0.093, 17.0)
    assert _seen(mean + wave, rng.normal(size=(6, 96, 128)))[0][0] > SURE


@pytest.mark.parametrize("step", [1, 2])
def test_what_a_wave_of_free_phase_leaves_in_few_frames_is_no_standing_one(step: int) -> None:
    shape, scores = (96, 128), []
    y, x = np.indices(shape)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        phases = rng.uniform(0, 2 * np.pi, (5, 1, 1))
        frames = rng.normal(size=(5, *shape)) + np.cos(
            2 * np.pi * (0.0513 * x - 0.0985 * y) + phases
        )
        scores.append(_seen(frames.mean(0) * np.sqrt(5), frames, step)[0][0])
    assert max(scores) < SURE
    assert np.mean(np.array(scores) > 2.0) < 0.1


def test_frames_that_were_not_transformed_tell_nothing() -> None:
    waves = WaveSums((96, 128), 1, taken=False)
    number, peak = standing({"MONO": np.ones((96, 128))}, {"MONO": 1.0}, MONO, waves)
    assert not np.isfinite(number[0])
    assert peak is None


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("of_light", [True, False])
def test_a_recording_says_where_its_wave_is(cfa: str, *, of_light: bool) -> None:
    """A display's wave goes with the light, a sensor's own is the same in darks."""
    made = recorded(camera(cfa=cfa), 5, levels=(300.0, 900.0, 2000.0))
    wave = _wave((made.rows, made.columns), 0.0713, -0.1185, 1.0)
    stacks = {}
    assert made.stacks is not None
    for exposure in made.exposures:
        stack = made.stacks[exposure.name].astype(np.float64)
        light = (exposure.light or 0.0) / 2000.0 if of_light else 1.0
        rng = np.random.default_rng(len(stacks))
        # Rounded by a coin: codes are 1 DN apart.
        moved = stack + 220.0 * light * wave
        stacks[exposure.name] = np.floor(moved + rng.random(stack.shape)).astype(np.uint16)
    seen = InMemory(made.sensor, made.exposures, made.rows, made.columns, made.folder, stacks)
    state = state_of(seen, camera(cfa=cfa))
    found = {m.statistic: m for m in state.mismatches}
    assert NAME in found
    where = found[NAME].where
    assert where.spatial_frequency == pytest.approx((0.0713, -0.1185), abs=0.015)
    assert where.channel in (None, "MONO")
    assert ("in proportion" in found[NAME].says) == of_light
    assert any(name.startswith("dark") for name in where.exposures) != of_light
