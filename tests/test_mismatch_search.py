"""The search: what ties is not claimed, nor what is worse; few simulations mislead."""

from collections.abc import Collection
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import choice, judge
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.judge import Judge
from analysis.mismatch.memory import _near
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.rank import Ranked, alike
from analysis.mismatch.recalibrate import _moved
from analysis.mismatch.resolved import explains
from analysis.mismatch.ties import ties
from dsis.effects import registry
from mismatch_recordings import camera

NUMBERS = 12
STATE: Any = SimpleNamespace(
    null=SimpleNamespace(known=np.ones(NUMBERS, bool), mean=np.zeros(NUMBERS), sd=np.ones(NUMBERS)),
    vector=SimpleNamespace(keys=(), values=()),
    predictor=lambda _: None,
    mismatches=(),
    camera=SimpleNamespace(effect=()),
    calibrated=SimpleNamespace(fit=SimpleNamespace(signal_dn={})),
    setting=SimpleNamespace(
        layout=SimpleNamespace(rows=64, columns=96, uniform=(), channels=()),
        seen=SimpleNamespace(levels={}, middles={}, lines={}),
        large=True,  # no simulations say how much a gain is worth
    ),
)


def _ranked(kind: str, gain: float, *changed: int) -> Any:
    mean = np.zeros(NUMBERS)
    mean[list(changed)] = 3.0
    return SimpleNamespace(
        kind=kind,
        name=kind,
        gain=gain,
        polished=SimpleNamespace(mean=mean, effects=(None,)),
        told_from="",
        mean=mean,
        proposal=SimpleNamespace(effect=None, best_of=1),
    )


def _proposal(kind: str, **values: float) -> Proposal:
    return Proposal(registry()[kind](**values), tuple(values))


def _search(**values: Any) -> Search:
    vocabulary = frozenset(
        {"crosstalk", "spatial_filtering", "readout_memory", "row_noise", "adc_dnl"}
    )
    bare: dict[str, Any] = {
        "setting": SimpleNamespace(nulls=16, drafts=16, layout=None, large=False, given=0),
        "camera": SimpleNamespace(effect=(), noise=None),
        "base": None,
        "vocabulary": vocabulary,
        "step": lambda: None,
    }
    return Search(**{**bare, **values})


def _offering(
    monkeypatch: pytest.MonkeyPatch, offered: list[Any], denied: Collection[str] = ()
) -> None:
    """Let a search be offered these effects, some of them denied by a statistic."""

    def ranked(*of: Any) -> list[Any]:
        state, kinds, apart = of[0], of[1], of[5]
        return [
            one
            for one in offered
            if one.kind in kinds and not any(alike(state, one.polished.mean, a) for a in apart)
        ]

    def refuted(*of: Any) -> Denial | None:
        return Denial(0.0, "it shows 0% of it") if of[2] in denied else None

    monkeypatch.setattr(choice, "ranked", ranked)
    monkeypatch.setattr(choice, "refuted", refuted)
    monkeypatch.setattr(choice, "replicates_for", lambda *_: 2)
    monkeypatch.setattr(choice, "both_needed", lambda *_: None)  # which fits them together


def test_predictions_of_the_same_numbers_are_alike() -> None:
    one, same, other = (_ranked("", 1, *which).polished.mean for which in ((0, 1), (1, 0), (2, 3)))
    assert alike(STATE, one, 0.3 * same)
    assert not alike(STATE, one, other)
    assert not alike(STATE, one, -same)


