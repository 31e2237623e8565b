"""A sensor may have several interference lines: each is named, and none that is not there."""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
from numpy.typing import NDArray
from planter import Case, Choice, draw_case, plant
from planter.chain import frame_codes

from analysis.mismatch import Finding, find_mismatch
from analysis.mismatch.instance import instance, same_line
from dsis.camera import read_camera
from dsis.effects.bistable_pattern import BistablePattern
from dsis.effects.periodic_noise import PeriodicNoise
from dsis.recording import read_recording

pytestmark = pytest.mark.usefixtures("unproven")

KINDS = ("periodic_noise", "bistable_pattern")
LIKE_LINES = ("readout_memory", "crosstalk", "spatial_filtering", "row_noise", "pink_noise")
LINES = ((0.25, 0.25), (0.1875, -0.4))


def _frames(case: Case, exposure: int, frame: int) -> NDArray[np.uint16]:
    """Return frames of the planter with waves of free phase, dithered: 1/12 DN^2 more noise."""
    rng = np.random.default_rng([9, exposure, frame])
    codes = frame_codes(case, exposure, frame).astype(np.float64)
    y, x = np.arange(codes.shape[0])[:, np.newaxis], np.arange(codes.shape[1])
    size = 0.5 * case.segments[0].intercept ** 0.5
    for fx, fy in LINES:
        codes += size * np.cos(2 * np.pi * (fx * x + fy * y + rng.random()))
    codes += rng.uniform(-0.5, 0.5, codes.shape)
    return np.rint(codes).clip(0, case.white_level).astype(np.uint16)


def _found(folder: Path, *vocabulary: str) -> Finding:
    choice = Choice(cfa="MONO", segments=1, bit_depth=12, light=True, times="darks")
    case = draw_case(3, "tiny", choice)
    # Read noise far above the steps of the codes: dither then makes normal noise of it again.
    path = replace(case.segments[0], intercept=9.0)
    plant(folder, replace(case, segments=(path,)), _frames)
    camera, recording = read_camera(folder / "camera.toml"), read_recording(folder)
    return find_mismatch(camera, recording, seed=5, vocabulary=frozenset(vocabulary))


@pytest.mark.long
def test_two_lines_are_two_effects(tmp_path: Path) -> None:
    found = _found(tmp_path, *LIKE_LINES, *KINDS)
    assert [e.effect for e in found.omitted_physics] == ["periodic_noise"] * 2
    for line in LINES:
        assert any(
            same_line(line, e.parameters["frequency"].value, 48, 64)  # type: ignore[arg-type] # two numbers
            for e in found.omitted_physics
        )
    assert len(found.camera.effect) == 2
    assert {m.explained_by for m in found.mismatches} <= {"periodic_noise", None}


@pytest.mark.long
def test_lines_without_an_effect_for_them_are_no_memory(tmp_path: Path) -> None:
    found = _found(tmp_path, *LIKE_LINES, "bistable_pattern")
    assert not found.omitted_physics
    assert any(m.statistic.startswith("spectral_peak") for m in found.unexplained)


def test_an_effect_is_told_from_others_of_its_kind_by_its_frequency() -> None:
    wave = PeriodicNoise(amplitude_dn=1, frequency=LINES[0])
    assert instance("row_noise", None) == "row_noise"
    assert instance("periodic_noise", wave) != instance(
        "periodic_noise", PeriodicNoise(amplitude_dn=1, frequency=LINES[1])
    )
    assert instance("bistable_pattern", BistablePattern(amplitude_dn=1, frequency=LINES[0])) != (
        instance("periodic_noise", wave)
    )


def test_a_plane_of_a_mosaic_sees_frequencies_modulo_half_a_cycle() -> None:
    assert same_line((0.1, 0.2), (-0.1, -0.2), 100, 100)
    assert same_line((0.1, 0.2), (-0.4, 0.2), 100, 100, step=2)
    assert not same_line((0.1, 0.2), (-0.4, 0.2), 100, 100)
    assert not same_line((0.1, 0.2), (0.1, 0.2 + 2 / 100), 100, 100)
    assert same_line((0.1, 0.2), (0.1 + 1 / 200, 0.2), 100, 100)
