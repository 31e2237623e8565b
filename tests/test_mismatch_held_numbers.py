"""Numbers of locked frames: an effect gains by them where it is there, and only there."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import heldnumbers
from analysis.mismatch.heldnumbers import HeldNumbers
from analysis.mismatch.observe import observe
from analysis.mismatch.prove.likelihood import Loglik
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from analysis.mismatch.trial import Trial
from analysis.mismatch.vector import vector
from dsis.camera import Camera
from dsis.effects.row_noise import RowNoise
from mismatch_recordings import camera, recorded

LEVELS = (100.0, 500.0, 1600.0)
# DN; of the 4.5 DN of a pixel the mean of a row of 128 has 0.4.
EFFECT = RowNoise(sigma_dn=0.3)


def held(
    true: Camera, model: Camera, seed: int, scene: NDArray[np.float32] | None = None
) -> tuple[HeldNumbers, State]:
    """Return the locked frames' numbers of a recording, and the state of the others."""
    recording = recorded(true, seed, rows=64, columns=128, levels=LEVELS, scene=scene)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    setting = Setting(layout, seen, None, 0, 1, 16, 16, 2, 2, 4)
    state = State.of(setting, model, lambda: None)
    return HeldNumbers(recording, split, source, setting), state


@pytest.mark.parametrize("there", [True, False])
def test_an_effect_gains_where_it_is(there: bool) -> None:
    with_it, without = camera(EFFECT), camera()
    numbers, final = held(with_it if there else without, with_it, 7)
    told = numbers.gain(final, final.camera.model_copy(update={"effect": ()}))
    assert told is not None
    assert told.certain == there
    assert (told.nats > 0) == there


def test_a_scene_that_more_frames_tell_apart_more_finely_is_no_hindrance() -> None:
    """Of a picture of little contrast, all frames show more ranges of signal than some of them."""
    cells = np.random.default_rng(1).uniform(-1, 1, (8, 16)).astype(np.float32)
    shape = np.repeat(np.repeat(cells, 8, 0), 8, 1)
    for contrast in range(16, 60, 2):
        scene = 500 + contrast * shape
        recording = recorded(camera(EFFECT), 7, rows=64, columns=128, levels=LEVELS, scene=scene)
        split, source = Split.of(recording), Source(recording)
        fine, coarse = (
            len(layout_of(recording, which, source.frames).scenes["scene"].channels["MONO"].bins)
            for which in (split.all_of_development, split.development)
        )
        if fine > coarse:
            break
    assert fine > coarse
    numbers, final = held(camera(EFFECT), camera(EFFECT), 7, scene)
    told = numbers.gain(final, camera())
    assert told is not None
    assert told.certain


def test_frames_that_are_kept_show_what_they_show_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulated frames that are not locked: picked from among all, or made again alone."""
    numbers, state = held(camera(), camera(), 8)
    whole, rest = numbers.whole[0], numbers.setting.layout
    calibrated = state.calibrated

    def values() -> list[float]:
        frames = (calibrated.model.frames(layout, 0, 3) for layout in (whole, rest))
        seen = heldnumbers._observed(whole, rest, *frames)[1]
        return vector(rest, seen, calibrated.refit(rest, seen.levels)).values.tolist()

    kept = values()
    monkeypatch.setattr(heldnumbers, "_MOST_KEPT", 0)
    assert kept == pytest.approx(values(), rel=1e-12, nan_ok=True)


@pytest.mark.parametrize("jobs", [2, 4])
def test_log_likelihoods_are_the_same_however_cameras_are_shared_out(jobs: int) -> None:
    numbers, state = held(camera(EFFECT), camera(), 9)
    effects = [RowNoise(sigma_dn=size) for size in (0.2, 0.3, 0.5)]
    some = [state.camera.model_copy(update={"effect": (own,)}) for own in effects]
    signals = state.calibrated.model.signals

    def logliks(jobs: int) -> list[Loglik]:
        setting = replace(numbers.setting, jobs=jobs)
        trial = Trial.of(numbers.recording, numbers.split, numbers.source, setting)
        assert trial.held is not None
        return trial._logliks(trial.held, [*some, some[0]], signals)

    plain, shared = logliks(1), logliks(jobs)
    assert [one.levels for one in shared] == [one.levels for one in plain]
    for one, other in zip(shared, plain, strict=True):
        for name, frames in other.frames.items():
            np.testing.assert_array_equal(one.frames[name], frames, strict=True)
    assert plain[0].levels != plain[1].levels
