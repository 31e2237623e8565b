"""Where numbers tie pixels that jump with a read noise that spreads, frames say which it is."""

from dataclasses import replace
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.jumptold import as_pixels_show, standing_still, unlike_pixels
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.rank import Ranked
from analysis.mismatch.telegraph import _PARTS, _SWITCHING, _told
from dsis.effects import Effect
from dsis.effects.rts import Rts

TAILS = "heavy_tailed_read_noise"


def _nothing(effect: Effect) -> float:
    """Return what numbers gain by an effect, nats."""
    del effect
    return 0.0


def _ranked(**gains: float) -> list[Ranked]:
    start: Any = Stub(of_pixels=None)
    fitted: Any = Stub(effects=("as fitted",))
    return [Ranked(gain, kind, start, fitted) for kind, gain in gains.items()]


def _frames(jumping: float, spread: float) -> WholeFrames:
    made = WholeFrames(Stub(), lambda _: [])  # type: ignore[arg-type] # a stub
    values = {"pixel_fraction": 0.01, "amplitude_dn": 8.0, "switch_probability": 0.2}
    made.__dict__["telegraph"] = Stub(jumping=jumping, spread=spread, values=values)
    return made


@pytest.mark.parametrize(
    ("jumping", "spread", "first", "second"),
    [
        (-1.0, 80.0, "read_noise_spread", 2.0),  # 80 nats behind: as good as none
        (-1.0, 10.0, "read_noise_spread", 30.0),
        (15.0, -9.0, "rts", 25.0),
        (15.0, 80.0, "rts", 38.0),  # both are sure: numbers keep their say
        (-1.0, 2.0, "rts", 38.0),  # neither is
        (5.0, 13.0, "rts", 38.0),  # one is, and odds of 150 are for the other
    ],
)
def test_frames_break_the_tie_that_numbers_leave(
    jumping: float, spread: float, first: str, second: float
) -> None:
    fitted = _ranked(rts=40.0, read_noise_spread=38.0, impulse=1.0)
    best, *others = as_pixels_show(_frames(jumping, spread), fitted)
    assert (best.kind, best.gain) == (first, 40.0)
    (other,) = (one for one in others if one.kind in ("rts", "read_noise_spread"))
    assert other.gain == second


def test_what_numbers_tell_apart_by_more_than_frames_stays() -> None:
    """Sums over pixels know the law of a spread no better than frames of each of them."""
    fitted = _ranked(rts=40.0, read_noise_spread=30.0)
    assert as_pixels_show(_frames(-1.0, 12.0), fitted) == fitted
    assert as_pixels_show(_frames(-1.0, 80.0), fitted)[0].kind == "read_noise_spread"
    assert as_pixels_show(None, fitted) == fitted
    assert as_pixels_show(_frames(-1.0, 80.0), []) == []
    others = _ranked(impulse=5.0, rts=4.0)
    assert as_pixels_show(_frames(-1.0, 80.0), others) == others


@pytest.mark.parametrize(
    ("jumping", "spread", "best", "why"),
    [
        (-1.0, 80.0, "rts", "differs"),
        (15.0, -9.0, "read_noise_spread", "jump"),
        (45.0, -9.0, "hot_pixels", "jump"),
        (15.0, -9.0, "hot_pixels", None),  # jumps do not tell more than hot pixels explain
        (45.0, -9.0, TAILS, "jump"),
        (15.0, -9.0, TAILS, None),
        (-1.0, 80.0, "hot_pixels", None),
        (-1.0, 80.0, TAILS, None),
        (15.0, -9.0, "rts", None),
        (-1.0, 80.0, "read_noise_spread", None),
        (15.0, 80.0, "rts", None),  # both are sure
        (-1.0, 80.0, "impulse", None),
    ],
)
def test_pixels_deny_what_stands_in_for_another(
    jumping: float, spread: float, best: str, why: str | None
) -> None:
    """Where the word for what they show is missing nothing else is named for it."""
    (first,) = _ranked(**{best: 40.0})
    bare: Any = Stub(effect=())
    frames, others = _frames(jumping, spread), _ranked(impulse=3.0)
    denial = unlike_pixels(bare, frames, first, others, _nothing)
    assert (denial is not None and denial.why.endswith(why)) if why else denial is None