def test_nothing_worse_is_claimed_where_two_tie(monkeypatch: pytest.MonkeyPatch) -> None:
    """Crosstalk and filtering tie; memory explains the same numbers worse; row noise others."""
    offered = [
        _ranked("spatial_filtering", 15.0, 0, 1, 2),
        _ranked("adc_dnl", 14.0, 5),
        _ranked("crosstalk", 13.5, 0, 1, 2),
        _ranked("readout_memory", 7.2, 0, 1, 2),
        _ranked("row_noise", 5.0, 8, 9),
    ]

    _offering(monkeypatch, offered)
    search = _search()
    assert [one.kind for one in search._decided(STATE)] == ["adc_dnl", "row_noise"]
    assert [{one.kind for one in pair} for pair in search.ties] == [
        {"spatial_filtering", "crosstalk"}
    ]
    # What is named besides may decide: in the next round all are tried again.
    offered[2] = _ranked("crosstalk", 9.0, 0, 1, 2)
    assert search._decided(STATE)[0].kind == "spatial_filtering"
    assert search.ties == []


def test_lines_of_different_frequencies_are_no_rivals() -> None:
    """The largest peak is one number: either line explains it, and a sensor may have both."""

    def line(kind: str, gain: float, fx: float) -> Any:
        ranked = _ranked(kind, gain, 0, 1)
        ranked.proposal.effect = registry()[kind](amplitude_dn=1.0, frequency=(fx, 0.25))
        return ranked

    best = line("periodic_noise", 15.0, 0.25)
    assert ties(STATE, best, line("bistable_pattern", 14.5, 0.25))
    assert not ties(STATE, best, line("bistable_pattern", 14.5, 0.33))
    # A real wave has the frequency -f as well, and a peak is known to a bin and a half.
    best.proposal.effect = registry()["periodic_noise"](amplitude_dn=1, frequency=(-0.255, -0.25))
    assert ties(STATE, best, line("bistable_pattern", 14.5, 0.25))


def test_a_tie_lasts_though_its_rivals_kind_is_named_for_something_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Amplifiers of the two halves say nothing of those of even and odd rows."""
    offered = [_ranked("crosstalk", 9.0, 0, 1), _ranked("spatial_filtering", 8.5, 0, 1)]

    _offering(monkeypatch, offered)
    search = _search()
    assert search._decided(STATE) == []
    search.named.append(Named("spatial_filtering", None, {}, 5.0, ()))
    assert search._decided(STATE) == []
    assert {one.kind for one in search.ties[0]} == {"crosstalk", "spatial_filtering"}
    # A rival that was refused is none.
    search.named.clear()
    search.refused["spatial_filtering"] = "denied"
    assert [one.kind for one in search._decided(STATE)] == ["crosstalk"]


def test_a_rival_that_gains_less_than_is_asked_ties_as_well() -> None:
    best = _ranked("row_noise", 2.1, 0, 1)
    assert ties(STATE, best, _ranked("pink_noise", 1.1, 0, 1))
    assert not ties(STATE, best, _ranked("pink_noise", -1.0, 0, 1))


def test_what_a_statistic_denies_waits_until_more_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    offered = [_ranked("readout_memory", 9.0, 0), _ranked("crosstalk", 7.0, 1, 2)]
    denied = {"readout_memory"}

    _offering(monkeypatch, offered, denied)
    search = _search()
    assert [one.kind for one in search._decided(STATE)] == ["crosstalk"]
    assert search.doubted == {"readout_memory": "it shows 0% of it"}
    assert not search.refused
    denied.clear()
    assert search._decided(STATE)[0].kind == "readout_memory"
    assert search.doubted == {}


def test_an_effect_is_dropped_only_where_many_simulations_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two recordings may hold next to nothing of one number a frame; sixteen do."""
    effect = Named("row_noise", _proposal("row_noise", sigma_dn=1.0), {}, 10.0, ())

    def predictor(count: int = 2) -> Any:
        worth = 0.0 if count < said["from"] else 50.0
        return SimpleNamespace(
            replicates=count, ready=list, mean=lambda _: None, worth=lambda _: worth
        )

    state: Any = SimpleNamespace(predictor=predictor)
    monkeypatch.setattr(judge, "resolved", lambda *_: 1.0)
    monkeypatch.setattr(judge, "locates", lambda *_: True)
    asked = Judge(state, lambda _: None, 16)  # type: ignore[arg-type, return-value] # no camera
    said = {"from": 16}
    assert asked.needless([effect]) is None
    said = {"from": 17}
    assert asked.needless([effect]) == (effect, judge.NEEDLESS)


