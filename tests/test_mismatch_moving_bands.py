"""Bands of light that move on steadily are located where bands of any phases would not be."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.movingbands import DETAIL, MovingBands
from analysis.mismatch.bank.peaks import largest_line
from analysis.mismatch.untold import untold_order
from dsis.cfa import Cfa
from dsis.effects import registry
from dsis.measures import Accumulator
from mismatch_recordings import camera

ROWS, COLUMNS, FRAMES = 96, 128, 8
CYCLES, ADVANCE = 3.17, 0.635
SIGNAL, VARIANCE = 2000.0, 400.0
Array = NDArray[np.float64]
SITES = {
    Cfa.MONO: {"MONO": (0, 0)},
    Cfa.RGGB: {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)},
}


def _bands(
    depth: float, rng: np.random.Generator, cfa: Cfa, *, steady: bool, left_out: int | None = None
) -> MovingBands:
    """Return the sums of one flat of numpy's noise with bands, one frame perhaps left out."""
    found = MovingBands(ROWS, SITES[cfa], FRAMES - 1)
    numbers = [k for k in range(FRAMES) if k != left_out]
    sums = Accumulator(ROWS, COLUMNS, cfa)
    y = np.arange(ROWS)[:, np.newaxis]
    for k in range(FRAMES):
        turn = ADVANCE * k if steady else rng.random()
        light = 1 + depth * np.sin(2 * np.pi * (CYCLES * y / ROWS + turn))
        frame = 64 + SIGNAL * light + rng.normal(0, VARIANCE**0.5, (ROWS, COLUMNS))
        if k in numbers:
            sums.add(np.rint(frame).astype(np.uint16))
    channels = sums.result().channels
    of_all: Any = dict.fromkeys(channels, SIGNAL)
    found.add(channels, dict.fromkeys(channels, VARIANCE), of_all, numbers)
    return found


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("left_out", [None, 3])
def test_a_steady_band_stands_out_at_its_place(cfa: Cfa, left_out: int | None) -> None:
    """Of 0.6 DN in row means that scatter by 1.8: half as much again as chance's highest."""
    scores = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        own = _bands(4e-4, rng, cfa, steady=True, left_out=left_out)
        scores.append(own.number()[0])
        peak = own.peak()
        assert peak is not None
        rows = ROWS if cfa is Cfa.MONO else ROWS // 2
        assert peak.fy * rows + peak.off == pytest.approx(CYCLES, abs=0.3)
    assert np.mean(scores) > 5


def test_bands_of_any_phases_and_chance_stand_out_less() -> None:
    rng = np.random.default_rng(1)
    chance = [_bands(0.0, rng, Cfa.MONO, steady=True).number()[0] for _ in range(60)]
    assert np.mean(chance) < 1.5
    assert max(chance) < 4.5
    free = np.mean([_bands(4e-4, rng, Cfa.MONO, steady=False).number()[0] for _ in range(8)])
    steady = np.mean([_bands(4e-4, rng, Cfa.MONO, steady=True).number()[0] for _ in range(8)])
    assert steady > free + 2


def test_what_is_no_series_of_lit_frames_says_nothing() -> None:
    none = MovingBands(ROWS, SITES[Cfa.MONO], FRAMES - 1)
    assert np.isnan(none.number()[0])
    assert none.peak() is None
    assert np.isnan(largest_line(np.zeros(4), 1.0)[0])


def test_a_model_with_bands_does_not_say_how_they_move_on() -> None:
    keys = [Key("row_spectrum_peak", "all", "", "MONO", detail) for detail in ("light", DETAIL)]
    flicker = registry()["line_flicker"](depth_percent=0.1, cycles_per_frame=3.0)
    assert untold_order(camera(flicker), keys).tolist() == [False, True]
    assert not untold_order(camera(), keys).any()
