"""Rows of two fields whose light differs anew in each frame: no lamp flickers so."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.candidates import CANDIDATES
from dsis.effects.line_flicker import LineFlicker
from mismatch_recordings import InMemory, camera, recorded

ROWS, LEVELS = 64, (250.0, 900.0)
BLACK = 64


def _of_two_fields(recording: InMemory, size: float, seed: int) -> InMemory:
    """Return the recording with even rows lighter by a share in each frame, odd ones darker."""
    rng = np.random.default_rng(seed)
    assert recording.stacks is not None
    stacks = {}
    for name, codes in recording.stacks.items():
        share = size * rng.standard_normal((len(codes), 1, 1)) * (name[:4] == "flat")
        sign = np.where(np.arange(codes.shape[1]) % 2 == 0, 1.0, -1.0)[:, np.newaxis]
        light = (codes.astype(np.float64) - BLACK) * (1 + share * sign)
        stacks[name] = np.floor(BLACK + light + rng.random(codes.shape)).astype(np.uint16)
    return replace(recording, stacks=stacks)


@pytest.mark.parametrize(
    ("cycles", "sane"), [(7.3, True), (31.4, True), (31.6, False), (32.0, False), (32.3, False)]
)
def test_bands_of_a_lamp_are_wider_than_a_row(cycles: float, sane: bool) -> None:
    layout: Any = SimpleNamespace(rows=ROWS, seen_cycles=lambda c: c)
    lamp = LineFlicker(depth_percent=0.1, cycles_per_frame=cycles)
    assert CANDIDATES["line_flicker"].sane(layout, lamp) is sane


@pytest.mark.parametrize("cycles", [5.4, 29.7])
def test_a_line_that_grows_with_light_is_where_flats_show_it(cycles: float) -> None:
    """Without its word: darks would show their largest chance."""
    hidden = LineFlicker(depth_percent=0.3, cycles_per_frame=cycles)
    rec = recorded(camera(hidden), 3, rows=ROWS, levels=LEVELS)
    found = find_mismatch(camera(), rec, vocabulary=frozenset())
    (one,) = (m for m in found.unexplained if m.statistic == "row_spectrum_peak")
    assert one.where.spatial_frequency is not None
    assert one.where.spatial_frequency[1] == pytest.approx(cycles / ROWS, abs=0.5 / ROWS)


@pytest.mark.long
@pytest.mark.usefixtures("unproven")
def test_two_fields_are_located_and_left_open() -> None:
    rec = _of_two_fields(recorded(camera(), 5, rows=ROWS, levels=LEVELS), 0.002, 6)
    found = find_mismatch(camera(), rec)
    assert not found.omitted_physics
    (one,) = (m for m in found.unexplained if m.statistic == "row_spectrum_peak")
    assert one.where.kind == "flat"
    assert one.where.spatial_frequency == (0.0, 0.5)
