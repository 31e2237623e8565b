"""Light that falls or rises from frame to frame is no flicker, which is new in each."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import fading as module
from analysis.mismatch.fading import fading
from analysis.mismatch.framewalk import FrameMeans
from dsis.effects import Effect
from exposing import effect

SIGNALS = {"dark": 0.0, "flat-0": 100.0, "flat-1": 700.0, "flat-2": 3200.0}
FRAMES, NEW_DN2 = 6, 0.02**2
FLICKER = effect("flicker", sigma_percent=0.4)


def _denied(
    gains: NDArray[np.float64],
    monkeypatch: pytest.MonkeyPatch,
    *others: Effect,
    seed: int = 0,
    left: tuple[str, ...] = (),
    dark_dn: float = 0.0,
) -> bool:
    """Return whether flicker is denied by frames of some gains: (exposure, frame).

    The dark's mean falls by `dark_dn` from frame to frame; `left` are unexplained statistics.
    """
    rng = np.random.default_rng(seed)
    numbers = np.arange(float(FRAMES))
    means = {
        name: FrameMeans(numbers, signal * own + 0.02 * rng.standard_normal(FRAMES), NEW_DN2)
        for (name, signal), own in zip(SIGNALS.items(), gains, strict=True)
    }
    means["dark"] = replace(means["dark"], means=means["dark"].means - dark_dn * numbers)
    asked: list[list[Effect]] = []

    def means_of(_: Any, some: Any, effects: Any, light: Any) -> dict[str, FrameMeans]:
        asked.append(list(effects))
        return {own.name: means[own.name] for own in some if own.kind == "dark" or light(own.name)}

    monkeypatch.setattr(module, "means_of", means_of)
    uniform = [SimpleNamespace(name=name, kind=name[:4]) for name in SIGNALS]
    layout = SimpleNamespace(uniform=uniform, channels=("MONO",))
    signal_dn = {(name, "MONO"): signal for name, signal in SIGNALS.items()}
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(layout=layout, seen=SimpleNamespace(lines={})),
        camera=SimpleNamespace(effect=(FLICKER, *others)),
        mismatches=[SimpleNamespace(statistic=name) for name in left],
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=signal_dn)),
    )
    found = fading(state, FLICKER) is not None
    assert all(FLICKER not in own for own in asked)  # else its frames would be new by its own share
    return found


@pytest.mark.parametrize("change", [-0.0012, 0.0012])
def test_light_that_falls_in_each_exposure_is_no_flicker(
    change: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    gains = 1 + change * np.tile(np.arange(FRAMES), (len(SIGNALS), 1))
    assert _denied(gains, monkeypatch)
    drift = effect("black_level_drift", sigma_dn=1.0, persistence=0.9)
    lag = effect("image_lag", fraction=0.4)
    for other in (drift, lag):
        assert not _denied(gains, monkeypatch, other)  # which may be what persists
    assert not _denied(gains, monkeypatch, left=("frame_correlation",))
    assert not _denied(gains, monkeypatch, dark_dn=1.0)


def test_a_gain_that_is_new_in_each_frame_is_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """At odds of a thousand: in some hundred recordings hardly ever by chance."""
    rng = np.random.default_rng(4)
    denied = [
        _denied(1 + 0.004 * rng.standard_normal((4, FRAMES)), monkeypatch, seed=seed)
        for seed in range(300)
    ]
    assert sum(denied) <= 2


def test_it_is_asked_of_flicker_alone() -> None:
    state: Any = SimpleNamespace()
    assert fading(state, effect("row_noise", sigma_dn=1.0)) is None
