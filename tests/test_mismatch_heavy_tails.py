"""Numbers with heavy tails depart no farther than they are rare; simulations say what scatters."""

from typing import cast

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch import locate
from analysis.mismatch.bank.key import Key
from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.heavytails import degrees, equivalent
from analysis.mismatch.null import _by_name, null_of
from analysis.mismatch.replicates import Known, Replicates, more
from analysis.mismatch.state import FAR, SUREST, State
from analysis.mismatch.vector import Vector
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded, setting_of

COMMON = 223.0
DOF = 15


def _keys(statistics: int, each: int) -> list[Key]:
    return [Key(f"s{i}", "exposure", f"flat-{j}") for i in range(statistics) for j in range(each)]


def test_normal_numbers_keep_a_normal_law() -> None:
    """All but one in 200: kurtosis itself has a tail."""
    drawn = np.random.default_rng(1).normal(size=(64, 20_000))
    assert np.isfinite(degrees(_keys(5000, 4), drawn)).mean() < 6e-3


def test_degrees_are_those_drawn_from() -> None:
    """Numbers of a statistic in common, by their kurtosis, of which few samples show less."""
    rng = np.random.default_rng(2)
    by_count = [degrees(_keys(1, 800), rng.standard_t(9, size=(n, 800))) for n in (64, 4096)]
    assert all(np.isfinite(found).all() for found in by_count)
    few, many = (float(np.median(found)) for found in by_count)
    assert 9 < few < 13
    assert many == pytest.approx(9, abs=0.7)


def test_numbers_that_do_not_scatter_have_a_normal_law() -> None:
    assert np.isinf(degrees(_keys(1, 3), np.ones((16, 3)))).all()


@given(st.lists(st.floats(-50, 50), min_size=1, max_size=8), st.floats(4.05, 60))
def test_equivalents_are_as_rare(departures: list[float], nu: float) -> None:
    z = np.array(departures)
    found = equivalent(z, np.full(z.size, nu), COMMON)
    rare = scipy.stats.t.sf(np.abs(z) * np.sqrt(nu / (nu - 2)), nu)
    np.testing.assert_allclose(scipy.stats.t.sf(np.abs(found), COMMON), rare, rtol=1e-6)
    assert (found * z >= 0).all()
    np.testing.assert_array_equal(equivalent(z, np.full(z.size, np.inf), COMMON), z)


def test_few_numbers_whose_spread_denies_the_closed_form_have_their_own() -> None:
    """Rows that bands move lean three times as far as pixels let them, columns do not."""
    rng = np.random.default_rng(3)
    keys = [Key("fixed_smooth_tilt", "offset", "", "MONO", axis) for axis in ("rows", "columns")]
    variances = []
    for _ in range(400):
        own = np.array([9.0, 1.0]) * rng.chisquare(DOF, 2) / DOF
        scale, worth, _ = _by_name(keys, own, np.ones(2, bool), DOF)
        variances.append((worth * scale + DOF * own) / (worth + DOF))
    # Nine of ten are told from one another; the rest shares what both have.
    assert np.median(variances, 0) == pytest.approx([9.0, 1.0], rel=0.2)


def test_one_number_that_spreads_as_the_closed_form_says_leans_on_it() -> None:
    own = np.random.default_rng(5).chisquare(DOF, 300) / DOF
    key = [Key("variance_persistence", "all", "", "MONO")]
    told = [_by_name(key, own[i : i + 1], np.ones(1, bool), DOF)[1][0] for i in range(own.size)]
    assert np.mean(np.array(told) > 0) > 0.98
    wide = _by_name(key, np.array([25.0]), np.ones(1, bool), DOF)
    assert (wide[0][0], wide[1][0]) == (25.0, 0.0)
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
def of_bands() -> tuple[Camera, State]:
    model = camera(BANDS)
    setting = setting_of(recorded(model, 1, columns=64, levels=FEW_LEVELS), nulls=192)
    return model, State.of(setting, model, lambda: None)


def test_a_model_s_own_recordings_do_not_differ(of_bands: tuple[Camera, State]) -> None:
    """With bands of rows: of the recordings of 16 nulls, by 16 and then by 64, 2 % at most.

    6.7 % before spreads that deny closed forms were taken as they are.
    """
    _, state = of_bands
    made, layout = state.replicates.vectors, state.setting.layout
    asked = alarms = 0
    for start in range(0, len(made), 16):
        around = [made[(start + i) % len(made)] for i in range(SUREST)]
        few, sure = null_of(layout, around[:16], made[0]), null_of(layout, around, made[0])
        for i in range(SUREST, len(made)):
            other, asked = made[(start + i) % len(made)], asked + 1
            z, chances = locate.tested(layout, few, other)
            far = np.abs(z[chances < locate.FAMILY])
            if far.size and far.max() < FAR:
                z, chances = locate.tested(layout, sure, other)
            alarms += int((chances < locate.FAMILY).any())
    assert asked > 1000
    assert alarms <= 0.02 * asked
