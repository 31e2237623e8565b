"""Pixels that jump are looked for in the frames themselves: no number of the bank need call."""

import json
from functools import partial
from math import exp, isnan, log
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from analysis.mismatch.asked import FramesAsked
from analysis.mismatch.candidates import Proposal, measured
from analysis.mismatch.choice import Choice
from analysis.mismatch.diagnose import VOCABULARY, find_mismatch
from analysis.mismatch.explain import of_frames
from analysis.mismatch.finding import Mismatch, Where
from analysis.mismatch.jsonfile import finding_values
from analysis.mismatch.jumping import LEAST, NAME, Jumping
from analysis.mismatch.locate import FAMILY
from analysis.mismatch.name import Search
from analysis.mismatch.pixelframes import chosen
from analysis.mismatch.rank import SURE_GAIN
from dsis.effects import registry
from mismatch_recordings import camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

RTS: Any = registry()["rts"]
JUMPS = RTS(pixel_fraction=0.003, amplitude_dn=5.0)


@given(st.floats(5.2, 600.0))
def test_odds_are_a_chance_and_a_departure(gain: float) -> None:
    found = Jumping.of(gain, ["dark-0", "flat-0"]).mismatch
    assert found.statistic == NAME
    assert found.p_adjusted == pytest.approx(exp(-gain))
    assert found.where.exposures == ("dark-0", "flat-0")
    if gain < 600:
        assert 2 * norm.sf(found.z) >= 0.99 * exp(-gain)
    if gain < 500:
        assert 2 * norm.sf(found.z) == pytest.approx(exp(-gain), rel=1e-6)


def test_what_differs_stays_in_order_and_a_camera_with_jumps_has_no_others() -> None:
    own = Jumping.of(20.0, [])
    far, near = (Mismatch(name, z, 1e-9, Where(), "") for name, z in (("a", -9.0), ("b", 5.1)))
    assert own.beside((far, near), []) == (far, own.mismatch, near)
    assert own.beside((far, near), [JUMPS]) == (far, near)
    other = registry()["row_noise"](sigma_dn=1.0)
    assert own.beside((), [other]) == (own.mismatch,)


