"""Promise: what much the same model was simulated for serves this one; of another nothing does."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.replicates import _alike
from analysis.mismatch.state import Setting, State
from dsis.camera import Camera
from dsis.effects import registry
from mismatch_recordings import camera, recorded, setting_of

NULLS, FEW = 16, 4
R = registry()


@dataclass
class Steps:
    """Counts simulated recordings."""

    made: int = 0

    def __call__(self) -> None:
        self.made += 1


@dataclass
class Beside:
    """States of one recording."""

    setting: Setting = field(
        default_factory=lambda: setting_of(recorded(_lined(1.0), 3), nulls=NULLS)
    )

    def of(
        self, model: Camera, near: State | None = None, *, draft: bool = False
    ) -> tuple[State, int]:
        steps = Steps()
        state = State.of(self.setting, model, steps, near=near, draft=draft)
        return state, steps.made


def _lined(sigma_dn: float, percent: float = 0.6) -> Camera:
    return camera(R["row_noise"](sigma_dn=sigma_dn), R["prnu"](sigma_percent=percent))


@pytest.fixture(scope="module")
def beside() -> Beside:
    return Beside()


@pytest.fixture(scope="module")
def near(beside: Beside) -> State:
    return beside.of(_lined(1.0))[0]


def test_a_fourth_of_the_recordings_tells_what_all_tell(beside: Beside, near: State) -> None:
    """Departures are those of as many of its own: two such sets are 0.35 apart, in rms.

    Sizes move by 3 %: means of touched numbers by half a standard deviation and more.
    """
    model = _lined(1.03, 0.62)
    (whole, all_of_it), (some, few) = beside.of(model), beside.of(model, near)
    assert (all_of_it, few) == (NULLS, FEW)
    known = whole.null.known
    np.testing.assert_array_equal(known, some.null.known)
    moved = np.abs(whole.null.mean - near.null.mean)[known] / whole.null.sd[known]
    assert moved.max() > 0.5
    apart = np.abs(whole.departures - some.departures)
    assert apart.max() < 0.7  # of codes that little tips over
    assert np.sqrt((apart**2).mean()) < 0.05
    ratio = (some.null.sd / whole.null.sd)[known]
    assert ratio.min() > 0.8
    assert ratio.max() < 1.3


def test_what_is_not_simulated_is_not_kept_as_if_it_were(beside: Beside, near: State) -> None:
    """Later recordings of the model, asked for one by one, are its own."""
    model = _lined(1.03, 0.62)
    some, whole = beside.of(model, near)[0], beside.of(model)[0]
    own = some.simulations.of(some.camera, NULLS)
    np.testing.assert_array_equal(own, whole.simulations.of(whole.camera, NULLS))


@pytest.mark.parametrize(
    "model",
    [_lined(3.0), camera(R["row_noise"](sigma_dn=1.0)), camera()],
    ids=["far", "less", "bare"],
)
def test_another_model_is_simulated(beside: Beside, near: State, model: Camera) -> None:
    state, made = beside.of(model, near)
    assert made == NULLS
    np.testing.assert_array_equal(state.simulated, beside.of(model)[0].simulated)


def test_a_draft_is_too_few_for_a_null(beside: Beside) -> None:
    draft, made = beside.of(_lined(1.0), draft=True)
    assert made == NULLS // 2
    assert beside.of(_lined(1.01), draft)[1] == NULLS
    assert beside.of(_lined(1.01), draft, draft=True)[1] == FEW


@pytest.mark.long
def test_many_small_steps_are_a_large_one(beside: Beside, near: State) -> None:
    """What was moved is not moved again: noise of rows goes up by half, 6 % at a time."""
    state, counts = near, []
    for step in range(1, 9):
        state, made = beside.of(_lined(1.06**step), state)
        counts.append(made)
    assert FEW in counts
    assert NULLS in counts
    whole = beside.of(_lined(1.06**8))[0]
    ratio = (state.null.sd / whole.null.sd)[whole.null.known]
    assert ratio.min() > 0.6
    assert ratio.max() < 1.6
    apart = ((whole.null.mean - state.null.mean) / whole.null.sd)[whole.null.known]
    assert np.sqrt((apart**2).mean()) < 0.1


def test_the_same_model_asked_again_is_as_unsure(beside: Beside, near: State) -> None:
    one = beside.of(_lined(1.03, 0.62), near)[0]
    again, made = beside.of(one.camera, one)
    assert made == FEW
    np.testing.assert_allclose(again.null.sd, one.null.sd, rtol=1e-3)


def test_a_single_number_that_changes_is_not_hidden_by_its_group() -> None:
    """Forty numbers of one name, of which one scatters three times as far."""
    keys = tuple(Key("row_variance", "exposure", f"{i}", "MONO", "") for i in range(40))
    known = np.ones(40, bool)
    scatter, off = np.full(40, 0.01), np.ones(40)
    assert _alike(keys, known, scatter, off)
    scatter[7], off[7] = 4.0, 9.0
    assert not _alike(keys, known, scatter, off)
