"""A large recording is searched stage by stage; nothing of few frames is left where more tell."""

from types import SimpleNamespace as Stub
from typing import Any

import pytest

import analysis.mismatch.diagnose as module
from analysis.mismatch.diagnose import _searched, _switched
from analysis.mismatch.named import Named

WHOLE, FEW, MORE = (Stub(exposures=(), name=name) for name in ("whole", "few", "more"))


class Staged:
    """A search that names what it is told to at each stage."""

    def __init__(self, *names: list[str]) -> None:
        self.script, self.least, self.named = list(names), 0.0, []
        self.setting, self.base = Setting(WHOLE), Stub(camera="given", mismatches=["something"])
        self.own: list[Any] = []
        self.camera, self.step, self.asked = "given", None, []
        self.how: list[str] = []

    def begun(self, state: Any) -> Any:
        return self._looked("begun", state)

    def resumed(self, state: Any) -> Any:
        return self._looked("resumed", state)

    def lit(self, state: Any) -> Any:
        return state

    def _looked(self, how: str, state: Any) -> Any:
        self.how.append(how)
        self.asked.append((self.setting.layout.name, state.camera, self.least))
        self.named = self.script.pop(0)
        return Stub(camera=f"found on {self.setting.layout.name}")


class Setting:
    """A setting of which only the layout counts."""

    drafts, jobs = 4, 1

    def __init__(self, layout: Any) -> None:
        self.layout = layout


@pytest.fixture(autouse=True)
def _stubbed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "observe", lambda *_, **__: None)
    monkeypatch.setattr(module, "replace", lambda _setting, layout, **_: Setting(layout))
    state = Stub(of=lambda setting, camera, *_, **__: Stub(camera=camera, of=setting.layout.name))
    monkeypatch.setattr(module, "State", state)


def _run(monkeypatch: pytest.MonkeyPatch, layouts: list[Any], *names: list[str]) -> Any:
    monkeypatch.setattr(
        module, "stages", lambda _: [(one, 10.0 - i) for i, one in enumerate(layouts)]
    )
    search: Any = Staged(*names)
    nothing: Any = None
    return search, _searched(search, nothing)


def _effect() -> Any:
    return Named("row_noise", Stub(effect=None), {}, 50.0, ())  # type: ignore[arg-type] # a stub


def test_what_few_frames_name_is_where_more_begin_and_all_frames_judge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search, final = _run(monkeypatch, [FEW, MORE], [_effect()], [_effect()])
    assert search.asked == [("few", "given", 10.0), ("more", "found on few", 9.0)]
    assert search.how == ["begun", "resumed"]  # what is fitted together is fitted once
    assert (final.camera, final.of) == ("found on more", "whole")
    assert search.setting.layout is WHOLE


def test_where_few_frames_name_nothing_more_begin_afresh(monkeypatch: pytest.MonkeyPatch) -> None:
    search, final = _run(monkeypatch, [FEW, MORE], [], [_effect()])
    assert search.asked[1] == ("more", "given", 9.0)
    assert final.camera == "found on more"


def test_where_nothing_is_named_the_base_is_left_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    search, final = _run(monkeypatch, [FEW, MORE], [], [])
    assert final is search.base
    assert final.camera == "given"


@pytest.mark.parametrize("named", [True, False])
def test_a_last_stage_of_all_frames_is_searched_as_a_whole(
    named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = [_effect()] if named else []
    search, final = _run(monkeypatch, [FEW, WHOLE], first, [_effect()])
    before = "found on few" if named else "given"
    assert search.asked[1] == ("whole", before, 9.0)
    assert final.camera == "found on whole"


def test_the_switch_of_a_second_path_is_told_by_all_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    path = Stub(switch_dn=827.0, error_dn=40.0, camera="with the switch at 827")
    asked = []

    def second_path(state: Any) -> Any:
        asked.append(state.camera)
        return path

    monkeypatch.setattr(module, "second_path", second_path)
    monkeypatch.setattr(module, "replace", lambda one, **new: Stub(kind=one.kind, **new))
    search: Any = Staged()
    search.named = [Named("dual_gain", None, {"switch_dn": 347.0}, 90.0, (), 232.0), _effect()]
    search.without = lambda _state, named: f"without {named.kind}"
    state: Any = Stub(camera="with the switch at 232")
    final = _switched(search, state)
    assert asked == ["without dual_gain"]
    assert final.camera == "with the switch at 827"
    assert search.named[0].switch_dn == 827.0
    assert search.named[0].errors == {"switch_dn": 40.0}