@pytest.mark.parametrize(
    ("worths", "hides", "dropped", "why"),
    [
        ((124.0, 8.8), "carry_over", "readout_memory", "it takes the place of what adc_memory"),
        ((5.0, 8.8), "carry_over", "adc_memory", "it shows 0%"),  # beside the other it is little
        ((124.0, 8.8), "", "adc_memory", "it shows 0%"),  # whatever else is there
    ],
)
def test_what_takes_the_place_of_a_stronger_effect_goes_before_it(
    monkeypatch: pytest.MonkeyPatch,
    worths: tuple[float, float],
    hides: str,
    dropped: str,
    why: str,
) -> None:
    memory = _proposal("adc_memory", step_dn=0.4, period_codes=64, at_code=3.0)
    strong = Named("adc_memory", memory, {}, 124.0, ())
    weak = Named(
        "readout_memory", _proposal("readout_memory", fraction=0.01, lag_pixels=8), {}, 8.8, ()
    )
    worth = {"adc_memory": worths[0], "readout_memory": worths[1]}

    def denial(_state: Any, _asked: Any, kind: str, _without: str, another: str = "") -> Any:
        wrong = kind == "adc_memory" and not (hides and another == "readout_memory")
        return SimpleNamespace(share=0.0, why="it shows 0%") if wrong else None

    predictor = SimpleNamespace(replicates=2, ready=list, mean=lambda one: one, worth=worth.get)
    state: Any = SimpleNamespace(predictor=lambda *_: predictor)
    monkeypatch.setattr(judge, "contradicted", denial)
    monkeypatch.setattr(judge, "of_another", lambda *_: None)
    found = Judge(state, lambda named: named.kind, 16).denied([strong, weak])  # type: ignore[arg-type, return-value] # no camera
    assert found is not None
    assert found[0].kind == dropped
    assert found[1].startswith(why)


def test_an_effect_that_explains_nothing_located_is_asked_for_and_lines_are_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tails = Named(
        "heavy_tailed_read_noise", _proposal("heavy_tailed_read_noise", tail_df=60.0), {}, 3.0, ()
    )
    frequency = {"amplitude_dn": 0.2, "frequency": (0.1, 0.2)}
    line = Named("periodic_noise", _proposal("periodic_noise", **frequency), {}, 3.0, ())
    predictor = SimpleNamespace(replicates=16, ready=list, mean=lambda _: None, worth=lambda _: 5.0)
    state: Any = SimpleNamespace(predictor=lambda *_: predictor)
    monkeypatch.setattr(judge, "resolved", lambda *_: 1.0)
    monkeypatch.setattr(judge, "locates", lambda *_: False)
    asked = Judge(state, lambda _: None, 16)  # type: ignore[arg-type, return-value] # no camera
    assert asked.needless([line]) is None
    assert asked.needless([line, tails]) == (tails, judge.NOTHING)


@pytest.mark.parametrize(
    ("with_it", "without", "first", "explained"),
    [
        ({}, {"kurtosis": 6.0}, {}, True),
        ({"frame_variance": 14.1}, {"frame_variance": 15.0}, {"frame_variance": 100.0}, False),
        ({"frame_variance": 7.0}, {"frame_variance": 15.0}, {}, True),
        ({}, {}, {"kurtosis": 4.2}, True),  # some of the frames do not show it for certain
        ({}, {}, {"level": 4.2}, False),  # which calls for other effects
    ],
)
def test_an_effect_explains_half_of_something_that_differs_without_it(
    with_it: dict[str, float],
    without: dict[str, float],
    first: dict[str, float],
    explained: bool,
) -> None:
    def of(found: dict[str, float]) -> Any:
        mismatches = [SimpleNamespace(statistic=s, z=z) for s, z in found.items()]
        return SimpleNamespace(mismatches=mismatches)

    assert explains(of(with_it), of(without), of(first), {"kurtosis"}) == explained


