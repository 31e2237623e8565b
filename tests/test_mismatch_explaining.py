"""Effects to which, in the end, nothing that differed is put down."""

from collections.abc import Collection
from dataclasses import dataclass
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import explaining
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.finding import Gain
from exposing import effect


@dataclass(frozen=True)
class _Key:
    statistic: str


def _beside(
    left: Collection[str],
    why: dict[str, str],
    kind: str = "nonlinearity",
    gain: float = 15.0,
    *,
    measured: bool = False,
    large: bool = False,
) -> Any:
    """Return what is said of one effect beside row noise, that explains what `why` says."""
    own = {
        "nonlinearity": effect("nonlinearity", percent_full_scale=1.0),
        "periodic_noise": effect("periodic_noise", amplitude_dn=1.0, frequency=(0.1, 0.2)),
    }
    some = [
        Stub(
            name=name,
            kind=name,
            effect=one,
            proposal=Stub(effect=one),
            gain=gain,
            measured=measured,
        )
        for name, one in ((kind, own[kind]), ("row_noise", effect("row_noise", sigma_dn=1.0)))
    ]
    keys = ["level", "pixel_variance", "spectral_peak", "row_mean_variance"]
    z = np.array([20.0, 9.0, 12.0, 30.0])
    states = [
        Stub(
            null=Stub(
                keys=[_Key(key) for key in keys],
                contrasts=Stub(matrix=np.zeros((0, 4))),
                contrast_sd=np.ones(0),
            ),
            departures=departures,
            chances=np.zeros(4),
            mismatches=[Stub(statistic=key) for key in off],
        )
        for departures, off in ((z, keys), (z * [key in left for key in keys], left))
    ]
    changes = {
        one.name: np.array([z[i] * (why.get(key) == one.name) for i, key in enumerate(keys)])
        for one in some
    }
    search: Any = Stub(named=some, setting=Stub(large=large))
    first, last = states
    return explaining.idle(search, first, last, changes)


def test_what_explains_nothing_goes_where_all_that_calls_for_it_is_left() -> None:
    nothing = {"row_mean_variance": "row_noise", "level": "row_noise"}
    both = ["level", "pixel_variance"]
    found = _beside(both, nothing)
    assert found is not None
    assert (found[0].kind, found[1]) == ("nonlinearity", explaining.IDLE)
    assert _beside(["spectral_peak"], nothing) is None  # that calls for others
    assert _beside(both, nothing, gain=100.0) is None
    assert _beside(both, nothing, measured=True) is None  # whole frames show it
    assert _beside(both, {**nothing, "spectral_peak": "nonlinearity"}) is None


def test_what_calls_for_an_effect_may_be_explained_with_a_stronger_one() -> None:
    """Not of a large recording, whose weakest departures are far above chance: no law is exact."""
    nothing = {"row_mean_variance": "row_noise", "pixel_variance": "row_noise"}
    assert _beside(["level"], nothing) is None
    found = _beside(["level"], nothing, large=True)
    assert found is not None
    assert (found[0].kind, found[1]) == ("nonlinearity", explaining.SOME_LEFT)
    assert _beside(["spectral_peak"], nothing, large=True) is None  # that calls for others
    assert _beside(["level"], nothing, gain=100.0, large=True) is None


def test_lines_behind_a_stronger_one_may_explain_nothing() -> None:
    nothing = {"row_mean_variance": "row_noise", "level": "row_noise"}
    assert _beside(["spectral_peak"], nothing, "periodic_noise") is None


