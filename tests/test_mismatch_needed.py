"""An effect that a recording would call for again at once is not dropped as needless."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.finding import Mismatch, Where
from analysis.mismatch.judge import LITTLE, NEEDLESS
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.rank import SURE_GAIN
from analysis.mismatch.resolved import calls_alone, gained
from analysis.mismatch.state import State
from dsis.effects import registry
from mismatch_recordings import camera, recorded
from test_mismatch_contradicted import state_of

ROW_NOISE = registry()["row_noise"](sigma_dn=0.8)


@pytest.mark.parametrize("there", [True, False])
def test_what_a_state_without_an_effect_would_take_in_is_needed(there: bool) -> None:
    recording = recorded(camera(*[ROW_NOISE] * there), 5)
    state, bare = state_of(recording, camera(ROW_NOISE)), state_of(recording, camera())
    gain = gained(state, bare, ROW_NOISE, 2)
    assert gain > 50 if there else gain == 0
    search: Any = SimpleNamespace(setting=state.setting, _least=lambda *_: SURE_GAIN)
    named = Named("row_noise", Proposal(ROW_NOISE, ("sigma_dn",)), {}, gain, ())
    for why, left, needed in (
        (NEEDLESS, (), there),
        (NEEDLESS, ("row_variance",), False),  # what calls for it stays
        (NEEDLESS, ("level",), there),  # it says nothing of that
        (f"{LITTLE} 3%", (), False),
    ):
        one, other = _with(state, *left), _with(bare, "row_variance")
        assert Search._needed(search, one, other, named, why) is needed


def _with(state: State, *departures: str) -> State:
    """Return a state in which something differs, not so clearly that this alone would decide."""
    off = tuple(Mismatch(name, 5.0, 1e-6, Where(), "") for name in departures)
    return replace(state, mismatches=off)


@pytest.mark.parametrize("kind", sorted(CANDIDATES))
def test_what_calls_for_two_effects_is_of_neither_alone(kind: str) -> None:
    own = CANDIDATES[kind]
    alone = calls_alone(kind, set())
    assert alone == {*own.calls, *own.hints}
    for other in CANDIDATES:
        assert calls_alone(kind, {other}) == alone - set(CANDIDATES[other].calls)
    assert not np.any([call in calls_alone(kind, {kind}) for call in own.calls])
