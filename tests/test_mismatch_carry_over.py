"""A converter of steps carries its residue over: seen, told from what couples in proportion, named.

The residue is planted by the planter, sample by sample, with comparators that are noisy: another
law than the one that is fitted.
"""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
import scipy.stats
from numpy.typing import NDArray
from planter import Choice, draw_case, plant
from planter.case import Effect as Planted

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.carryover import AXES, CarryOver, CarryOverSums
from analysis.mismatch.bank.sawtooth import PLACES, Samples, profile, sawteeth
from analysis.mismatch.candidates.candidate import Proposal
from analysis.mismatch.memory import Memory
from analysis.mismatch.observe import observe
from analysis.mismatch.rank import SURE_GAIN, ranked
from analysis.mismatch.source import Source
from analysis.mismatch.state import Setting, State
from analysis.mismatch.taking import layout_of
from dsis.camera import read_camera
from dsis.recording import read_recording
from exposing import effect
from mismatch_recordings import camera as plain
from mismatch_recordings import recorded

pytestmark = pytest.mark.usefixtures("unproven")

Frames = NDArray[np.float64]
LEVELS = ((15.0, 3.0), (139.0, 7.0), (460.0, 12.0), (900.0, 16.0))  # mean and noise, DN
SHAPE = (6, 60, 80)
PERIOD, STEP_DN, AT = 64, 1.5, 11.0
RIVALS = ("readout_memory", "crosstalk", "spatial_filtering", "row_noise", "pink_noise")


def _white(seed: int) -> list[Frames]:
    rng = np.random.default_rng(seed)
    return [mean + sd * rng.standard_normal(SHAPE) for mean, sd in LEVELS]


def _carrying(frames: Frames) -> Frames:
    """Return frames whose samples have the residue of the sample to their left."""
    made = frames.copy()
    phase = (frames[:, :, :-1] - AT) / PERIOD
    made[:, :, 1:] += STEP_DN * (phase - np.floor(phase) - 0.5)
    return made


def _watched(levels: list[Frames]) -> list[tuple[CarryOver, Samples]]:
    watched = []
    for frames in levels:
        own = CarryOver(keep=True)
        assert len(list(own.watching(np.rint(frames)))) == len(frames)
        kept = own.samples("rows")
        assert kept is not None
        watched.append((own, kept))
    return watched


def _samples(levels: list[Frames]) -> list[Samples]:
    return [kept for _, kept in _watched(levels)]


def _observed(levels: list[Frames]) -> tuple[dict[str, tuple[float, float]], list[Samples]]:
    sums, watched = CarryOverSums(), _watched(levels)
    for own, _ in watched:
        sums.add(own)
    return sums.numbers(), [kept for _, kept in watched]


def test_white_noise_carries_nothing_over() -> None:
    z = []
    for seed in range(60):
        numbers, _ = _observed(_white(seed))
        z.append([value / error for value, error in numbers.values()])
    spread = np.array(z)
    known = np.isfinite(spread).all(0)
    assert known.sum() >= 16  # of 32: long waves are lines over the codes that noise covers
    assert 0.85 < spread[:, known].std() < 1.1
    assert scipy.stats.kstest(spread[:, known][:, 0], "norm").pvalue > 1e-3


@pytest.mark.parametrize("share", [0.2, -0.2])
def test_memory_in_proportion_is_none_of_the_code(share: float) -> None:
    levels = []
    for frames, (mean, _) in zip(_white(7), LEVELS, strict=True):
        made = frames.copy()
        made[:, :, 1:] += share * (frames[:, :, :-1] - mean)
        levels.append(made)
    numbers, _ = _observed(levels)
    assert max(abs(v / e) for v, e in numbers.values() if np.isfinite(v)) < 4.5


@pytest.mark.parametrize("shape", [(6, 60, 80), (4, 60, 400), (4, 200, 100)])
@pytest.mark.parametrize("share", [1.0, 3.0])
def test_lines_and_frames_that_move_are_none_either(
    shape: tuple[int, int, int], share: float
) -> None:
    """Row noise as strong as the pixels' or stronger, and light that flickers by 3 %."""
    z = []
    for seed in range(6):
        rng = np.random.default_rng([seed, *shape])
        levels = [
            mean * (1 + 0.03 * rng.standard_normal((shape[0], 1, 1)))
            + sd * rng.standard_normal(shape)
            + share * sd * rng.standard_normal((*shape[:2], 1))
            for mean, sd in LEVELS
        ]
        numbers, _ = _observed(levels)
        z += [value / error for value, error in numbers.values() if np.isfinite(value)]
    assert len(z) > 100
    assert np.std(z) < 1.1
    assert np.max(np.abs(z)) < 4.5


