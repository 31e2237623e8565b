"""Levels that bend smoothly are no read-out paths that disagree: by any law, not by one only."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.displaced import displaced
from analysis.mismatch.smooth import (
    at_a_switch,
    behind_smooth,
    behind_switch,
    by_levels,
    smooth_as_well,
)
from dsis.effects.adc_dnl import AdcDnl

Array = NDArray[np.float64]
MANY = np.array([150.0, 2100, 4000, 5200, 6500, 7200, 7400, 8300, 9900])
SWITCH, SAMPLES = 5800.0, 160_000
TOP = 13_800.0


def _state(bend: Array, signals: Array, seed: int, colours: int = 1) -> Any:
    """Return a state that knows levels of flats: means of noisy samples beside their light."""
    rng = np.random.default_rng(seed)
    channels = ("R", "G", "B")[:colours]
    keys, values, sds, at = [], [], [], {}
    for i, (s, b) in enumerate(zip(signals, bend, strict=True)):
        for channel in channels:
            sd = float(np.sqrt((90 + 1.3 * s) / SAMPLES))
            mean = (
                float(np.mean(rng.normal(0.0, sd * SAMPLES**0.5, 4000))) * (4000 / SAMPLES) ** 0.5
            )
            keys.append(Key("level", "exposure", f"flat-{i}", channel))
            values.append(b + 3e-4 * s + mean)
            sds.append(sd)
            at[f"flat-{i}", channel] = float(s)
    uniform = [SimpleNamespace(name=f"flat-{i}", kind="flat") for i in range(signals.size)]
    paths = (SimpleNamespace(upper_dn=SWITCH), SimpleNamespace(upper_dn=None))
    return SimpleNamespace(
        camera=SimpleNamespace(noise=SimpleNamespace(segment=paths), effect=()),
        setting=SimpleNamespace(layout=SimpleNamespace(uniform=uniform, channels=channels)),
        calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn=at)),
        vector=SimpleNamespace(keys=tuple(keys), values=np.array(values)),
        null=SimpleNamespace(
            mean=np.zeros(len(keys)), sd=np.array(sds), known=np.ones(len(keys), bool)
        ),
        mismatches=[SimpleNamespace(statistic="level")],
    )


def _kink(signals: Array, percent: float) -> Array:
    return percent / 100 * np.maximum(signals - SWITCH, 0.0)


def _step(signals: Array, percent: float) -> Array:
    return percent / 100 * np.where(signals >= SWITCH, signals, 0.0)


def _parabola(signals: Array, percent: float) -> Array:
    return percent / 100 * signals * (1 - signals / TOP)


def _bends(signals: Array, size_dn: float) -> dict[str, Array]:
    """Return smooth deviations from a line through black and the top, the largest of a size."""
    u = signals / TOP
    return {
        "cubic": -size_dn * u * (1 - u) * (1 + u) * 2.6,
        "square": -size_dn * 4 * u * (1 - u),
        "root": -size_dn * (np.sqrt(u) - u) * 4,
    }


def _predicted(state: Any, law: Any) -> Array:
    """Return what a fit of gains that disagree predicts: the best size, and the light's scale."""
    s = np.array([state.calibrated.fit.signal_dn[key.place] for key in state.vector.keys])
    design = np.stack([law(s, 1.0), s], 1) / state.null.sd[:, None]
    return np.asarray(
        design
        @ np.linalg.lstsq(design, state.vector.values / state.null.sd, rcond=None)[0]
        * state.null.sd
    )


@pytest.mark.parametrize("law", ["cubic", "square"])
@pytest.mark.parametrize("colours", [1, 3])
def test_levels_that_bend_smoothly_deny_paths_that_disagree(law: str, colours: int) -> None:
    for seed in range(5):
        state = _state(_bends(MANY, 12.0)[law], MANY, seed, colours)
        mean = _predicted(state, _kink)
        assert displaced(state, "dual_gain_mismatch", mean) is not None
        assert displaced(state, "nonlinearity", _predicted(state, _parabola)) is None


