"""Sums over simulated frames that an effect cannot change are left out; all others are the same."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.mismatch.model import simulate
from analysis.mismatch.observe import Observation
from analysis.mismatch.simulations import Simulations
from analysis.mismatch.state import State
from analysis.mismatch.touches import (
    ALL_SUMS,
    CARRY_OVER,
    NEIGHBOURS,
    RECORDED,
    SPECTRA,
    sums_for,
    touched,
)
from analysis.mismatch.vector import Vector, vector
from dsis.effects.adc_memory import AdcMemory
from dsis.effects.nonlinearity import Nonlinearity
from dsis.effects.row_noise import RowNoise
from effect_examples import KINDS, example_of
from mismatch_recordings import camera, recorded, state_of

SCENE = np.linspace(100, 2000, 96 * 128, dtype=np.float32).reshape(96, 128)
ONLY = {
    SPECTRA: {
        "spectral_peak",
        "line_correlation",
        "alternation_variance",
        "patch_variance",
        "line_alternation",
        "fixed_spectral_peak",
    },
    NEIGHBOURS: {
        "correlation_0_1",
        "correlation_1_0",
        "correlation_1_1",
        "correlation_0_2",
        "correlation_2_0",
        "fixed_correlation_0_1",
        "fixed_correlation_1_0",
    },
    CARRY_OVER: {"carry_over"},
}


@pytest.fixture(scope="module", params=["MONO", "RGGB"])
def state(request: pytest.FixtureRequest) -> State:
    mono = request.param == "MONO"
    recording = recorded(
        camera(cfa=request.param), 3, frames=6, levels=(300.0, 900.0), scene=SCENE if mono else None
    )
    return state_of(recording, camera(cfa=request.param))


def itself(seen: Observation) -> Observation:
    return seen


def numbers(state: State, made: frozenset[str]) -> Vector:
    layout, model = state.setting.layout, state.calibrated.model
    (seen,) = simulate(model, layout, [0], 5, 1, itself, made)
    return vector(layout, seen, state.calibrated.refit(layout, seen.levels))


@pytest.mark.parametrize("left_out", [*ONLY, None])
def test_a_sum_left_out_leaves_its_numbers_unknown_and_no_others(
    state: State, left_out: str | None
) -> None:
    made = ALL_SUMS - {left_out} if left_out else frozenset()
    whole, some = numbers(state, ALL_SUMS), numbers(state, made)
    assert some.keys == whole.keys
    names = {left_out} if left_out else set(ONLY)
    without = set().union(*(ONLY[name] for name in names))
    needing = np.array([key.statistic in without for key in whole.keys])
    np.testing.assert_array_equal(some.values[~needing], whole.values[~needing])
    lost = np.isfinite(whole.values) & ~np.isfinite(some.values)
    assert not lost[~needing].any()
    assert {key.statistic for key, gone in zip(whole.keys, lost, strict=True) if gone} >= {
        *without - {"alternation_variance"}
    }


def test_variances_without_spikes_are_made_where_they_are_asked_for(state: State) -> None:
    """All else is the same with them and without."""
    layout, model = state.setting.layout, state.calibrated.model
    (whole,), (some,) = (
        simulate(model, layout, [0], 5, 1, itself, made) for made in (RECORDED, ALL_SUMS)
    )
    assert not state.calibrated.sums
    for place, level in whole.levels.items():
        assert level.bulk_dn2 == pytest.approx(level.variance_dn2, rel=0.1)
        own = some.levels[place]
        assert np.isnan([own.bulk_dn2, own.bulk_dof, own.far]).all()
        assert replace(level, bulk_dn2=0.0, bulk_dof=0.0, far=0.0) == replace(
            own, bulk_dn2=0.0, bulk_dof=0.0, far=0.0
        )
    values = [
        vector(layout, seen, state.calibrated.refit(layout, seen.levels)).values
        for seen in (whole, some)
    ]
    np.testing.assert_array_equal(*values, strict=True)


@pytest.mark.parametrize("kind", KINDS)
def test_all_that_an_effect_may_change_is_summed(kind: str, state: State) -> None:
    effect = example_of(KINDS[kind])
    whole, some = numbers(state, ALL_SUMS), numbers(state, sums_for([effect]))
    may = touched(whole.keys, [effect])
    np.testing.assert_array_equal(some.values[may], whole.values[may])


def test_few_effects_need_few_sums() -> None:
    assert not sums_for([Nonlinearity(percent_full_scale=1.0)])
    assert sums_for([RowNoise(sigma_dn=1.0)]) == {SPECTRA}
    assert sums_for([AdcMemory(step_dn=0.4, period_codes=128, at_code=12.0)]) == ALL_SUMS
    assert not sums_for([])


def test_simulations_sum_what_they_are_asked_for(state: State) -> None:
    """What differs by little is summed by little; more draws of the model itself, and else, all."""
    own = Simulations(
        state.setting.layout,
        state.calibrated.model,
        lambda one: vector(state.setting.layout, one, state.fit).values,
        1,
        1,
    )
    bent = Nonlinearity(percent_full_scale=1.0)
    darker = state.camera.model_copy(update={"black_level": state.camera.black_level - 1})
    carry = np.array([key.statistic == "carry_over" for key in state.vector.keys])
    for one, known in (
        (state.camera, True),
        (darker, True),
        (darker.model_copy(update={"effect": (bent,)}), True),
        (state.camera.model_copy(update={"effect": (bent,)}), False),
    ):
        assert bool(np.isfinite(own.of(one, 1)[0, carry]).any()) is known
