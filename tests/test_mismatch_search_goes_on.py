"""What a dropped effect had hidden is looked for once more, and nothing known is lost thereby."""

from types import SimpleNamespace as Stub
from typing import Any

import pytest

import analysis.mismatch.fitted as fitted_module
import analysis.mismatch.name as search_module
from analysis.mismatch.confirmed import proven
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.state import State
from mismatch_findings import decay

SOMETHING = Stub(statistic="something", p_adjusted=0.0)
OPEN = Stub(mismatches=[SOMETHING])


def _named(kind: str, **errors: float) -> Named:
    return Named(kind, None, errors, 1.0, ())


class Scripted(Search):
    """A search that takes what a script says, and prunes `wrong` for a given reason."""

    def _best(self, _state: Any) -> Any:
        self.seen.append(self._left())
        self.doubted = {}
        for kind in self.script:
            if kind in self._left():
                if kind in self.doubts and any(n.kind == "wrong" for n in self.named):
                    self.doubted = {kind: "denied beside the wrong one"}
                    continue
                return _named(kind), None
        return None

    def _take(self, named: Named) -> None:
        self.named.append(named)

    def _polished(self, state: Any) -> Any:
        return state

    def _pruned(self, state: Any) -> Any:
        for one in [n for n in self.named if n.kind == "wrong" and not self.pruned]:
            self.named.remove(one)
            self.refused["wrong"] = self.why
            self.pruned = True
        return state


def _search(monkeypatch: pytest.MonkeyPatch, why: str, *script: str, **more: Any) -> Scripted:
    for module in (search_module, fitted_module):
        monkeypatch.setattr(module, "State", Stub(of=lambda *_, **__: OPEN))
    setting: Any = Stub(nulls=16, drafts=16, layout=None, large=False, given=0)
    base: Any = OPEN
    camera: Any = Stub(effect=())
    made = Scripted(setting, camera, base, frozenset(script), step=lambda: None)
    made.script, made.seen, made.pruned = script, [], False  # type: ignore[attr-defined] # its own
    made.why, made.doubts = why, more.get("doubts", ())  # type: ignore[attr-defined] # its own
    return made


def test_what_was_doubted_beside_a_wrong_effect_is_tried_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = _search(monkeypatch, "denied", "wrong", "right", doubts=("right",))
    search.run()
    assert [n.kind for n in search.named] == ["right"]
    assert search.refused == {"wrong": "denied"}


def test_an_effect_that_explained_too_little_may_come_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = _search(monkeypatch, "it would explain 60% of what it changes", "wrong", "other")
    search.run()
    assert sorted(n.kind for n in search.named) == ["other", "wrong"]
    assert search.refused == {}


def test_an_effect_that_was_denied_does_not_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    search = _search(monkeypatch, "the recording shows 0% of it", "wrong", "other")
    search.run()
    assert [n.kind for n in search.named] == ["other"]
    assert list(search.refused) == ["wrong"]


class Proving:
    """A search of which one effect is weak; what it finds then renews the other's numbers."""

    def __init__(self, after: list[Named]) -> None:
        self.named, self.after = [_named("kept", x=1.0), _named("weak")], after
        self.setting, self.own, self.least = Stub(jobs=1), [], 2.0
        self.calls: list[str] = []
        self.bars: list[float] = []
        self.given_back = False

    def fitted_without(self, *_: Any) -> None:
        return None

    def denied(self, _state: Any) -> None:
        return None

    def drop(self, _state: Any, named: Named, _why: str) -> Any:
        self.named.remove(named)
        return OPEN

    def further(self, state: Any) -> Any:
        self.bars.append(self.least)
        self.named = self.after
        self.calls.append("further")
        return state

    def fitted_anew(self, state: Any) -> Any:
        if self.given_back:
            self.named = [_named("kept", x=2.0)]
        return state

    def settle(self, state: Any) -> Any:
        self.calls.append("settle")
        return state


