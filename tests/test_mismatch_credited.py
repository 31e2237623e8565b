"""What was credited with the part of another effect gives it back where both are fitted."""

from typing import Any

import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.credited import joined, kept_up, together
from analysis.mismatch.named import Named
from dsis.effects import Effect
from exposing import effect
from mismatch_recordings import camera

WHITE, DARK = effect("row_noise", sigma_dn=0.5), effect("dsnu", sigma_dn=1.0)


def _bands(sigma: float) -> Proposal:
    one = effect("row_banding", sigma_dn=sigma, length_rows=2.0)
    return Proposal(one, ("sigma_dn", "length_rows"))


def _named(one: Effect | None, name: str = "row_noise") -> Named:
    proposal = None if one is None else Proposal(one, ("sigma_dn",))
    return Named(name, proposal, {"sigma_dn": 0.01}, 9.0, ())


def test_bands_and_white_rows_have_the_variance_that_white_rows_had() -> None:
    bare, starts = together(camera(DARK, WHITE), _bands(0.3))
    assert bare.effect == (DARK,)
    assert [one.effect.kind for one in starts] == ["row_banding", "row_noise"]
    sizes: list[Any] = [one.effect.model_dump()["sigma_dn"] for one in starts]
    assert sum(size**2 for size in sizes) == pytest.approx(0.25)
    assert starts[1].free == ("sigma_dn",)


def test_of_bands_larger_than_all_white_rows_keep_little() -> None:
    _, starts = together(camera(WHITE), _bands(0.8))
    assert starts[1].effect.model_dump()["sigma_dn"] == pytest.approx(0.05)


@pytest.mark.parametrize("own", [(), (DARK,)])
def test_where_nothing_was_credited_the_camera_stays(own: tuple[Effect, ...]) -> None:
    proposal = _bands(0.3)
    assert together(camera(*own), proposal) == (camera(*own), [proposal])
    drift = Proposal(effect("black_level_drift", sigma_dn=1.0), ("sigma_dn",))
    assert together(camera(WHITE), drift) == (camera(WHITE), [drift])


def test_a_camera_has_what_was_fitted_once() -> None:
    bands, less = _bands(0.3).effect, effect("row_noise", sigma_dn=0.4)
    both = joined(camera(DARK, WHITE), (bands, less))
    assert both is not None
    assert sorted(both.effect, key=lambda one: one.kind) == [DARK, bands, less]
    alone = joined(camera(DARK), (bands,))
    assert alone is not None
    assert set(alone.effect) == {DARK, bands}


def test_effects_named_are_those_of_the_camera() -> None:
    less = effect("row_noise", sigma_dn=0.4)
    found = kept_up([_named(WHITE), _named(DARK, "dsnu"), _named(None)], camera(DARK, less))
    assert [n.proposal.effect for n in found if n.proposal is not None] == [less, DARK]
    assert found[0].errors == {"sigma_dn": 0.01}
    assert found[2].proposal is None


def test_of_two_of_a_kind_none_is_mistaken_for_the_other() -> None:
    one, other = effect("row_noise", sigma_dn=0.1), effect("row_noise", sigma_dn=0.2)
    (kept,) = kept_up([_named(WHITE)], camera(one, other))
    assert kept.proposal is not None
    assert kept.proposal.effect == WHITE
