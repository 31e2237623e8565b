"""Who is asked whether the locked frames confirm an effect, and who has the last word."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import confirmed
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