@pytest.mark.parametrize(
    ("first", "low", "explains", "dropped"),
    [
        ("outlying_patch", -0.2, False, True),  # dust, of which columns of some frames had a part
        ("outlying_patch", 0.1, False, False),  # locked frames show it
        ("outlying_patch", -0.2, True, False),
        ("fixed_column_variance", -0.2, False, False),  # something calls for it
    ],
)
def test_what_nothing_calls_for_in_all_frames_must_be_shown_by_locked_ones(
    first: str, low: float, explains: bool, dropped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = effect("column_prnu", sigma_percent=0.3)
    named: Any = Stub(name="column_prnu", kind="column_prnu", effect=own, measured=False)
    search: Any = Stub(named=[named], without=lambda *_: None)
    base: Any = Stub(mismatches=[Stub(statistic=first)])
    trial: Any = None  # nothing more is asked
    told = {first: ("column_prnu" if explains else None, 1.0)}
    monkeypatch.setattr(explaining, "changes", lambda *_: {named.name: None})
    monkeypatch.setattr(explaining, "explained", lambda *_, **__: told)
    gains = {"column_prnu": Gain(0.14, (low, 0.5))}
    found = explaining.uncalled(search, base, base, gains, trial, search.named)
    assert found == ((named, explaining.UNCALLED) if dropped else None)
    named.measured = True
    assert explaining.uncalled(search, base, base, gains, trial, search.named) is None


@pytest.mark.parametrize(
    ("first", "odds", "explains", "dropped"),
    [
        ("row_correlation", 5.1, False, True),  # one of 6144 by chance
        ("row_spectrum_peak", 5.1, False, True),  # of another's rows
        ("row_correlation", 9.0, False, False),
        ("spectral_peak", 5.1, True, False),
    ],
)
def test_a_line_that_explains_nothing_must_be_sure(
    first: str, odds: float, explains: bool, dropped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = effect("periodic_noise", amplitude_dn=1.0, frequency=(0.05, -0.17))
    named: Any = Stub(name="periodic_noise", kind="periodic_noise", measured=True, effect=line)
    search: Any = Stub(named=[named], without=lambda *_: None)
    base: Any = Stub(mismatches=[Stub(statistic=first)])
    trial: Any = Stub(lines=Stub(gain=lambda _: odds))
    monkeypatch.setattr(explaining, "changes", lambda *_: {named.name: None})
    told = {first: ("periodic_noise" if explains else None, 5.0)}
    monkeypatch.setattr(explaining, "explained", lambda *_, **__: told)
    gains = {"periodic_noise": Gain(0.3, (0.1, 0.5))}
    found = explaining.uncalled(search, base, base, gains, trial, search.named)
    assert found == ((named, explaining.UNCALLED) if dropped else None)


def test_what_only_hints_at_an_effect_does_not_call_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A smooth surface that a glow explains is no reason for a decay at an edge."""
    own = effect("line_settling", offset_dn=-1.2, length_pixels=5.0, edge="bottom")
    named: Any = Stub(name="line_settling (bottom)", kind=own.kind, effect=own, measured=False)
    search: Any = Stub(named=[named], without=lambda *_: None)
    base: Any = Stub(mismatches=[Stub(statistic="fixed_smooth_variance")])
    trial: Any = None
    monkeypatch.setattr(explaining, "changes", lambda *_: {named.name: None})
    told = {"fixed_smooth_variance": ("amp_glow", 1.0)}
    monkeypatch.setattr(explaining, "explained", lambda *_, **__: told)
    gains = {named.name: Gain(0.13, (-0.2, 0.4))}
    found = explaining.uncalled(search, base, base, gains, trial, search.named)
    assert found == (named, explaining.UNCALLED)


@pytest.mark.parametrize(
    ("kind", "told", "beside", "dropped"),
    [
        ("adc_dnl", "quantisation", None, True),
        ("adc_dnl", "adc_dnl", None, False),
        ("nonlinearity", "quantisation", None, False),  # of which every level says something
        ("prnu", "dsnu", "dsnu", False),  # both are called for by the same
    ],
)
def test_what_is_drawn_must_be_put_down_to_something(
    monkeypatch: pytest.MonkeyPatch, kind: str, told: str, beside: str | None, dropped: bool
) -> None:
    """Beside coarse codes frames gain by any widths that scatter, and none of that is seen."""
    sizes = {
        "adc_dnl": {"rms_lsb": 0.02},
        "nonlinearity": {"percent_full_scale": 1.0},
        "prnu": {"sigma_percent": 0.4},
        "dsnu": {"sigma_dn": 3.0},
    }
    some: list[Any] = [
        Stub(name=one, kind=one, effect=effect(one, **sizes[one]), measured=False)
        for one in (kind, beside)
        if one is not None
    ]
    own: Any = {one.name: None for one in some}
    monkeypatch.setattr(explaining, "changes", lambda *_: own)
    calls = sorted(CANDIDATES[kind].calls)
    monkeypatch.setattr(explaining, "explained", lambda *_, **__: {calls[0]: (told, 0.5)})
    search: Any = Stub(named=some, without=lambda *_: None)
    state: Any = Stub(mismatches=[Stub(statistic=calls[0])])
    found = explaining.hollow(search, state, state)
    assert found == ((some[0], explaining.HOLLOW) if dropped else None)
    hidden: Any = Stub(mismatches=[Stub(statistic="row_variance")])
    assert explaining.hollow(search, hidden, state) is None
