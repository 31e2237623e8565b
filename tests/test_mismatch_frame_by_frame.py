"""Effects that move whole frames: what each frame gains, told by all the others."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.linalg import helmert
from scipy.stats import norm

from analysis.mismatch import confirmed, framebyframe
from analysis.mismatch.finding import Gain
from analysis.mismatch.framebyframe import FrameByFrame, frame_by_frame
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
        still=frozenset(),
        full=frozenset(),
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


def _told(means: dict[str, np.ndarray], asked: Any) -> FrameByFrame:
    def frames(_layout: object, number: int, seed: int) -> Any:
        return _of(_frames(np.random.default_rng([seed, number]), 0.0, 0.0))

    return frame_by_frame(_layout(), _of(means), Stub(frames=frames), asked, 3)  # type: ignore[arg-type]


def _total(means: dict[str, np.ndarray], asked: Any) -> float:
    return float(sum(own.sum() for own in _told(means, asked).gains))


def _exact(monkeypatch: pytest.MonkeyPatch, means: dict[str, np.ndarray]) -> FrameByFrame:
    """Return what is told at one of two sizes, of means that are as new as `NEW_DN2` says."""
    monkeypatch.setattr(framebyframe, "_SCALES", np.array([0.5, 2.0]))
    apart = np.sqrt(NEW_DN2 * (FRAMES - 1) / FRAMES) * np.tile([-1.0, 1.0], FRAMES // 2)
    new = {name: 64 + level + apart for name, level in LEVELS.items()}
    bare: Any = Stub(frames=lambda *_: _of(new))
    return frame_by_frame(_layout(), _of(means), bare, FLICKER, 3)


def _contrasts(own: np.ndarray, level: float, scale: float) -> float:
    """Return how much likelier frames about their unknown mean are with flicker: contrasts."""
    seen = helmert(own.size) @ own
    wide = np.sqrt(NEW_DN2 + (scale * 0.001 * level) ** 2)
    return float((norm.logpdf(seen, 0, wide) - norm.logpdf(seen, 0, np.sqrt(NEW_DN2))).sum())


def test_it_is_the_ratio_of_the_densities_that_the_others_foretell(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """About the mean of the others, n / (n - 1) as wide, at the size that they make likeliest."""
    means = _frames(np.random.default_rng(5), 0.001, 0.0)
    told = _exact(monkeypatch, means)
    wide, least = np.sqrt(FRAMES / (FRAMES - 1)), []
    for nats, (name, level) in zip(told.gains, LEVELS.items(), strict=True):
        for t, gain in enumerate(nats):
            others = {**means, name: np.delete(means[name], t)}
            likely = {
                scale: sum(_contrasts(others[one], LEVELS[one], scale) for one in LEVELS)
                for scale in (0.5, 2.0)
            }
            best = max(likely, key=lambda scale: likely[scale])
            least.append(likely[best])
            sd = np.sqrt(NEW_DN2 + (best * 0.001 * level) ** 2)
            expected = norm.logpdf(means[name][t], others[name].mean(), sd * wide) - norm.logpdf(
                means[name][t], others[name].mean(), np.sqrt(NEW_DN2) * wide
            )
            assert gain == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert told.least == pytest.approx(min(least), rel=1e-9)


def test_frames_that_tell_nothing_are_not_asked() -> None:
    """Of few codes, of full pixels, or alike in the model."""
    means = _frames(np.random.default_rng(5), 0.001, 0.0)
    layout = _layout()
    layout.still, layout.full = frozenset({("dark-0", "MONO")}), frozenset({("flat-1", "MONO")})
    apart = {name: 64 + level + np.arange(FRAMES) * (level > 0) for name, level in LEVELS.items()}
    bare: Any = Stub(frames=lambda *_: _of(apart))
    assert len(frame_by_frame(layout, _of(means), bare, FLICKER, 3).gains) == 1
    assert len(frame_by_frame(_layout(), _of(means), bare, FLICKER, 3).gains) == 2
    bare = Stub(frames=lambda *_: _of({name: np.zeros(FRAMES) for name in LEVELS}))
    nothing = frame_by_frame(_layout(), _of(means), bare, FLICKER, 3)
    assert (nothing.gains, nothing.least) == ([], 0.0)


@pytest.mark.parametrize(("asked", "flicker", "drift"), [(FLICKER, 0.001, 0.0), (DRIFT, 0.0, 0.8)])
def test_what_is_there_gains_and_noise_does_not(asked: Any, flicker: float, drift: float) -> None:
    for seed in range(12):
        rng = np.random.default_rng([7, seed])
        assert _total(_frames(rng, flicker, drift), asked) > 9.3
        assert _total(_frames(rng, 0.0, 0.0), asked) < 3.0


def _tried(means: dict[str, np.ndarray], asked: Any, held: object = 1) -> Gained | None:
    def frames(_layout: object, number: int, seed: int) -> Any:
        return _of(_frames(np.random.default_rng([seed, number]), 0.0, 0.0))

    asked_of = Stub(layout=_layout(), frames_of=_of(means))
    trial: Any = Stub(held=held, lines=asked_of, seed=4)
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
    assert _tried(moved, FLICKER, held=None) is None  # nothing is locked


def test_one_frame_aside_is_no_flicker() -> None:
    """It may gain much, but all that is gained is its own."""
    means = _frames(np.random.default_rng(2), 0.0, 0.0)
    means["flat-1"][3] += 6.0
    told = _tried(means, FLICKER)
    assert told is not None
    assert not told.certain


WORSE = Gained(Gain(-0.4, (-0.6, -0.2)), certain=False, nats=0.0)
SURE = Gained(Gain(1.7, (0.3, 3.4)), certain=True, nats=0.0)


def _confirmed(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> Gained:
    """Return what is said of flicker of which the two locked frames show next to nothing."""
    how = {"left": (), "beside": (), "whole": "all", "told": SURE, "locked": WORSE} | changes
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
        gains=lambda _, without: dict.fromkeys(without, how["locked"]),
        foretold=lambda _: None,
        frame_by_frame=lambda *_: how["told"],
        numbers=Stub(whole=(None, None), frames=14),
    )
    final: Any = Stub(
        mismatches=[Stub(statistic=name) for name in how["left"]],
        chances=np.array([]),
        null=Stub(keys=()),
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
        {"told": Gained(Gain(0.1, (-0.1, 0.3)), certain=False, nats=0.0)},
        {"told": None},
    ],
)
def test_else_the_locked_frames_have_the_last_word(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any]
) -> None:
    assert _confirmed(monkeypatch, **changes) == WORSE


def test_without_locked_frames_nothing_is_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = Gained(Gain(float("nan"), (float("-inf"), float("inf"))), certain=False, nats=0.0)
    assert not _confirmed(monkeypatch, locked=nothing).certain
