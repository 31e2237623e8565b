"""Who is asked whether the locked frames confirm an effect, and who has the last word."""

from collections.abc import Collection
from dataclasses import dataclass
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import confirmed, explaining
from analysis.mismatch.candidates import CANDIDATES
from analysis.mismatch.finding import Gain
from analysis.mismatch.trial import Gained
from exposing import effect

BANDS = effect("line_flicker", depth_percent=0.5, cycles_per_frame=7.3)
FRAMES = 12


def _gain(nats: float, error: float) -> Gain:
    return Gain(nats, (nats - 1.96 * error, nats + 1.96 * error))


def _asked(
    monkeypatch: pytest.MonkeyPatch, pixels: Gained, foretold: Gained | None, by_all: bool
) -> Gained:
    """Return what is said of bands of light by pixels, by other frames' phases and by all."""
    monkeypatch.setattr(confirmed, "shown_by_all", lambda *_: by_all)
    one = Stub(
        name="line_flicker",
        kind="line_flicker",
        gain=10.0,
        effect=BANDS,
        proposal=Stub(effect=BANDS),
    )
    search: Any = Stub(
        named=[one],
        setting=Stub(jobs=1),
        whole=None,
        fitted_without=lambda *_: Stub(effect=()),
    )
    trial: Any = Stub(
        gains=lambda _, without: dict.fromkeys(without, pixels),
        foretold=lambda _: foretold,
        numbers=Stub(whole=(None, None), frames=FRAMES),
    )
    final: Any = Stub(mismatches=())
    return confirmed._gained(search, final, trial)["line_flicker"]


LITTLE = Gained(_gain(0.3, 0.2), certain=False, nats=0.0)


