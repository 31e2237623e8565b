"""Levels that bend, or step where another path takes over: one sum shows what single ones hide."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.mismatch.bank.home import BENT, STEPPED
from analysis.mismatch.displaced import displaced
from analysis.mismatch.observe import observe
from analysis.mismatch.source import Source
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from mismatch_recordings import COLUMNS, FRAMES, LEVELS, ROWS, Array, InMemory, camera, recorded

SLOPE, INTERCEPT = 0.5, 20.0
PIXELS = ROWS * COLUMNS
TOP = 4095.0 - 64.0


def state_of(recording: InMemory) -> State:
    source = Source(recording)
    numbers = {e.name: tuple(range(FRAMES)) for e in recording.exposures}
    layout = layout_of(recording, numbers, source.frames)
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    setting = Setting(layout, seen, None, 1, 1, 16, 8, 2, 2, 2)
    return State.of(setting, camera(), lambda: None)


def departure(state: State, detail: str) -> float:
    """Return z of the first sum of levels whose detail begins so."""
    return next(
        float(z)
        for key, z in zip(state.null.keys, state.departures, strict=True)
        if key.statistic == "level" and key.detail.startswith(detail)
    )


def best(shape: Array) -> float:
    """Return the z that weighted least squares gives a change of the flats' levels, DN.

    Sensitivity and ground are fitted beside it; variances are those of means of white noise.
    """
    s = np.array(LEVELS)
    sd = np.sqrt((SLOPE * s + INTERCEPT + 1 / 12) / (PIXELS * FRAMES))
    sd = np.hypot(sd, 3e-5 * s)  # light is stated no better
    free = np.stack([s, np.ones_like(s)], 1) / sd[:, None]
    own = shape / sd
    return float(np.linalg.norm(own - free @ np.linalg.lstsq(free, own, rcond=None)[0]))


def changed(seed: int, change: Array) -> State:
    """Return the state of a recording whose flats' means are changed, dithered: DN, (flat,)."""
    recording = recorded(camera(), seed)
    rng = np.random.default_rng(seed)
    assert recording.stacks is not None
    for i, add in enumerate(change):
        own = recording.stacks[f"flat-{i}"]
        recording.stacks[f"flat-{i}"] = np.floor(own + add + rng.random(own.shape)).astype(
            np.uint16
        )
    return state_of(recording)


@pytest.mark.parametrize("percent", [0.08, -0.08])
def test_a_step_of_the_gain_between_two_levels_is_seen_nearly_as_well_as_can_be(
    percent: float,
) -> None:
    s = np.array(LEVELS)
    step = np.where(s > 600, percent / 100 * s, 0.0)
    state = changed(1, step)
    seen = departure(state, f"{STEPPED} {np.sqrt(500 * 900):.3g}"[:-1])
    assert np.sign(seen) == np.sign(percent)
    assert abs(seen) > 0.6 * best(step) - 2
    assert "level" in {m.statistic for m in state.mismatches}


def test_a_bent_response_is_seen_nearly_as_well_as_can_be() -> None:
    s = np.array(LEVELS)
    bend = -4e-7 * s * (TOP - s)
    seen = departure(changed(2, bend), BENT)
    assert seen > 0.6 * best(bend) - 2


def test_sensitivity_and_ground_are_no_bend() -> None:
    """Light that is brighter than stated, and a ground that is higher, are fitted."""
    state = changed(3, 1.0 + 2e-3 * np.array(LEVELS))
    sums = [
        float(z)
        for key, z in zip(state.null.keys, state.departures, strict=True)
        if key.statistic == "level" and key.detail.startswith((STEPPED, BENT))
    ]
    assert len(sums) >= 3
    assert np.abs(sums).max() < 4


def test_chance_bends_no_level_more_often_than_it_should() -> None:
    seen = []
    for seed in range(10, 18):
        state = state_of(recorded(camera(), seed, rows=48, columns=64))
        seen += [
            float(z)
            for key, z in zip(state.null.keys, state.departures, strict=True)
            if key.statistic == "level" and key.detail.startswith((STEPPED, BENT))
        ]
    assert len(seen) >= 24
    assert 0.4 < np.std(seen) < 1.4
    assert np.abs(seen).max() < 4


def _toned(seed: int, most: float, *, straight: bool) -> InMemory:
    """Return numpy's own recording of a gain that falls by a share with what is around a pixel.

    `straight`: of noise alone, as a second read-out path scales it.
    """
    rng, recording = np.random.default_rng(seed), recorded(camera(), seed)
    stacks, levels = {}, dict(zip((f"flat-{i}" for i in range(len(LEVELS))), LEVELS, strict=True))
    for name, frames in (recording.stacks or {}).items():
        level = levels.get(name, 0.0)
        gain = 1 - most * level / TOP
        noise = np.sqrt(SLOPE * level) * gain * rng.standard_normal(frames.shape)
        noise += np.sqrt(INTERCEPT) * rng.standard_normal(frames.shape)
        codes = 64 + level * (1 if straight else gain) + noise
        stacks[name] = np.rint(codes).clip(0, 4095).astype(np.uint16)
    return replace(recording, stacks=stacks)


def test_noise_that_bends_as_levels_do_is_no_second_path() -> None:
    """Levels of a path lie on a line, and its noise alone does not."""
    toned = state_of(_toned(0, 0.15, straight=False))
    denial = displaced(toned, "dual_gain", toned.null.mean)
    assert denial is not None
    assert "levels bend" in denial.why
    straight = state_of(_toned(0, 0.15, straight=True))
    assert displaced(straight, "dual_gain", straight.null.mean) is None
