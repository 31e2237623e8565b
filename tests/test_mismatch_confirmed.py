"""Who is asked whether the locked frames confirm an effect, and who has the last word."""

from types import SimpleNamespace as Stub
from typing import Any

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
    one = Stub(name="line_flicker", kind="line_flicker", gain=10.0, proposal=Stub(effect=BANDS))
    search: Any = Stub(named=[one], setting=Stub(jobs=1), fitted_without=lambda *_: Stub(effect=()))
    trial: Any = Stub(
        gains=lambda _, without: dict.fromkeys(without, pixels),
        foretold=lambda _: foretold,
        numbers=Stub(whole=(None, None), frames=FRAMES),
    )
    final: Any = Stub(mismatches=())
    return confirmed._gained(search, final, trial)["line_flicker"]


LITTLE = Gained(_gain(0.3, 0.2), certain=False)


def test_bands_that_foretell_nothing_leave_all_frames_their_say(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for nothing in (None, Gained(_gain(-0.05, 0.1), certain=False)):
        found = _asked(monkeypatch, LITTLE, nothing, by_all=True)
        assert found == Gained(LITTLE.gain, certain=True)
        assert not _asked(monkeypatch, LITTLE, nothing, by_all=False).certain


def test_bands_that_surely_foretell_are_what_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = Gained(_gain(0.6, 0.1), certain=True)
    assert _asked(monkeypatch, LITTLE, sure, by_all=False) == sure


def test_nobody_overrules_pixels_that_are_sure_it_is_worse(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    worse, sure = Gained(_gain(-5, 0.5), certain=False), Gained(_gain(0.6, 0.1), certain=True)
    assert _asked(monkeypatch, worse, sure, by_all=True) == worse


def test_what_all_frames_show_is_reported_by_what_exceeds_its_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unsure = Gained(_gain(0.02, 0.12), certain=False)
    foretold = Gained(_gain(0.17, 0.15), certain=False)
    found = _asked(monkeypatch, unsure, foretold, by_all=True)
    assert found == Gained(foretold.gain, certain=True)


@pytest.mark.parametrize(
    ("low", "left", "certain"),
    [(-0.06, "kurtosis", False), (-0.06, "row_variance", True), (0.04, "kurtosis", True)],
)
def test_odds_count_where_nothing_that_calls_for_the_effect_is_left(
    low: float, left: str, certain: bool
) -> None:
    """Of the real CCD without its uneven codes, spikes gained 10 nats in 75 frames."""
    told = Gained(Gain(0.13, (low, 0.32)), certain=True)
    final: Any = Stub(mismatches=(Stub(statistic=left),))
    spikes: Any = Stub(kind="impulse")
    assert confirmed._believed(final, spikes, told).certain is certain