@pytest.mark.parametrize(
    ("after", "calls"),
    [
        ([_named("kept", x=1.0)], ["further"]),
        ([_named("kept", x=99.0)], ["further", "settle"]),
        ([_named("kept", x=1.0), _named("found")], ["further", "settle"]),
    ],
)
def test_numbers_are_settled_where_the_search_has_touched_them(
    after: list[Named], calls: list[str]
) -> None:
    search: Any = Proving(after)
    gains = Stub(
        gains=lambda _state, without: {
            name: Stub(
                nats=0.0, certain=name != "weak", gain=Stub(nats_per_frame=1.0, ci95=(-2.0, 4.0))
            )
            for name in without
        }
    )
    trial: Any = gains
    proven(search, OPEN, trial, judged=False)
    assert search.calls == calls


def test_numbers_are_settled_where_what_was_dropped_gave_them_its_part() -> None:
    search: Any = Proving([_named("kept", x=1.0)])
    search.given_back = True
    trial: Any = Stub(
        gains=lambda _state, without: {
            name: Stub(
                nats=0.0, certain=name != "weak", gain=Stub(nats_per_frame=1.0, ci95=(-2.0, 4.0))
            )
            for name in without
        }
    )
    proven(search, OPEN, trial, judged=False)
    assert search.calls == ["further", "settle"]


def test_what_is_found_only_without_an_effect_must_gain_more_than_that() -> None:
    """It stands in its place: what explained the same frames better is not believed either."""
    search: Any = Proving([_named("kept", x=1.0)])
    search.named[1] = Named("weak", None, {}, 64.0, ())
    trial: Any = Stub(
        gains=lambda _state, without: {
            name: Stub(
                nats=0.0,
                certain=name != "weak",
                gain=Stub(nats_per_frame=-14.0, ci95=(-20.0, -8.0)),
            )
            for name in without
        }
    )
    proven(search, OPEN, trial, judged=False)
    assert search.bars == [64.0]
    assert search.least == 2.0


def test_an_effect_within_its_errors_is_dropped_and_what_it_hid_is_looked_for() -> None:
    search: Any = Proving([_named("kept", x=1.0), _named("found")])
    search.named = [decay(0.3, 0.2), _named("kept", x=1.0)]
    trial: Any = Stub(
        gains=lambda _state, without: {
            name: Stub(nats=0.0, certain=True, gain=Stub(nats_per_frame=1.0, ci95=(-2.0, 4.0)))
            for name in without
        }
    )
    _, found = proven(search, OPEN, trial, judged=False)
    assert sorted(found) == ["found", "kept"]
    assert search.calls == ["further", "settle"]


def test_what_gained_little_is_asked_first_and_the_rest_only_where_all_of_it_stays() -> None:
    asked: list[list[str]] = []

    def gains(_state: Any, without: Any) -> dict[str, Any]:
        asked.append(sorted(without))
        return {
            name: Stub(
                nats=0.0, certain=name != "weak", gain=Stub(nats_per_frame=1.0, ci95=(-2.0, 4.0))
            )
            for name in without
        }

    strong = Named("strong", None, {}, 500.0, ())
    search: Any = Proving([strong])
    search.named = [strong, *search.named]
    trial: Any = Stub(gains=gains)
    _, found = proven(search, OPEN, trial, judged=True)
    assert asked == [["kept", "weak"], ["kept"], ["strong"]]
    assert sorted(found) == ["kept", "strong"]


def test_with_more_frames_all_is_judged_again_and_a_period_chosen_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = _search(monkeypatch, "denied", "wrong", "adc_memory")
    monkeypatch.setattr(search, "without", lambda *_: None)
    search.named = [_named("wrong"), _named("adc_memory")]
    search.refused = {"other": "too few frames said so"}
    search.resumed(Stub(camera=None, mismatches=[SOMETHING]))  # type: ignore[arg-type] # a stub
    assert [n.kind for n in search.named] == ["adc_memory"]
    assert search.seen[0] == frozenset({"adc_memory"})  # type: ignore[attr-defined] # its own
    assert search.refused == {"wrong": "denied"}