def test_a_switch_may_part_the_colours_of_one_exposure() -> None:
    """Blue at 2598 DN is below, red at 2642 DN above: 1.7 % apart, and another gain."""

    def variance(signal: float, switch: float) -> float:
        return 104 + 2.6 * signal if signal < switch else 126 + 5.34 * signal

    signals = {
        ("flat-0", "R"): 953.0, ("flat-0", "Gr"): 1588.0, ("flat-0", "Gb"): 1589.0,
        ("flat-0", "B"): 934.0, ("flat-1", "R"): 2642.0, ("flat-1", "Gr"): 4400.0,
        ("flat-1", "Gb"): 4401.0, ("flat-1", "B"): 2598.0,
    }  # fmt: skip
    levels: Any = {
        place: SimpleNamespace(variance_dn2=variance(s, 2630.0), dof=18_000)
        for place, s in signals.items()
    }

    def fitted(at: tuple[float, ...]) -> Any:
        expected = {place: variance(s, at[0]) for place, s in signals.items()}
        return SimpleNamespace(signal_dn=signals, expected_dn2=expected)

    (switch,) = _moved(levels, frozenset(), (2649.0,), fitted((2649.0,)), fitted)
    assert 2598 < switch < 2642
    assert _moved(levels, frozenset(), (2620.0,), fitted((2620.0,)), fitted) == (2620.0,)


def test_what_is_named_or_refused_is_not_tried_again() -> None:
    search = _search(named=[Named("row_noise", None, {}, 3.0, ())])
    assert "row_noise" not in search._left()
    assert "crosstalk" in search._left()
    assert replace(search, refused={"crosstalk": "denied"})._left() == frozenset(
        {"spatial_filtering", "readout_memory", "adc_dnl"}
    )


def test_a_denied_decay_waits_as_others_do_and_leaves_other_edges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def decay(edge: str, gain: float) -> Any:
        effect = registry()["line_settling"](gain_percent=1.0, length_pixels=5.0, edge=edge)
        proposal = Proposal(effect, ("gain_percent",))
        polished = SimpleNamespace(mean=np.zeros(NUMBERS), effects=(effect,))
        return Ranked(gain, "line_settling", proposal, polished)

    left, top, other = decay("left", 50.0), decay("top", 20.0), _ranked("row_noise", 30.0, 0)
    other.proposal.effect = registry()["row_noise"](sigma_dn=1.0)
    denied = {id(left.polished.mean), id(other.polished.mean)}

    def ranked(*of: Any) -> list[Any]:
        kinds, possible = of[1], of[6]
        offered = [one for one in (left, other, top) if one.kind in kinds]
        return [one for one in offered if possible(one.proposal.effect)]

    monkeypatch.setattr(choice, "ranked", ranked)
    monkeypatch.setattr(
        choice, "refuted", lambda *of: Denial(0.0, "no") if id(of[3].mean) in denied else None
    )
    monkeypatch.setattr(choice, "replicates_for", lambda *_: 2)
    layout = SimpleNamespace(channels=("MONO",))
    search = _search(
        setting=SimpleNamespace(nulls=16, drafts=16, layout=layout, large=False, given=0),
        vocabulary=frozenset({"line_settling", "row_noise"}),
    )
    assert [one.name for one in search._decided(STATE)] == ["line_settling (top)"]
    assert search.doubted.keys() == {"line_settling (left)", "row_noise"}


def test_an_optional_number_is_near_its_like_only() -> None:
    kind, own = registry()["line_settling"], {"gain_percent": 1.0, "length_pixels": 5.0}
    plain = camera()
    assert _near(kind(**own), kind(**own), plain)
    assert not _near(kind(**own), kind(**own, gain_length_pixels=3.0), plain)
    assert not _near(kind(**own, gain_length_pixels=3.0), kind(**own), plain)
