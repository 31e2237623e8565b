"""Lines that differ the more the longer the exposure have no offsets of their own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import grown as module
from analysis.mismatch.bank.key import MOSAIC, Key
from analysis.mismatch.framewalk import FrameMeans
from analysis.mismatch.grown import grown, warmed
from exposing import effect

TIMES = {"dark_0": 0.02, "dark_1": 0.12, "flat_0": 0.02, "flat_1": 0.05}
OFFSET = 0.25  # variance of the offsets, relative to noise of lines
SD = 0.04


def _state(
    of_time: np.ndarray, statistic: str, seed: int, *, sd: float = SD, channels: int = 1
) -> Any:
    """Return a state whose lines differ by offsets, or by what goes with time; it says offsets."""
    keys = [Key(statistic, "exposure", name, str(c), "") for c in range(channels) for name in TIMES]
    rng = np.random.default_rng(seed)
    if channels > 1:  # the same in all, and what they have in common besides
        keys += [Key(statistic, MOSAIC, name, "", "") for name in TIMES]
    drawn = np.cbrt(1 + of_time) + rng.normal(0, sd, len(TIMES))
    values = np.tile(drawn, len(keys) // len(TIMES))
    layout = SimpleNamespace(
        exposures=[SimpleNamespace(name=n, exposure_time_s=t) for n, t in TIMES.items()],
        uniform=(),
        channels=("MONO",),
    )
    return SimpleNamespace(
        setting=SimpleNamespace(layout=layout, seen=SimpleNamespace(lines={})),
        camera=SimpleNamespace(effect=()),
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn={})),
        vector=SimpleNamespace(keys=tuple(keys), values=values),
        null=SimpleNamespace(
            mean=np.full(len(keys), np.cbrt(1 + OFFSET)),
            sd=np.full(len(keys), sd),
            known=np.ones(len(keys), bool),
        ),
    )


@pytest.mark.parametrize(
    ("kind", "statistic"),
    [
        ("dsnu", "fixed_pixel_variance"),
        ("row_fpn", "fixed_row_variance"),
        ("column_fpn", "fixed_column_variance"),
    ],
)
def test_what_grows_with_time_is_no_offset(kind: str, statistic: str) -> None:
    time_s = np.array(list(TIMES.values()))
    without = np.ones(len(TIMES))
    growing = 1.5 * (time_s / time_s.max()) ** 2
    for seed in range(10):
        said = grown(_state(growing, statistic, seed), kind, without)
        assert said is not None
        assert said.share < 1 / 20
        assert "grows with exposure time" in said.why
        still = np.full(len(TIMES), OFFSET)
        assert grown(_state(still, statistic, seed), kind, without) is None


def test_offsets_beside_what_grows_are_believed() -> None:
    time_s, without = np.array(list(TIMES.values())), np.ones(len(TIMES))
    both = OFFSET + 1.5 * (time_s / time_s.max()) ** 2
    for seed in range(10):
        state = _state(both, "fixed_row_variance", seed, sd=0.01)
        assert grown(state, "row_fpn", without) is None


def test_what_moves_a_frame_counts_once_in_a_mosaic() -> None:
    """Whatever one exposure has of a drift, its channels have."""
    without, denied = np.ones(5 * len(TIMES)), 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        drift = OFFSET * rng.chisquare(3, len(TIMES)) / 3
        state = _state(drift, "frame_variance", seed, sd=0.09, channels=4)
        denied += grown(state, "black_level_drift", without) is not None
    assert denied <= 2


def _frames(seed: int, shares: dict[str, float]) -> dict[str, FrameMeans]:
    """Return means of six frames an exposure whose drift is 2.5 times what is new in each."""
    rng = np.random.default_rng(seed)
    return {
        name: FrameMeans(np.arange(6.0), rng.normal(0, np.hypot(0.25 * share, 0.1), 6), 0.1**2)
        for name, share in shares.items()
    }


def _denied(shares: dict[str, float], monkeypatch: pytest.MonkeyPatch) -> int:
    """Return how often frames whose numbers say nothing deny a drift in 300 recordings."""
    found = 0
    for seed in range(300):
        frames = _frames(seed, shares)
        monkeypatch.setattr(module, "means_of", lambda *_, means=frames: means)
        state = _state(np.zeros(len(TIMES)), "frame_variance", seed)
        found += grown(state, "black_level_drift", np.ones(len(TIMES))) is not None
    return found


def test_frames_say_by_their_own_likelihood_whether_a_drift_grows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a drift that is alike one exposure of six frames may show a tenth, another three times."""
    assert _denied(dict.fromkeys(TIMES, 1.0), monkeypatch) <= 3
    growing = {name: time / max(TIMES.values()) for name, time in TIMES.items()}
    assert _denied(growing, monkeypatch) >= 90