def test_with_more_frames_what_is_named_is_pruned_though_nothing_is_added(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = _search(monkeypatch, "denied", "wrong")
    search.named = [_named("wrong")]
    search.resumed(Stub(camera=None, mismatches=[]))  # type: ignore[arg-type] # a stub
    assert search.named == []


class Refitted(Scripted):
    """A search whose joint fits explain what `feigned` seemed to, and are counted."""

    def _best(self, state: Any) -> Any:
        for kind, gain in (("strong", 300.0), ("weak", 5.0), ("weaker", 4.0)):
            feigned = kind == "weak" and state is FITTED
            if kind in self._left() and not feigned:
                return Named(kind, None, {}, gain, ()), None
        return None

    def _polished(self, _state: Any) -> Any:
        self.rough = False
        self.fits += 1
        return FITTED


FITTED = Stub(mismatches=[SOMETHING])


def test_all_is_fitted_again_once_before_what_is_weak_is_taken_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search_module, "State", Stub(of=lambda *_, **__: FITTED))
    setting: Any = Stub(nulls=16, drafts=16, layout=None, large=False, given=0)
    words = frozenset({"strong", "weak", "weaker"})
    nothing: Any = OPEN
    camera: Any = Stub(effect=())
    search = Refitted(setting, camera, nothing, words, step=lambda: None)
    search.fits = 0  # type: ignore[attr-defined] # its own
    search._sought(nothing)
    assert [n.kind for n in search.named] == ["strong", "weaker"]
    assert search.fits == 1  # type: ignore[attr-defined] # its own


class Emerging(Scripted):
    """A search of which a fit of all together, or all frames, show what no search had seen."""

    def _polished(self, state: Any) -> Any:
        return self.then if self.then is not None and len(self.named) == 1 else state


OTHER = Stub(statistic="other", p_adjusted=0.0)


@pytest.mark.parametrize("where", ["fit", "frames", "nowhere"])
def test_what_differs_only_beside_what_is_named_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    """It differs once all is fitted together, or in all frames, of which the search sees some."""
    now = Stub(mismatches=[OTHER]) if where == "fit" else None
    search = _search(monkeypatch, "", "first", "second")
    search.__class__ = Emerging
    search.then = now  # type: ignore[attr-defined] # its own
    found: list[Any] = []

    def best(state: Any) -> Any:
        kind = "second" if search.named else "first"
        open_to = [m.statistic for m in state.mismatches]
        fits = open_to == (["something"] if kind == "first" else ["other"])
        return (_named(kind), None) if fits and kind in search._left() else None

    monkeypatch.setattr(search, "_best", best)
    if where == "frames":
        whole: Any = Stub(mismatches=[OTHER])
        monkeypatch.setattr(search, "_asked_of_all", lambda state: found.append(state) or whole)
    search.run()
    expected = ["first"] if where == "nowhere" else ["first", "second"]
    assert [n.kind for n in search.named] == expected
    assert bool(found) == (where == "frames")


def test_all_frames_are_asked_once_something_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    search = _search(monkeypatch, "", "first")
    state: Any = State.__new__(State)
    state.__dict__.update(mismatches=(), calibrated=Stub(model=Stub(camera=None)))
    assert search._asked_of_all(state) is state  # nothing is named
    search.named = [_named("first")]
    assert search._asked_of_all(state) is state  # of a large recording there are no others
    search.whole = Stub()  # type: ignore[assignment] # a stub
    monkeypatch.setattr(
        search_module, "replace", lambda own, **new: Stub(**{**own.__dict__, **new})
    )
    assert search._asked_of_all(state).mismatches == [SOMETHING]


def test_where_nothing_is_left_named_all_frames_still_show_what_they_did(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of fewer frames a weak line may not differ for certain: it would never be looked for."""
    search = _search(monkeypatch, "", "wrong", "other")
    search.whole, search.base = Stub(), Stub(mismatches=[SOMETHING, OTHER])  # type: ignore[assignment] # stubs
    some = Stub(mismatches=[], camera=Stub(effect=()))
    for module in (search_module, fitted_module):
        monkeypatch.setattr(module, "State", Stub(of=lambda *_, **__: some))
    monkeypatch.setattr(
        search_module, "replace", lambda own, **new: Stub(**{**own.__dict__, **new})
    )
    monkeypatch.setattr(search, "without", lambda *_: None)
    search.named = [wrong := _named("wrong")]
    bare = search.drop(OPEN, wrong, "denied")
    assert bare.mismatches == [SOMETHING, OTHER]