@pytest.mark.parametrize(
    ("gain", "jumping", "large", "could", "found"),
    [
        (LEAST + 0.1, 3.1, False, True, True),
        (LEAST - 0.1, 3.1, False, True, False),
        (LEAST + 0.1, 2.9, False, True, False),
        (LEAST + 0.1, 3.1, True, True, False),
        (LEAST + 0.1, 3.1, False, False, False),
    ],
)
def test_frames_show_jumps_where_they_are_likelier_than_all_else(
    gain: float, jumping: float, large: bool, could: bool, found: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("analysis.mismatch.asked.could_jump", lambda *_: could)
    layout: Any = SimpleNamespace(large=large, uniform=[SimpleNamespace(name="dark-0")])
    asked = FramesAsked(layout, lambda _: ())
    asked.__dict__["telegraph"] = SimpleNamespace(gain=gain, jumping=jumping)
    told = asked.located
    assert (told is not None) is found
    if told is not None:
        assert told.effect is None  # all frames only say that they do
        assert f"odds of {exp(gain):.1g} to 1" in told.mismatch.says
        assert told.mismatch.where.exposures == ("dark-0",)
    assert -log(FAMILY) == LEAST


@pytest.mark.parametrize(
    ("left", "named", "expected"),
    [
        ((), ("row_noise", "rts"), "rts"),
        ((), ("dual_gain", "rts"), "rts"),  # a second read-out path is no candidate of maps
        ((), ("dual_gain",), None),
        ((), ("row_noise",), None),
        ((NAME,), ("rts",), None),
    ],
)
def test_what_only_frames_show_is_explained_by_what_it_calls_for(
    left: tuple[str, ...], named: tuple[str, ...], expected: str | None
) -> None:
    mismatch = Jumping.of(20.0, []).mismatch
    final: Any = SimpleNamespace(mismatches=[SimpleNamespace(statistic=s, z=4.0) for s in left])
    own, after = of_frames(mismatch, named, final)
    assert own == expected
    assert after == 4.0 if left else isnan(after)


def test_a_pixel_that_one_exposure_shows_stands_for_itself() -> None:
    """One of 2000 jumps in the brighter exposure, whose noise is five times that of the dark."""
    rng = np.random.default_rng(3)
    blocks = [(sd * rng.normal(size=(2000, 6)), np.full(2000, sd**2), 0.01) for sd in (2.0, 10.0)]
    blocks = [(x - x.mean(1, keepdims=True), noise, time) for x, noise, time in blocks]
    blocks[0][0][77] = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # quiet in the dark
    blocks[1][0][77] = np.array([25.0, 25.0, 25.0, -25.0, -25.0, -25.0])
    which, weight = chosen(blocks, 4.0, 128)
    assert weight[which == 77] == [1.0]
    assert weight.sum() == pytest.approx(2000)
    assert which.size < 400


WEAK = {"pixel_fraction": 0.004, "amplitude_dn": 7.0, "switch_probability": 0.4}


@pytest.mark.parametrize("known", [pytest.param(True, marks=pytest.mark.long), False])
def test_few_weak_jumps_are_named_or_located(known: bool) -> None:
    recording = recorded(camera(RTS(**WEAK)), 0, levels=(250.0, 900.0))
    words = VOCABULARY if known else VOCABULARY - {"rts"}
    found = find_mismatch(camera(), recording, seed=1, vocabulary=words)
    assert [one.effect for one in found.omitted_physics] == (["rts"] if known else [])
    stored = json.loads(json.dumps(finding_values(found)))
    mismatch = next(m for m in stored["mismatches"] if m["statistic"] == NAME)
    assert mismatch["z"] > 3
    assert mismatch["explained_by"] == ("rts" if known else None)
    assert (NAME in {m.statistic for m in found.unexplained}) is not known
    if known:
        (own,) = found.omitted_physics
        assert NAME in own.because
        for name, value in WEAK.items():
            told = own.parameters[name]
            assert isinstance(told.value, float)
            assert abs(told.value - value) < 2 * told.standard_error
        assert found.unexplained == ()


@pytest.mark.parametrize("least", [SURE_GAIN, 90.0])
def test_the_odds_that_frames_must_have_forget_what_was_dropped(least: float) -> None:
    """A search that just dropped an effect of 90 nats takes in less for nothing else."""
    base: Any = SimpleNamespace(mismatches=())
    search = Search(cast("Any", None), camera(), base, VOCABULARY, lambda: None, least=least)
    assert search.least_odds == SURE_GAIN
    assert search._least(base, "rts") == least


@pytest.mark.parametrize("there", [None, "equal", "exponential"])
def test_sizes_of_jumps_are_those_of_the_frames_that_are_fitted(there: str | None) -> None:
    """Heights go with the sizes that were found beside them."""
    values = {"pixel_fraction": 0.002, "amplitude_dn": 9.0, "switch_probability": 0.2}
    seen = (
        None if there is None else SimpleNamespace(values={**values, "heights": there}, errors={})
    )
    search: Any = SimpleNamespace(measuring=SimpleNamespace(telegraph=seen), lines=None)
    state: Any = SimpleNamespace(setting=SimpleNamespace(jumping=Jumping.of(20.0, [])))
    told = Choice._jumps(search, state, JUMPS)
    assert (told is None) is (there is None)
    if told is not None:
        other = RTS(**values, heights="equal" if there == "exponential" else "exponential")
        own = measured(Proposal(other, ("pixel_fraction",)), *told)
        assert own.effect == RTS(**values, heights=there)
    search._jump_rather = lambda _: False
    none: Any = SimpleNamespace(setting=SimpleNamespace(jumping=None))
    assert Choice._jumps(search, none, JUMPS) is None
    assert Choice._jumps(search, state, registry()["row_noise"](sigma_dn=1.0)) is None
    # Of what may be many nothing is located; frames may tell that they jump all the same.
    layout: Any = SimpleNamespace(large=False)
    search.lines = FramesAsked(layout, lambda _: ())
    search._jump_rather = partial(Choice._jump_rather, search)
    for odds, few, off, own in (
        (SURE_GAIN + 0.1, True, (), ()),
        (SURE_GAIN - 0.1, True, (), ()),
        (SURE_GAIN + 0.1, False, (), ()),
        (SURE_GAIN + 0.1, True, ("frame_correlation",), ()),
        (SURE_GAIN + 0.1, True, (), (JUMPS,)),
    ):
        search.lines.__dict__["telegraph"] = SimpleNamespace(jumping=odds, few=few)
        beside: Any = SimpleNamespace(
            setting=none.setting,
            camera=SimpleNamespace(effect=own),
            mismatches=[SimpleNamespace(statistic=name) for name in off],
        )
        sure = odds > SURE_GAIN and few and not off and not own
        assert Choice._jumps(search, beside, JUMPS) == (told if sure else None)
    search.lines.__dict__["telegraph"] = None
    assert not search.lines.jump_rather(0.0)