@pytest.mark.parametrize("best", ["hot_pixels", TAILS])
def test_what_jumps_explain_of_the_numbers_counts(best: str) -> None:
    """Frames gain 15 nats by jumps, and numbers 30 by the same: 40 by another are fewer."""
    (first,) = _ranked(**{best: 40.0})
    bare: Any = Stub(effect=())
    asked: list[Effect] = []
    for more, denied in ((30.0, True), (20.0, False)):
        denial = unlike_pixels(
            bare, _frames(15.0, -9.0), first, [], lambda one, m=more: asked.append(one) or m
        )
        assert (denial is not None) == denied
    jumps = Rts(pixel_fraction=0.01, amplitude_dn=8.0, switch_probability=0.2)
    assert asked == [jumps, jumps]  # as frames tell them


def test_pixels_of_a_map_are_no_numbers_that_jumps_were_asked_about() -> None:
    """One pixel far out of a map gains 3000 nats: both are told by how many there are."""
    (hot,) = _ranked(hot_pixels=3000.0)
    bare: Any = Stub(effect=())
    start: Any = Stub(of_pixels=2990.0)
    hot = replace(hot, proposal=start)
    for own, denied in ((40.0, True), (140.0, False)):
        denial = unlike_pixels(
            bare,
            _frames(15.0, -9.0),
            hot,
            [],
            lambda one, m=own: m if isinstance(one, str) else 100.0,
        )
        assert (denial is not None) == denied


def test_pixels_deny_nothing_beside_the_other() -> None:
    (rts, spread), frames = _ranked(rts=40.0, read_noise_spread=30.0), _frames(-1.0, 80.0)
    bare: Any = Stub(effect=())
    there: Any = Stub(effect=(Stub(kind="read_noise_spread"),))
    assert unlike_pixels(bare, frames, rts, [spread], _nothing) is None  # it was fitted as well
    assert unlike_pixels(there, frames, rts, [], _nothing) is None
    assert unlike_pixels(bare, None, rts, [], _nothing) is None
    still = unlike_pixels(there, _frames(-80.0, 80.0), rts, [], _nothing)
    assert still is not None
    assert still.why.endswith("do not jump")
    assert unlike_pixels(there, _frames(-80.0, 80.0), spread, [], _nothing) is None


@pytest.mark.parametrize(
    ("kind", "off", "jumping", "denied"),
    [
        ("rts", ("outlying_pixels",), -1.9, True),
        ("rts", ("outlying_pixels", "level"), -1.9, True),
        ("rts", ("outlying_pixels",), 1.2, False),
        ("rts", ("outlying_pixels", "variance_spread"), -1.9, False),
        ("rts", ("outlying_pixels", "jumping_pixels"), -1.9, False),
        ("hot_pixels", ("outlying_pixels",), -1.9, False),
    ],
)
def test_what_only_maps_show_does_not_jump(
    kind: str, off: tuple[str, ...], jumping: float, denied: bool
) -> None:
    (best,) = _ranked(**{kind: 9.6})
    denial = standing_still(_frames(jumping, -1.0), best, frozenset(off))
    assert (denial is not None) == denied
    assert standing_still(None, best, frozenset(off)) is None


def test_sizes_at_the_end_of_what_was_tried_are_no_larger() -> None:
    """One place's logarithm, rounded, has an exponential 2e-13 beyond a half: no probability."""
    amplitudes = np.geomspace(1.0, 40.0, 32)
    for place in range(_SWITCHING.size):
        likely = np.full((_SWITCHING.size, amplitudes.size, _PARTS.size), -1e3)
        likely[place, 3, 5] = 0.0
        told = _told(likely, amplitudes, (10.0, 0.0, 0.0))
        assert told is not None
        assert told.switching == pytest.approx(_SWITCHING[place])
        Rts.model_validate({"kind": "rts", **told.values})