@pytest.mark.parametrize("law", [_kink, _step])
@pytest.mark.parametrize("colours", [1, 3])
def test_levels_that_change_where_a_path_begins_deny_a_bend(law: Any, colours: int) -> None:
    for seed in range(5):
        state = _state(law(MANY, 0.25), MANY, seed, colours)
        denial = displaced(state, "nonlinearity", _predicted(state, _parabola))
        assert denial is not None
        assert "read-out path" in denial.why
        stated = _predicted(state, _parabola)
        assert at_a_switch(state, "adc_memory", stated) is not None
        state.mismatches.append(SimpleNamespace(statistic="carry_over"))
        assert at_a_switch(state, "adc_memory", stated) is None
        state.camera.noise.segment = state.camera.noise.segment[1:]  # one path, and no switch
        assert behind_switch(state, _predicted(state, _parabola)) == -np.inf


@pytest.mark.parametrize("law", [_kink, _step])
@pytest.mark.parametrize("colours", [1, 3])
def test_paths_that_disagree_are_not_denied(law: Any, colours: int) -> None:
    for seed in range(5):
        state = _state(law(MANY, 0.25), MANY, seed, colours)
        mean = _predicted(state, law)
        assert displaced(state, "dual_gain_mismatch", mean) is None
        assert not smooth_as_well(state, mean, "dual_gain_mismatch", "nonlinearity")


def test_levels_on_one_side_of_a_switch_say_nothing_of_it() -> None:
    """A toe below the first flat is an offset to all of them, and no path's."""
    signals = np.linspace(1500.0, TOP, 9)
    state = _state(12.0 * (1 - np.exp(-signals / 300.0)), signals, 1)
    state.camera.noise.segment = (SimpleNamespace(upper_dn=280.0), SimpleNamespace(upper_dn=None))
    assert behind_switch(state, _predicted(state, _parabola)) == -np.inf


def test_a_smooth_law_that_is_only_a_little_likelier_is_a_tie() -> None:
    """Whatever the size of the bend, one of: a kink, either, or smooth; never a jump between."""
    seen = set()
    for size in np.linspace(2.0, 12.0, 21):
        state = _state(_bends(MANY, size)["cubic"], MANY, 3)
        mean = _predicted(state, _kink)
        behind = behind_smooth(state, mean)
        tie = smooth_as_well(state, mean, "dual_gain_mismatch", "nonlinearity")
        assert tie == (0 <= behind < 3)
        denial = by_levels(state, "dual_gain_mismatch", state.null.mean, mean)[1]
        assert not (tie and denial)
        seen.add(tie)
    assert seen == {True, False}


def test_few_levels_say_nothing_of_a_law() -> None:
    few = np.array([2000.0, 7000.0])
    state = _state(_kink(few, 0.3), few, 1)
    assert behind_smooth(state, _predicted(state, _kink)) == -np.inf


def test_what_misfits_every_law_makes_all_errors_larger() -> None:
    """Light that is stated badly scatters levels: what scatters by chance tells no law."""
    rng = np.random.default_rng(5)
    behind = []
    for _ in range(40):
        state = _state(_kink(MANY, 0.25) + 5.0 * rng.standard_normal(MANY.size), MANY, 2)
        behind.append(behind_smooth(state, _predicted(state, _kink)))
    assert np.mean(np.array(behind) >= 3) <= 0.1  # odds of 20


@pytest.mark.parametrize(("size_dn", "denied"), [(4.0, True), (12.0, False)])
def test_codes_that_are_not_equally_wide_bend_levels_by_their_sum(
    size_dn: float, denied: bool
) -> None:
    """9900 codes, widths off by 0.1: 0.1 sqrt(9900) / 2 = 5 DN in the middle."""
    bend = _bends(MANY, size_dn)["square"]
    state = _state(bend, MANY, 3)
    assert by_levels(state, "nonlinearity", np.zeros(MANY.size), bend) == (True, None)
    state.camera.effect = (AdcDnl(rms_lsb=0.1),)
    seen, denial = by_levels(state, "nonlinearity", np.zeros(MANY.size), bend)
    assert seen
    assert (denial is not None) == denied
