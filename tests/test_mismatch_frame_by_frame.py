"""Effects that move whole frames: what each frame gains, told by all the others."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from analysis.mismatch import confirmed
from analysis.mismatch.finding import Gain
from analysis.mismatch.framebyframe import Held, frame_by_frame
from analysis.mismatch.trial import Gained, Trial
from exposing import effect

NEW_DN2 = 0.04  # of a frame's mean without the effect
LEVELS = {"dark-0": 0.0, "flat-0": 500.0, "flat-1": 2000.0}
FRAMES = 8
FLICKER = effect("flicker", sigma_percent=0.1)
DRIFT = effect("black_level_drift", sigma_dn=0.8)


def _layout() -> Any:
    return Stub(
        uniform=[Stub(name=name, numbers=tuple(range(FRAMES))) for name in LEVELS],
        channels=("MONO",),
        signal_dn={(name, "MONO"): level for name, level in LEVELS.items()},
    )


def _frames(rng: np.random.Generator, flicker: float, drift: float) -> dict[str, np.ndarray]:
    """Return means of frames, each of two pixels: some that are unalike, of no matter."""
    return {
        name: 64
        + level * (1 + flicker * rng.standard_normal(FRAMES))
        + drift * rng.standard_normal(FRAMES)
        + np.sqrt(NEW_DN2) * rng.standard_normal(FRAMES)
        for name, level in LEVELS.items()
    }


def _of(means: dict[str, np.ndarray]) -> Any:
    return lambda name: [np.array([[m - 3.0, m + 3.0]]) for m in means[name]]


def _told(means: dict[str, np.ndarray], asked: Any) -> Held:
    def frames(_layout: object, number: int, seed: int) -> Any:
        return _of(_frames(np.random.default_rng([seed, number]), 0.0, 0.0))

    return frame_by_frame(_layout(), _of(means), Stub(frames=frames), asked, 3)  # type: ignore[arg-type]


def _total(means: dict[str, np.ndarray], asked: Any) -> float:
    return float(sum(own.sum() for own in _told(means, asked).gains))


def test_it_is_the_ratio_of_the_densities_that_the_others_foretell() -> None:
    """At a size known from many frames: from the mean of the others, n / (n - 1) as wide."""
    means = _frames(np.random.default_rng(5), 0.001, 0.0)
    told = _told(means, FLICKER)
    own = means["flat-1"]
    for t, nats in enumerate(told.gains[2]):
        others = np.delete(own, t).mean()
        wide = np.sqrt(1 + 1 / (FRAMES - 1))
        expected = max(
            norm.logpdf(own[t], others, np.sqrt(NEW_DN2 + (0.001 * s * 2000) ** 2) * wide)
            - norm.logpdf(own[t], others, np.sqrt(NEW_DN2) * wide)
            for s in (0.7, 0.85, 1.0, 1.2, 1.4)
        )
        # What is new is known from 16 simulated recordings, the size from these frames.
        assert nats == pytest.approx(expected, rel=0.35, abs=0.7)


@pytest.mark.parametrize(("asked", "flicker", "drift"), [(FLICKER, 0.001, 0.0), (DRIFT, 0.0, 0.8)])
def test_what_is_there_gains_and_noise_does_not(asked: Any, flicker: float, drift: float) -> None:
    for seed in range(12):
        rng = np.random.default_rng([7, seed])
        assert _total(_frames(rng, flicker, drift), asked) > 9.3
        assert _total(_frames(rng, 0.0, 0.0), asked) < 3.0


def _tried(means: dict[str, np.ndarray], asked: Any) -> Gained | None:
    def frames(_layout: object, number: int, seed: int) -> Any:
        return _of(_frames(np.random.default_rng([seed, number]), 0.0, 0.0))

    trial: Any = Stub(lines=Stub(layout=_layout(), frames_of=_of(means)), seed=4)
    return Trial.frame_by_frame(trial, Stub(frames=frames), asked)  # type: ignore[arg-type]


def test_chance_is_ruled_out_at_the_odds_of_a_search() -> None:
    rng = np.random.default_rng(11)
    moved, still = _frames(rng, 0.001, 0.0), _frames(rng, 0.0, 0.0)
    sure, unsure = _tried(moved, FLICKER), _tried(still, FLICKER)
    assert sure is not None
    assert unsure is not None
    assert sure.certain
    assert sure.gain.ci95[0] > 0
    assert not unsure.certain
    assert _tried(moved, effect("row_noise", sigma_dn=1.0)) is None  # moves no whole frames


def test_one_frame_aside_is_no_flicker() -> None:
    """It may gain much, but all that is gained is its own."""
    means = _frames(np.random.default_rng(2), 0.0, 0.0)
    means["flat-1"][3] += 6.0
    told = _tried(means, FLICKER)
    assert told is not None
    assert not told.certain


WORSE = Gained(Gain(-0.4, (-0.6, -0.2)), certain=False)
SURE = Gained(Gain(1.7, (0.3, 3.4)), certain=True)


def _confirmed(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> Gained:
    """Return what is said of flicker of which the two locked frames show next to nothing."""
    how = {"left": (), "beside": (), "whole": "all", "told": SURE} | changes
    monkeypatch.setattr(confirmed, "relit", lambda model, *_: model)
    monkeypatch.setattr(confirmed, "shown_by_all", lambda *_: False)
    one = Stub(
        name="flicker", kind="flicker", gain=50.0, effect=FLICKER, proposal=Stub(effect=FLICKER)
    )
    search: Any = Stub(
        named=[one],
        setting=Stub(jobs=1),
        whole=how["whole"],
        fitted_without=lambda *_: Stub(effect=how["beside"]),
    )
    trial: Any = Stub(
        gains=lambda _, without: dict.fromkeys(without, WORSE),
        foretold=lambda _: None,
        frame_by_frame=lambda *_: how["told"],
        numbers=Stub(whole=(None, None), frames=14),
    )
    final: Any = Stub(
        mismatches=[Stub(statistic=name) for name in how["left"]],
        calibrated=Stub(model=None),
        setting=Stub(layout=None),
    )
    return confirmed._gained(search, final, trial)["flicker"]


def test_two_locked_frames_that_lie_still_do_not_overrule_all_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert _confirmed(monkeypatch) == SURE


@pytest.mark.parametrize(
    "changes",
    [
        {"left": ("frame_variance",)},  # something else moves them, too
        {"beside": (FLICKER,)},  # the user's
        {"whole": None},  # a large recording has locked frames enough
        {"told": Gained(Gain(0.1, (-0.1, 0.3)), certain=False)},
        {"told": None},
    ],
)
def test_else_the_locked_frames_have_the_last_word(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any]
) -> None:
    assert _confirmed(monkeypatch, **changes) == WORSE
