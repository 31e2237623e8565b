"""What a diagnosis need not ask again: rounds of a calibration, exposures, replicates."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.basefit import BaseFit, Piece
from analysis.mismatch.candidates.response import CANDIDATES
from analysis.mismatch.heldnumbers import HeldNumbers
from analysis.mismatch.layout import Layout, Taken
from analysis.mismatch.recalibrate import _change, _left
from analysis.mismatch.simulations import Simulations
from dsis.cfa import Cfa
from mismatch_recordings import camera

GAINS = next(one for one in CANDIDATES if one.kind == "dual_gain_mismatch")


@pytest.mark.parametrize("share", [0.02, 0.3, 0.7])
def test_what_is_left_is_the_sum_of_all_rounds_to_come(share: float) -> None:
    rounds = 2.0 * share ** np.arange(1, 200)
    assert _left(2.0, 2.0 / share) == pytest.approx(rounds.sum(), rel=1e-9)


def test_rounds_that_come_no_nearer_have_no_end() -> None:
    assert _left(2.0, 2.0) == np.inf
    assert _left(2.0, 1.0) == np.inf


def _fit(slope: float, black: float) -> BaseFit:
    piece = Piece(-np.inf, slope, 1.0, 0.01, 0.1)
    return BaseFit(
        pieces=(piece,),
        black_dn={"MONO": black},
        black_error_dn={"MONO": 0.1},
        signal_dn={("flat", "MONO"): 100.0},
        light_dn={},
        expected_dn2={},
    )


def test_a_change_is_the_largest_in_errors_and_an_unknown_one_has_no_bound() -> None:
    levels: Any = {("flat", "MONO"): SimpleNamespace(level_error_dn=0.5)}
    assert _change(_fit(1.0, 0.0), _fit(1.02, 0.1), levels) == pytest.approx(2.0)
    assert _change(_fit(1.0, 0.0), _fit(1.0, 0.0), levels) == 0.0
    assert _change(_fit(1.0, 0.0), _fit(1.0, np.nan), levels) == np.inf


def test_recordings_made_ahead_are_those_that_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In whatever order: of two cameras, one of whose recordings is known."""
    one, other = camera(), camera().model_copy(update={"black_level": 70.0})

    def each(_work: Any, items: Any, _jobs: int) -> Any:
        return [[(m.camera.black_level, number) for m, _ in some] for some, number in items]

    monkeypatch.setattr("analysis.mismatch.simulations.each", each)
    model: Any = SimpleNamespace(with_camera=lambda own: SimpleNamespace(camera=own), camera=one)
    layout: Any = SimpleNamespace(
        cfa=Cfa.MONO, rows=4, columns=6, uniform=(), keeps_amplitudes=False
    )
    made = Simulations(layout, model, np.array, 0, 2)
    made.keep(one, [np.array((one.black_level, 0))])
    made.ready([one, other], 3)
    for own in (one, other):
        assert made.of(own, 3).tolist() == [[own.black_level, number] for number in range(3)]


def _clues(signals: list[float], switch: float = 100.0) -> Any:
    names = [f"flat-{i}" for i in range(len(signals))]
    segments = [SimpleNamespace(upper_dn=switch), SimpleNamespace(upper_dn=None)]
    level = dict(zip(names, signals, strict=True))
    return SimpleNamespace(
        camera=SimpleNamespace(noise=SimpleNamespace(segment=segments)),
        layout=SimpleNamespace(
            exposures=[
                SimpleNamespace(name="dark", kind="dark"),
                *(SimpleNamespace(name=name, kind="flat") for name in names),
            ]
        ),
        excess=lambda _name: {
            (name, "MONO"): (0.02 * s if s >= switch else 0.0, 0.1)
            for name, s in {**level, "dark": 0.5}.items()
        },
        signal=lambda place: {**level, "dark": 0.5}[place[0]],
    )


def test_a_switch_needs_two_flats_on_either_side() -> None:
    stepped, kinked = GAINS.propose(_clues([20.0, 50.0, 200.0, 500.0]))
    assert stepped.effect.model_dump()["gain_error_percent"] == pytest.approx(2.0)
    assert kinked.effect.model_dump()["mean"] == "kinks"
    assert GAINS.propose(_clues([50.0, 200.0, 500.0])) == []  # darks have no gain
    assert GAINS.propose(_clues([20.0, 50.0, 500.0])) == []


def _held(monkeypatch: pytest.MonkeyPatch, locked: int, pairs: int) -> tuple[Any, Any]:
    """Return what numbers of a large recording are held beside, and the recording's layout."""
    taken = [Taken(f"stack-{i}", "flat", 0.01, 1.0, tuple(range(5))) for i in range(locked)]
    taken += [Taken(f"pair-{i:02}", "dark", 0.01 * i, None, (0, 1)) for i in range(pairs)]
    layout = Layout(tuple(taken), 4000, 4000, Cfa.MONO, 64.0, 4095.0, {}, {})
    assert layout.large
    monkeypatch.setattr("analysis.mismatch.heldnumbers.observe", lambda *_, **__: "observed again")
    setting: Any = SimpleNamespace(layout=layout, seen="observed", jobs=1)
    split: Any = SimpleNamespace(locked={f"stack-{i}": (5,) for i in range(locked)})
    return HeldNumbers(SimpleNamespace(), split, SimpleNamespace(), setting), layout  # type: ignore[arg-type]


def test_exposures_with_locked_frames_are_all_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    held, layout = _held(monkeypatch, 12, 40)
    few, seen = held.rest
    names = [e.name for e in few.exposures]
    assert names[:12] == [f"stack-{i}" for i in range(12)]
    assert 3 <= len(names) - 12 <= 10
    assert all(e in layout.exposures for e in few.exposures)
    assert seen == "observed again"


def test_what_leaves_none_out_is_not_observed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    held, layout = _held(monkeypatch, 12, 0)
    assert held.rest == (layout, "observed")
