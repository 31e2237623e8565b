"""Whether light falls to the corners at all, where the shape of its fall is not clear."""

from collections.abc import Sequence
from types import SimpleNamespace as Stub
from typing import Any

import pytest

from analysis.mismatch import fitted
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.named import Named, beside_plain, unclear
from dsis.effects import Effect
from exposing import effect

RING = "ring_percent"


@pytest.mark.parametrize(("alone", "clear"), [(0.01, True), (0.03, False)])
def test_a_fall_is_there_where_that_of_a_plain_shape_is_sure(alone: float, clear: bool) -> None:
    """A ring that is not clear makes the fall in the corners less known, not less there."""
    fall = effect("shading", falloff_percent=0.06, ring_percent=0.01)
    errors = {"falloff_percent": 0.031, "ring_percent": 0.05}
    proposal = Proposal(fall, tuple(errors), frozenset({"ring_percent"}))
    named = Named("shading", proposal, errors, 17.0, ())
    assert "falloff percent 0.06 ± 0.031" in unclear(named)
    plain = effect("shading", falloff_percent=0.056)
    beside = beside_plain(named, plain, {"falloff_percent": alone})
    assert (unclear(beside) == "") == clear
    assert beside_plain(named, fall, errors).plain is None  # no shape that was held


def test_the_plain_fall_is_asked_for_beside_the_users_sizes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The user's own sizes come first, and all are fitted together."""
    users = Proposal(effect("row_noise", sigma_dn=2.0), ("sigma_dn",))
    fall = Proposal(effect("shading", falloff_percent=0.06), ("falloff_percent", RING))
    other = Proposal(effect("crosstalk", fraction=0.01), ("fraction",))
    asked: list[Sequence[Proposal]] = []

    def settled(
        _state: object, _bare: object, some: Sequence[Proposal]
    ) -> tuple[tuple[Effect, ...], tuple[dict[str, float], ...]]:
        asked.append(some)
        return tuple(p.effect for p in some), tuple(dict.fromkeys(p.free, 0.01) for p in some)

    monkeypatch.setattr(fitted, "settled", settled)
    search: Any = Stub(_parts=lambda _: ("camera", [users, other, fall]))
    path = Named("dual_gain", None, {}, 90.0, ())
    shaped = [
        path,
        *(Named(p.effect.kind, p, dict.fromkeys(p.free, 0.05), 17.0, ()) for p in (other, fall)),
    ]
    one, beside, light = fitted.Fitted._with_plain(search, "state", shaped)  # type: ignore[arg-type]
    (some,) = asked
    assert [p.free for p in some] == [("sigma_dn",), ("fraction",), ("falloff_percent",)]
    assert (one.plain, beside.plain) == (None, None)
    assert light.plain == (fall.effect, {"falloff_percent": 0.01})
    assert unclear(light) == ""
    # Where no shape is free nothing is asked for.
    assert fitted.Fitted._with_plain(search, "state", shaped[:2]) == shaped[:2]  # type: ignore[arg-type]
    assert len(asked) == 1
