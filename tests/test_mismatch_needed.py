"""An effect that a recording would call for again at once is not dropped as needless."""

from dataclasses import replace
from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from analysis.mismatch.asked import FramesAsked
from analysis.mismatch.candidates import Proposal
from analysis.mismatch.finding import Mismatch, Where
from analysis.mismatch.judge import LITTLE, NEEDLESS
from analysis.mismatch.name import Search
from analysis.mismatch.named import Named
from analysis.mismatch.rank import SURE_GAIN
from analysis.mismatch.resolved import calls_alone, gained
from analysis.mismatch.state import State
from dsis.effects import registry
from mismatch_recordings import camera, recorded, state_of

ROW_NOISE = registry()["row_noise"](sigma_dn=0.8)


@pytest.mark.parametrize("there", [True, False])
def test_what_a_state_without_an_effect_would_take_in_is_needed(there: bool) -> None:
    recording = recorded(camera(*[ROW_NOISE] * there), 5)
    state, bare = state_of(recording, camera(ROW_NOISE)), state_of(recording, camera())
    gain = gained(state, bare, ROW_NOISE, 2)
    assert gain > 50 if there else gain == 0
    search: Any = SimpleNamespace(
        setting=state.setting,
        _jumping=False,
        _least=lambda *_: SURE_GAIN,
        _shown=lambda *_: -inf,
    )
    named = Named("row_noise", Proposal(ROW_NOISE, ("sigma_dn",)), {}, gain, ())
    for why, left, needed in (
        (NEEDLESS, (), there),
        (NEEDLESS, ("row_variance",), False),  # what calls for it stays
        (NEEDLESS, ("level",), there),  # it says nothing of that
        (f"{LITTLE} 3%", (), False),
    ):
        one, other = _with(state, *left), _with(bare, "row_variance")
        assert Search._needed(search, one, other, named, why) is needed


@pytest.mark.parametrize(
    ("kind", "shown", "why", "needed"),
    [
        ("rts", True, f"{LITTLE} 0%", True),
        ("rts", True, NEEDLESS, True),
        ("rts", True, "the recording shows none", False),
        ("rts", False, f"{LITTLE} 0%", False),
        ("rts", None, f"{LITTLE} 0%", False),
        ("row_noise", True, f"{LITTLE} 0%", False),
    ],
)
def test_jumps_that_whole_frames_show_are_needed_whatever_numbers_of_few_pixels_say(
    kind: str, shown: bool | None, why: str, needed: bool
) -> None:
    effect = registry()["rts"](pixel_fraction=0.003, amplitude_dn=5.0)
    effect = effect if kind == "rts" else ROW_NOISE
    lines = None if shown is None else SimpleNamespace(jumping=lambda least: shown and least == 5)
    asked = SimpleNamespace(lines=lines, least_odds=5)
    search: Any = SimpleNamespace(_jumping=Search._jumping.fget(asked))  # type: ignore[attr-defined]
    nothing: Any = SimpleNamespace(mismatches=())
    named = Named(kind, Proposal(effect, ("amplitude_dn",)), {}, 9.0, ())
    assert Search._needed(search, nothing, nothing, named, why) is needed


@pytest.mark.parametrize(
    ("gain", "jumping", "shown"), [(20.0, 6.0, True), (20.0, 2.0, False), (5.0, 5.0, False)]
)
def test_whole_frames_show_jumps_by_odds_of_both(gain: float, jumping: float, shown: bool) -> None:
    """Of jumps, and of these rather than of noise as strong."""
    seen = SimpleNamespace(telegraph=SimpleNamespace(gain=gain, jumping=jumping))
    assert FramesAsked.jumping(seen, SURE_GAIN) is shown  # type: ignore[arg-type] # a stub
    none: Any = SimpleNamespace(telegraph=None)
    assert FramesAsked.jumping(none, 0.0) is False


def test_what_is_left_for_another_cause_denies_nothing_that_the_rest_shows() -> None:
    """Levels scatter with light that flickers; that they bend besides is another's."""
    flicker = registry()["flicker"](sigma_percent=1.0)
    recording = recorded(camera(flicker), 5)
    state, bare = state_of(recording, camera(flicker)), state_of(recording, camera())
    alone = gained(state, bare, flicker, 2)
    beside = gained(_with(state, "level"), _with(bare, "level", "frame_variance"), flicker, 2)
    assert 5 < beside <= alone + 1
    assert gained(_with(state, "level"), _with(bare, "level"), flicker, 2) == 0


def _with(state: State, *departures: str) -> State:
    """Return a state in which something differs, not so clearly that this alone would decide."""
    off = tuple(Mismatch(name, 5.0, 1e-6, Where(), "") for name in departures)
    return replace(state, mismatches=off)


@pytest.mark.parametrize(
    ("kind", "others", "alone"),
    [
        ("row_noise", (), "row_variance"),
        ("flicker", (), "frame_variance"),
        ("crosstalk", ("row_noise",), "correlation_0_1"),
        ("amp_glow", ("row_noise", "dsnu"), "fixed_smooth_variance"),
    ],
)
def test_what_calls_for_an_effect_alone(kind: str, others: tuple[str, ...], alone: str) -> None:
    assert alone in calls_alone(kind, others)


def test_a_second_path_is_called_for_by_nothing_that_is_its_alone() -> None:
    assert calls_alone("dual_gain", ("rts",)) == frozenset()


@pytest.mark.parametrize(
    ("kind", "other", "shared"),
    [
        ("flicker", "black_level_drift", "frame_variance"),
        ("shading", "amp_glow", "fixed_smooth_variance"),
        ("rts", "impulse", "one_off_outliers"),
    ],
)
def test_what_calls_for_two_effects_is_of_neither_alone(kind: str, other: str, shared: str) -> None:
    assert shared in calls_alone(kind, ())
    assert shared not in calls_alone(kind, (other,))
