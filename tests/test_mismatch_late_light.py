"""Light that begins late at one side is uneven by the same DN at every exposure time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.surfaces import leaning
from analysis.mismatch.latelight import of_late_light
from dsis.measures import Accumulator

ROWS, COLUMNS, FRAMES = 48, 64, 6
TIMES_S = (0.01, 0.02, 0.04, 0.06, 0.08)
DARKS_S = (0.01, 0.08)
RATE = 20_000.0  # DN / s
KINDS = ("shading", "smooth_prnu", "tap_mismatch", "line_settling")
DOWN = np.linspace(-1, 1, ROWS)[:, np.newaxis] * np.ones(COLUMNS)


def _state(
    change: Any,
    times: tuple[float, ...] = TIMES_S,
    seed: int = 1,
    *,
    beside: tuple[str, ...] = (),
) -> Any:
    """Return the state of darks and flats; `change(signal, time)` is added to a mean frame, DN."""
    rng = np.random.default_rng(seed)
    surfaces, signals, exposures = {}, {}, []
    light = [(t, 0.0) for t in DARKS_S]
    light += [(t, RATE * t0) for t, t0 in zip(times, TIMES_S, strict=True)]
    for k, (time, signal) in enumerate(light):
        sums, sd = Accumulator(ROWS, COLUMNS), (25.0 + 0.5 * signal) ** 0.5
        mean = 64 + signal + change(signal, time)
        for _ in range(FRAMES):
            frame = mean + rng.normal(0, sd, (ROWS, COLUMNS))
            sums.add(np.floor(frame + 0.5).astype(np.uint16))
        name = f"E{k}"
        exposures.append(SimpleNamespace(name=name, exposure_time_s=time))
        surfaces[name, "MONO"] = leaning(sums.result().channels["MONO"], FRAMES)
        signals[name, "MONO"] = signal
    return SimpleNamespace(
        camera=SimpleNamespace(effect=[SimpleNamespace(kind=kind) for kind in beside]),
        setting=SimpleNamespace(
            layout=SimpleNamespace(uniform=exposures, channels=("MONO",)),
            seen=SimpleNamespace(surfaces=surfaces),
        ),
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=signals)),
    )


def _late(signal: float, time: float) -> NDArray[np.float64]:
    return np.asarray(2.0 * DOWN * (signal / time / RATE))


def _shaded(signal: float, _: float) -> NDArray[np.float64]:
    return np.asarray(0.002 * DOWN * signal)


@pytest.mark.parametrize("kind", [*KINDS, "amp_glow"])
def test_late_light_is_no_gain_and_no_glow(kind: str) -> None:
    said = of_late_light(_state(_late), kind)
    assert said is not None
    assert said.share < 0.05
    assert "for longer" in said.why


@pytest.mark.parametrize("kind", KINDS)
def test_uneven_light_in_proportion_to_the_signal_is_believed(kind: str) -> None:
    assert of_late_light(_state(_shaded), kind) is None
    beside = _state(lambda s, t: _shaded(s, t) + 2.0 * DOWN)  # and an offset that is uneven
    assert of_late_light(beside, kind) is None


def test_a_glow_is_believed() -> None:
    assert of_late_light(_state(lambda _, t: 60.0 * t * DOWN), "amp_glow") is None


def test_exposures_of_one_time_do_not_tell() -> None:
    """Then light that begins late is a gain: the same share at every level."""
    times = (0.02,) * len(TIMES_S)
    assert of_late_light(_state(_late, times), "shading") is None


def test_chance_and_other_effects_deny_nothing() -> None:
    for seed in range(30):  # uneven light that is just seen: 4 standard errors at the top
        state = _state(lambda s, t: 0.5 * _shaded(s, t), seed=seed)
        assert of_late_light(state, "shading") is None
    assert of_late_light(_state(_late), "row_fpn") is None


def _glowing(signal: float, time: float) -> NDArray[np.float64]:
    return _shaded(signal, time) + 40.0 * time * DOWN


def test_a_glow_beside_uneven_gains_is_believed_even_where_all_flats_take_as_long() -> None:
    alone = (0.01,) * len(TIMES_S)
    state = _state(_glowing, alone, beside=("shading", "amp_glow"))
    assert of_late_light(state, "amp_glow") is None
    assert of_late_light(state, "shading") is None


def test_late_light_beside_uneven_gains_is_no_glow() -> None:
    def both(signal: float, time: float) -> NDArray[np.float64]:
        return _shaded(signal, time) + _late(signal, time)

    assert of_late_light(_state(both, beside=("shading",)), "amp_glow") is not None


def test_what_all_exposures_have_alike_is_not_light_of_any() -> None:
    """Of an offset neither law says anything: one of several shapes is likelier by chance."""
    for seed in range(60):
        state = _state(lambda _s, _t: 2.0 * DOWN, seed=seed)
        assert of_late_light(state, "line_settling") is None