def test_a_residue_is_found_with_its_period_step_and_place() -> None:
    numbers, samples = _observed([_carrying(frames) for frames in _white(9)])
    z = {name: abs(v / e) for name, (v, e) in numbers.items() if np.isfinite(v)}
    assert max(z.values()) > 8
    assert max(v for name, v in z.items() if "along columns" in name) < 4.5
    best = max(sawteeth(tuple(samples)), key=lambda one: one.chi2)
    assert best.period == PERIOD
    assert abs((best.at_code - AT + PERIOD / 2) % PERIOD - PERIOD / 2) <= PERIOD / 32
    # Codes have what they carry themselves, and are rounded: the step is blurred. It is a start.
    assert best.step_dn == pytest.approx(STEP_DN, rel=0.3)


def test_a_residue_whose_steps_noise_does_not_reach_is_found_by_its_slope() -> None:
    """Between steps it goes in proportion, d / P a code; how far its steps are the levels tell."""
    rng = np.random.default_rng(11)
    between = [(AT + PERIOD * k + place, 3.0) for k, place in ((0, 20.0), (1, 32.0), (4, 45.0))]
    levels = [_carrying(mean + sd * rng.standard_normal((6, 200, 200))) for mean, sd in between]
    samples = _samples(levels)
    hidden = max(sawteeth(tuple(samples)), key=lambda one: one.chi2)
    shown = max(sawteeth(tuple(samples), whole=True), key=lambda one: one.chi2)
    pairs = sum(own.moved.size for own in samples)
    assert hidden.chi2 < 30
    assert shown.chi2 == pytest.approx(pairs * (STEP_DN / PERIOD) ** 2, rel=0.5)
    assert shown.step_dn / shown.period == pytest.approx(STEP_DN / PERIOD, rel=0.3)


def test_white_noise_has_no_slope() -> None:
    samples = _samples(_white(12))
    assert max(one.chi2 for one in sawteeth(tuple(samples), whole=True)) < 30


@pytest.mark.long
def test_the_best_of_many_residues_pays_for_the_others() -> None:
    """Of white noise alone it gains 3 nats more than its price once in 20 times (e to the -3)."""
    gains, free = [], 1
    for seed in range(200):
        samples = _samples(_white(1000 + seed))
        tried = sawteeth(tuple(samples))
        one = Proposal(
            effect("adc_memory", step_dn=1.0, period_codes=64, at_code=1.0, along="rows"),
            ("step_dn", "at_code"),
            best_of=PLACES * len(tried),
        )
        best = max(own.chi2 for own in tried) / 2
        gains.append(best - one.price)
        free += best - len(one.free) > 3
    assert scipy.stats.binomtest(sum(g > 3 for g in gains), 200, 0.05).pvalue > 0.01
    assert free > 60  # if each were the only one


def test_spikes_do_not_hide_a_residue() -> None:
    """One spike in each level leaves what was found: of 144000 samples it is one."""
    levels = [_carrying(frames) for frames in _white(9)]
    clean, samples = _observed(levels)
    for i, frames in enumerate(levels):
        frames[i, 20 + i, 30] += 2500.0
    seen, struck = _observed(levels)
    known = [name for name, (v, _) in clean.items() if np.isfinite(v)]
    away = [(seen[name][0] - clean[name][0]) / clean[name][1] for name in known]
    assert np.abs(away).max() < 1
    assert all(seen[name][1] < 1.05 * clean[name][1] for name in known)
    one, other = (
        max(sawteeth(tuple(own)), key=lambda tooth: tooth.chi2) for own in (samples, struck)
    )
    assert other.period == one.period
    assert other.chi2 == pytest.approx(one.chi2, rel=0.15)