def test_bands_that_foretell_nothing_leave_all_frames_their_say(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for nothing in (None, Gained(_gain(-0.05, 0.1), certain=False, nats=0.0)):
        found = _asked(monkeypatch, LITTLE, nothing, by_all=True)
        assert found == Gained(LITTLE.gain, certain=True, nats=0.0)
        assert not _asked(monkeypatch, LITTLE, nothing, by_all=False).certain


def test_bands_that_surely_foretell_are_what_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = Gained(_gain(0.6, 0.1), certain=True, nats=0.0)
    assert _asked(monkeypatch, LITTLE, sure, by_all=False) == sure


def test_nobody_overrules_pixels_that_are_sure_it_is_worse(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    worse, sure = (
        Gained(_gain(-5, 0.5), certain=False, nats=0.0),
        Gained(_gain(0.6, 0.1), certain=True, nats=0.0),
    )
    assert _asked(monkeypatch, worse, sure, by_all=True) == worse


def test_what_all_frames_show_is_reported_by_what_exceeds_its_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unsure = Gained(_gain(0.02, 0.12), certain=False, nats=0.0)
    foretold = Gained(_gain(0.17, 0.15), certain=False, nats=0.0)
    found = _asked(monkeypatch, unsure, foretold, by_all=True)
    assert found == Gained(foretold.gain, certain=True, nats=0.0)


@pytest.mark.parametrize(
    ("low", "left", "certain"),
    [(-0.06, "kurtosis", False), (-0.06, "row_variance", True), (0.04, "kurtosis", True)],
)
def test_odds_count_where_nothing_that_calls_for_the_effect_is_left(
    low: float, left: str, certain: bool
) -> None:
    """Of the real CCD without its uneven codes, spikes gained 10 nats in 75 frames."""
    told = Gained(Gain(0.13, (low, 0.32)), certain=True, nats=0.0)
    final = _left_open([left], [1.0])
    spikes: Any = Stub(kind="impulse", name="impulse", proposal=Stub())
    search: Any = Stub(without=lambda *_: None, changes={})
    assert confirmed._believed(search, final, spikes, told).certain is certain


def _left_open(left: list[str], changes: list[float]) -> Any:
    """Return a state that leaves numbers open, which an effect changes so far, in departures."""
    z = np.array([9.0, 6.0][: len(left)])
    return Stub(
        mismatches=[Stub(statistic=name) for name in left],
        departures=z,
        chances=np.zeros(len(left)),
        null=Stub(
            keys=[Stub(statistic=name) for name in left],
            mean=z * changes,
            sd=np.ones(len(left)),
            known=np.ones(len(left), bool),
            contrasts=Stub(matrix=np.zeros((0, len(left)))),
            contrast_sd=np.ones(0),
        ),
        predictor=lambda: Stub(mean=lambda _: np.zeros(len(left))),
    )


@pytest.mark.parametrize(
    ("left", "changes", "counts"),
    [
        (["level"], [0.1], False),  # darks that warm up are no bend
        (["level"], [-0.5], True),
        (["level", "level"], [0.0, 0.4], True),
        (["kurtosis"], [1.0], False),  # nothing that calls for a bend
        (["pixel_variance", "kurtosis"], [0.1, 1.0], False),
        ([], [], False),
    ],
)
def test_what_is_left_counts_where_the_effect_acts(
    left: list[str], changes: list[float], counts: bool
) -> None:
    bend: Any = Stub(kind="nonlinearity", name="nonlinearity", proposal=Stub())
    search: Any = Stub(without=lambda *_: None, changes={})
    assert confirmed._calls_left(search, _left_open(left, changes), bend) is counts
    path: Any = Stub(kind="nonlinearity", proposal=None)
    called = not {"level", "pixel_variance"}.isdisjoint(left)
    assert confirmed._calls_left(search, _left_open(left, changes), path) is called


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
    ("error", "low", "measured", "refused"),
    [
        (0.024, -0.04, False, True),
        (0.004, -0.04, False, False),  # known by its size
        (0.024, 0.04, False, False),  # locked frames show it
        (0.024, -0.04, True, False),  # so do whole frames
    ],
)
def test_what_no_frames_show_has_a_size_beyond_its_error(
    error: float, low: float, measured: bool, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Codes of unequal width of 0.0058 +- 0.0239 LSB are none."""
    own = effect("adc_dnl", rms_lsb=0.0058)
    named: Any = Stub(
        kind=own.kind,
        effect=own,
        measured=measured,
        errors={"rms_lsb": error},
        proposal=Stub(free=("rms_lsb",), effect=own, errors={}),
    )
    monkeypatch.setattr(confirmed, "_calls_left", lambda *_: False)
    search: Any = None
    state: Any = Stub(mismatches=())
    told = Gained(Gain(150.0, (low, 500.0)), certain=True, nats=0.0)
    why = confirmed.small(search, state, named, told)
    assert why == (
        "no size of it exceeds its standard error (rms lsb 0.0058 ± 0.024)" if refused else ""
    )


@pytest.mark.parametrize(
    ("error", "left", "of", "refused"),
    [
        (0.81, 6.6, "frame_variance", True),  # of 25 that it explains a quarter
        (0.81, 5.0, "frame_variance", False),
        (0.81, 0.0, "", False),  # all else is explained
        (0.4, 6.6, "frame_variance", False),  # known by its size
        (0.81, 6.6, "fixed_row_variance", False),  # that it leaves alone; its logarithm is told
        (0.95, 6.6, "fixed_row_variance", True),
        (np.inf, 6.6, "frame_variance", True),  # frames gain, and no number says by what size
        (np.inf, 6.6, "fixed_row_variance", True),
        (np.inf, 5.0, "frame_variance", False),
    ],
)
def test_an_effect_of_no_clear_size_leaves_little(
    error: float, left: float, of: str, refused: bool
) -> None:
    """Flicker without its word is no drift of 0.99 +- 0.81, whatever frames gain by one."""
    own = effect("black_level_drift", sigma_dn=0.99)
    errors = {"sigma_dn": error}
    proposal = Stub(free=("sigma_dn",), effect=own, errors={}, signed=frozenset())
    named: Any = Stub(
        kind=own.kind, name=own.kind, effect=own, measured=False, errors=errors, proposal=proposal
    )
    without = np.array([1.0, 1.0, 1.0])
    values = np.array([26.0, 5.0, 1.0])  # one is explained, one overshot: of that 4 count
    null = Stub(mean=np.array([26.0, 40.0, 1.0]), sd=np.ones(3), known=np.ones(3, bool))
    state: Any = Stub(
        mismatches=[Stub(statistic=of, z=-left)] if left else [],
        null=null,
        vector=Stub(values=values),
        predictor=lambda: Stub(mean=lambda _: without),
    )
    search: Any = Stub(named=[named], without=lambda *_: None)
    found = confirmed.unsized(search, state)
    assert (found is not None) == refused
    if found is not None:
        assert found[0] is named
        assert f"sigma dn 0.99 ± {error:g}" in found[1]
        assert "1.96 times" in found[1]


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