def test_frames_without_noise_say_nothing_of_growth() -> None:
    still = FrameMeans(np.arange(6.0), np.zeros(6), 1.0)
    assert module.growing([still, still], np.array([0.1, 1.0])) == (0, 0)


def test_one_exposure_time_tells_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TIMES, "dark_1", 0.02)
    monkeypatch.setitem(TIMES, "flat_1", 0.02)
    of_one = np.array([0.0, 1.5, 0.0, 0.0])
    assert grown(_state(of_one, "fixed_row_variance", 0), "row_fpn", np.ones(4)) is None


def test_gains_and_other_numbers_are_not_asked() -> None:
    growing = np.array([0.0, 1.5, 0.0, 0.2])
    assert grown(_state(growing, "fixed_row_variance", 0), "row_prnu", np.ones(4)) is None
    assert grown(_state(growing, "fixed_row_variance", 0), "column_fpn", np.ones(4)) is None


@pytest.mark.parametrize("alone", [True, False])
def test_one_channel_by_itself_denies_no_offset(alone: bool) -> None:
    """No offsets, and a dark of one channel that is far out by chance; or of all of them."""
    statistic, count = "fixed_column_variance", len(TIMES)
    own = _state(np.zeros(count), statistic, 3, channels=4)
    far = [i for i, key in enumerate(own.vector.keys[: 4 * count]) if key.exposure == "dark_1"]
    own.vector.values[far[:1] if alone else far] += 0.3
    said = grown(own, "column_fpn", np.ones(len(own.vector.keys)))
    assert (said is None) is alone


NEW_DN2 = 0.09**2
DRIFT = effect("black_level_drift", sigma_dn=0.3, persistence=0.98)


def _warmed(
    levels: dict[str, tuple[float, float]],
    monkeypatch: pytest.MonkeyPatch,
    *,
    within_dn: float = 0.0,
    modelled: tuple[float, ...] = (),
    one: Any = DRIFT,
) -> bool:
    """Return whether darks (seconds, level) deny a drift; frames of each scatter `within_dn`."""
    rng = np.random.default_rng(4)
    wander = within_dn * np.array([1.0, -1.0] * 4)
    means = {
        name: FrameMeans(np.arange(8.0), level + wander + 0.05 * rng.standard_normal(8), NEW_DN2)
        for name, (_, level) in levels.items()
    }
    monkeypatch.setattr(module, "means_of", lambda *_: means)
    uniform = [
        SimpleNamespace(name=name, exposure_time_s=time, kind="dark")
        for name, (time, _) in levels.items()
    ]
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(uniform=uniform, channels=("MONO",)),
            seen=SimpleNamespace(lines={}),
        ),
        camera=SimpleNamespace(effect=()),
        calibrated=SimpleNamespace(
            fit=SimpleNamespace(signal_dn={}),
            offsets=SimpleNamespace(
                level_dn={(n, "MONO"): dn for n, dn in zip(levels, modelled, strict=False)}
            ),
        ),
    )
    return warmed(state, one) is not None


def test_darks_that_grow_with_time_are_no_wander_of_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    two = {"a": (0.01, 0.0), "b": (0.5, 0.6)}
    assert _warmed(two, monkeypatch)
    assert not _warmed(two, monkeypatch, within_dn=0.4)  # frames show that they wander
    assert not _warmed(two, monkeypatch, one=effect("dsnu", sigma_dn=1.0))
    assert not _warmed({"a": (0.01, 0.0), "b": (0.5, 0.02)}, monkeypatch)  # nothing grows
    assert not _warmed({"a": (0.01, 0.0), "b": (0.01, 0.6)}, monkeypatch)  # no time says so
    assert not _warmed({"a": (0.01, 0.6), "b": (0.5, 0.0)}, monkeypatch)  # no current falls
    assert not _warmed(two, monkeypatch, modelled=(0.0, 0.6))  # the camera has it


def test_darks_in_no_order_of_their_times_may_wander(monkeypatch: pytest.MonkeyPatch) -> None:
    times = (0.01, 0.1, 0.2, 0.5)
    line, none = (0.0, 0.12, 0.24, 0.6), (0.0, 0.9, -0.6, 0.5)
    for levels, grows in ((line, True), (none, False)):
        darks = {str(t): (t, level) for t, level in zip(times, levels, strict=True)}
        assert _warmed(darks, monkeypatch) is grows