def test_the_profile_is_the_sawtooth() -> None:
    levels = [(mean, 20.0) for mean in (120.0, 150.0, 180.0)]
    rng = np.random.default_rng(10)
    samples = _samples(
        [_carrying(mean + sd * rng.standard_normal((6, 200, 200))) for mean, sd in levels]
    )
    parts = 16
    seen, error = profile(samples, PERIOD, parts)
    middles = (np.arange(parts) + 0.5) * PERIOD / parts - 0.5
    phase = (middles - AT) / PERIOD
    expected = STEP_DN * (phase - np.floor(phase) - 0.5)
    away = np.abs((middles - AT + PERIOD / 2) % PERIOD - PERIOD / 2) > PERIOD / parts
    rest = ((seen - seen[away].mean()) - (expected - expected[away].mean()))[away]
    assert np.abs(rest / error[away]).max() < 4
    assert np.corrcoef(seen[away], expected[away])[0, 1] > 0.75


def test_frames_of_one_kind_say_nothing() -> None:
    own = CarryOver(keep=True)
    list(own.watching([np.full((8, 8), 100.0)] * 4))
    assert all(own.samples(axis) is None for axis in AXES)
    sums = CarryOverSums()
    sums.add(own)
    assert all(np.isnan(value) for value, _ in sums.numbers().values())


def _planted(folder: Path, cfa: str) -> None:
    choice = Choice(cfa=cfa, segments=1, bit_depth=12, light=True, times="darks")
    case = draw_case(3, "small", choice)
    planted = {"period_codes": 64, "at_code": 20.0, "step_dn": 1.5, "along": "rows"}
    case = case.having(Planted("adc_memory", planted))
    plant(folder, case)


@pytest.mark.long
def test_in_a_mosaic_it_is_named_with_its_numbers(tmp_path: Path) -> None:
    _planted(tmp_path, "RGGB")
    camera, recording = read_camera(tmp_path / "camera.toml"), read_recording(tmp_path)
    found = find_mismatch(camera, recording, seed=5, vocabulary=frozenset({"adc_memory", *RIVALS}))
    assert [e.effect for e in found.omitted_physics] == ["adc_memory"]
    own = found.omitted_physics[0]
    assert own.parameters["period_codes"].value == 64
    for name, truth in (("step_dn", 1.5), ("at_code", 20.0)):
        parameter = own.parameters[name]
        assert abs(parameter.value - truth) < 4 * parameter.standard_error  # type: ignore[operator] # fitted
    assert own.heldout_gain.ci95[0] > 0


@pytest.mark.long
def test_beside_memory_of_the_noise_a_residue_is_told_by_what_follows_codes() -> None:
    """What both make alike is left, for a filter may as well: neither of these is claimed."""
    residue = effect("adc_memory", period_codes=64, at_code=39.0, step_dn=1.5, along="rows")
    own = {"fraction": 0.03, "lag_pixels": 1, "along": "rows", "remembers": "noise"}
    memory = effect("readout_memory", **own)
    parts = ((0.5, 9.0, None),)
    levels = 100.0, 500.0, 1500.0, 3000.0
    true = plain(residue, memory, segments=parts)
    recording = recorded(true, 3, rows=96, columns=100, frames=10, levels=levels)
    words = frozenset({"adc_memory", *RIVALS})
    found = find_mismatch(plain(segments=parts), recording, seed=5, vocabulary=words)
    assert [e.effect for e in found.omitted_physics] == ["adc_memory"]
    step = found.omitted_physics[0].parameters["step_dn"]
    assert abs(step.value - 1.5) < 2 * step.standard_error  # type: ignore[operator] # fitted
    assert {e.effect for e in found.undecided} >= {"spatial_filtering", "readout_memory"}
    assert "carry_over" not in {m.statistic for m in found.unexplained}


@pytest.mark.long
def test_levels_that_are_off_call_for_a_trial(tmp_path: Path) -> None:
    """Each level has the mean residue of its codes: that may be all that is located."""
    _planted(tmp_path, "MONO")
    camera, recording = read_camera(tmp_path / "camera.toml"), read_recording(tmp_path)
    source = Source(recording)
    numbers = {e.name: tuple(range(len(e.frames))) for e in recording.exposures}
    layout = layout_of(recording, numbers, source.frames)
    seen = observe(layout, lambda name: source.frames(name, numbers[name]), keep=True)
    state = State.of(Setting.of(layout, seen, None, 1, 1), camera, lambda: None)
    assert "level" in {m.statistic for m in state.mismatches}
    levels = replace(state, mismatches=tuple(m for m in state.mismatches if m.statistic == "level"))
    found = ranked(levels, ["adc_memory"], Memory(), lambda: None)
    assert found
    assert found[0].gain > SURE_GAIN
