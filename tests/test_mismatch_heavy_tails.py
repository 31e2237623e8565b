"""Numbers with heavy tails depart no farther than they are rare; simulations say what scatters."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.bank.key import Key
from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.diagnose import _of_all_frames
from analysis.mismatch.heavytails import chances, degrees
from analysis.mismatch.null import _by_name, null_of
from analysis.mismatch.replicates import Known, Replicates, more
from analysis.mismatch.state import SUREST, State, nearly
from analysis.mismatch.vector import Vector
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded, setting_of

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from mismatch_model_nulls import held_against_others

COMMON = 223.0
DOF = 15


def _keys(statistics: int, each: int) -> list[Key]:
    return [Key(f"s{i}", "exposure", f"flat-{j}") for i in range(statistics) for j in range(each)]


def test_normal_numbers_keep_a_normal_law() -> None:
    """All but one in 200: kurtosis itself has a tail."""
    drawn = np.random.default_rng(1).normal(size=(64, 20_000))
    assert np.isfinite(degrees(_keys(5000, 4), drawn, np.ones(20_000, bool))).mean() < 8e-3


def test_degrees_are_those_drawn_from() -> None:
    """Numbers of a statistic in common, by their kurtosis, of which few samples show less."""
    rng = np.random.default_rng(2)
    by_count = [
        degrees(_keys(1, 800), rng.standard_t(9, size=(n, 800)), np.ones(800, bool))
        for n in (64, 4096)
    ]
    assert all(np.isfinite(found).all() for found in by_count)
    few, many = (float(np.median(found)) for found in by_count)
    assert 9 < few < 13
    assert many == pytest.approx(9, abs=0.7)


def test_numbers_that_do_not_scatter_have_a_normal_law() -> None:
    assert np.isinf(degrees(_keys(1, 3), np.ones((64, 3)), np.ones(3, bool))).all()


def test_few_simulations_show_no_tails() -> None:
    drawn = np.random.default_rng(2).standard_t(3, size=(16, 400))
    assert np.isinf(degrees(_keys(1, 400), drawn, np.ones(400, bool))).all()


def test_counts_of_which_there_are_none_and_unknown_numbers_have_no_tails() -> None:
    """One pixel in one of 64 recordings: fifty are no chance for that."""
    drawn = np.zeros((64, 3))
    drawn[5] = 1.0
    keys = [Key("outlying_pixels", "offset", "", "MONO", "8"), *_keys(2, 1)]
    found = degrees(keys, drawn, np.array([True, True, False]))
    assert np.isinf(found).tolist() == [True, False, True]


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=8), st.floats(4.05, 60))
def test_chances_are_those_of_student_s_law_of_unit_variance(
    departures: list[float], nu: float
) -> None:
    z = np.array(departures)
    heavy = 2 * scipy.stats.t.sf(np.abs(z), nu, scale=np.sqrt((nu - 2) / nu))
    np.testing.assert_allclose(chances(z, np.full(z.size, nu), COMMON), heavy, rtol=1e-9)
    plain = 2 * scipy.stats.t.sf(np.abs(z), COMMON)
    for others in (np.inf, 2 * COMMON):
        np.testing.assert_allclose(chances(z, np.full(z.size, others), COMMON), plain, rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_few_numbers_whose_spread_denies_the_closed_form_have_their_own(seed: int) -> None:
    """Rows that bands move lean three times as far as pixels let them, columns do not.

    Both are told apart in six of ten, else each has a part of the other's. Without: 5.1 and 2.3.
    """
    rng = np.random.default_rng(seed)
    keys = [Key("fixed_smooth_tilt", "offset", "", "MONO", axis) for axis in ("rows", "columns")]
    variances = []
    for _ in range(2000):
        own = np.array([9.0, 1.0]) * rng.chisquare(DOF, 2) / DOF
        scale, worth, _ = _by_name(keys, own, np.ones(2, bool), DOF)
        variances.append((worth * scale + DOF * own) / (worth + DOF))
    rows, columns = np.median(variances, 0)
    assert rows > 6.5
    assert columns < 1.7


def test_one_number_that_spreads_as_the_closed_form_says_leans_on_it() -> None:
    own = np.random.default_rng(5).chisquare(DOF, 300) / DOF
    key = [Key("variance_persistence", "all", "", "MONO")]
    told = [_by_name(key, own[i : i + 1], np.ones(1, bool), DOF)[1][0] for i in range(own.size)]
    assert np.mean(np.array(told) > 0) > 0.98
    wide = _by_name(key, np.array([25.0]), np.ones(1, bool), DOF)
    assert wide[1][0] == 0
    assert wide[2][0] > 1.2  # tails of 15 degrees


def test_more_recordings_are_a_model_s_own() -> None:
    """Those moved from another model give way; base numbers are of one model."""
    key = (Key("level", "exposure", "dark-0", "MONO"),)

    def vector(value: float) -> Vector:
        return Vector(key, np.array([value]), np.ones(1))

    def fit(number: int) -> BaseFit:
        return cast(BaseFit, number)

    def simulate(which: range) -> list[tuple[BaseFit, Vector]]:
        return [(fit(i), vector(float(i))) for i in which]

    near = cast(Known, object())
    moved = Replicates(tuple(vector(v) for v in (0.0, 1.0, -5.0)), (fit(-1),), 2, moved_from=near)
    found = more(simulate, 5, moved)
    assert [float(one.values[0]) for one in found.vectors] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert found.fits == (2, 3, 4)
    assert (found.own, found.moved_from) == (5, None)
    kept = more(simulate, 3, Replicates(moved.vectors[:2], (fit(0), fit(1)), 2))
    assert kept.fits == (0, 1, 2)


BANDS = registry()["row_banding"](sigma_dn=1.13, length_rows=3.0)


@pytest.fixture(scope="module")
def of_bands() -> State:
    model = camera(BANDS)
    setting = setting_of(recorded(model, 1, columns=64, levels=FEW_LEVELS), nulls=192)
    return State.of(setting, model, lambda: None)


@pytest.mark.long
def test_a_model_s_own_recordings_do_not_differ(of_bands: State) -> None:
    """With bands of rows: by 16 simulations, and by 64 then, in 2 % of them at most."""
    made = of_bands.replicates.vectors
    alarms, asked = held_against_others(of_bands.setting.layout, made)
    assert asked > 1500
    assert alarms.total() <= 0.02 * asked


def test_spreads_are_those_of_the_model_s_recordings(of_bands: State) -> None:
    """Slow parts of rows that bands move; by half of the nulls they were 0.7 of that before."""
    made, keys = of_bands.replicates.vectors, of_bands.vector.keys
    nulls = [null_of(of_bands.setting.layout, made[i : i + 16], made[0]) for i in range(0, 192, 16)]
    spread = np.stack([one.values for one in made]).std(0, ddof=1)
    slow = [
        i
        for i, key in enumerate(keys)
        if key.statistic in ("fixed_smooth_tilt", "half_seam")
        and key.scope in ("offset", "time")
        and key.detail.startswith("rows")
    ]
    assert len(slow) == 6
    ratio = np.median([null.sd[slow] / spread[slow] for null in nulls], 0)
    assert ratio.mean() > 0.95
    assert (ratio < 1.6).all()  # fifteen degrees of freedom reach 1.3 times as far


@pytest.mark.parametrize(("sigma", "many"), [(0.3, True), (1.5, False), (0.0, False)])
def test_more_is_simulated_where_little_departs(sigma: float, many: bool) -> None:
    """Rows of 0.3 DN beside a model without are 6 standard deviations off, such of 1.5 DN many."""
    rows = (registry()["row_noise"](sigma_dn=sigma),) if sigma else ()
    setting = setting_of(recorded(camera(*rows), 3, columns=64, levels=FEW_LEVELS), nulls=16)
    sure = replace(setting, surest=SUREST)
    states = [State.of(sure, camera(), lambda: None, draft=draft) for draft in (False, True)]
    assert [len(state.replicates.vectors) for state in states] == [SUREST if many else 16, 8]
    assert nearly([m.z for m in State.of(setting, camera(), lambda: None).mismatches]) == many


def test_all_frames_of_small_recordings_are_asked_for_more() -> None:
    setting = setting_of(recorded(camera(), 3, columns=64, levels=FEW_LEVELS))
    trial: Any = SimpleNamespace(numbers=SimpleNamespace(whole=(setting.layout, setting.seen)))
    assert _of_all_frames(setting, trial).surest == SUREST
    assert setting.surest == 0
