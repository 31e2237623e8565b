"""Phases that are kept but for their sign, and free ones: closed forms, and data of known law."""

import numpy as np
import pytest
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch import phaselaw
from analysis.mismatch.phaselaw import (
    _of_free,
    _of_kept,
    kept_rather_than_free,
    moving_on,
    there,
    turns_of,
)

Complex = NDArray[np.complex128]


def _noise(rng: np.random.Generator, frames: int) -> Complex:
    """Return noise of mean square 1."""
    made: Complex = (rng.normal(size=frames) + 1j * rng.normal(size=frames)) / np.sqrt(2)
    return made


@pytest.mark.parametrize("amplitude", [0.5, 1.5, 4.0])
def test_two_frames_are_told_as_their_difference_is(amplitude: float) -> None:
    """What both share drops out: d = a (s1 - s2) u + noise, of variance 2."""
    found = np.array([0.7 + 0.2j, -1.9 - 1.1j])
    difference = found[0] - found[1]
    turns = np.pi * np.arange(phaselaw._PHASES) / phaselaw._PHASES
    kept = [
        np.mean([np.exp(-(abs(difference - sign * amplitude * np.exp(1j * turn)) ** 2) / 2)
                 for sign in (0, 0, -2, 2)])
        for turn in turns
    ]  # fmt: skip
    around = 2 * np.pi * np.arange(400) / 400
    circle = np.exp(1j * around[:, np.newaxis]) - np.exp(1j * around)
    free = np.mean(np.exp(-(np.abs(difference - amplitude * circle) ** 2) / 2))
    one, other = _of_kept(found, amplitude), _of_free(found, amplitude)
    assert one - other == pytest.approx(np.log(kept) - np.log(free), abs=0.01)


def test_one_frame_says_nothing() -> None:
    assert kept_rather_than_free([np.array([3.0 + 1.0j])], [2.0]) == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("kept", [True, False])
def test_what_has_one_phase_is_told_from_what_has_any(kept: bool) -> None:
    """Six frames of six exposures, the line at two of its errors in each, beside fixed patterns."""
    rng = np.random.default_rng(7)
    told = []
    for _ in range(20):
        found, turn = [], np.exp(2j * np.pi * rng.random())
        for _ in range(6):
            sign = rng.choice([-1, 1], 6) * turn
            phases = sign if kept else np.exp(2j * np.pi * rng.random(6))
            found.append(2.0 * phases + _noise(rng, 6) + 5.0 * _noise(rng, 1))
        told.append(kept_rather_than_free(found, [2.0] * 6))
    wrong = [one for one in told if (one > 0) != kept]
    assert len(wrong) <= 1
    assert abs(np.median(told)) > 5


def test_a_strong_line_is_no_harder_to_tell_than_one_that_is_just_clear() -> None:
    rng = np.random.default_rng(8)
    signs = np.array([1, -1, -1, 1, -1, 1])
    found = 400 * signs * np.exp(0.3j) + _noise(rng, 6)
    assert kept_rather_than_free([found], [400.0]) > 5
    free = 400 * np.exp(2j * np.pi * rng.random(6)) + _noise(rng, 6)
    assert kept_rather_than_free([free], [400.0]) < -5


def test_noise_alone_tells_nothing() -> None:
    rng = np.random.default_rng(9)
    found = [_noise(rng, 8) for _ in range(6)]
    assert abs(kept_rather_than_free(found, [0.1] * 6)) < 0.2


@pytest.mark.parametrize("frames", [16, 64])
def test_of_many_frames_what_they_share_is_integrated_as_finely_as_it_is_known(
    frames: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(10)
    found = 1.5 * rng.choice([-1, 1], frames) * np.exp(0.7j) + _noise(rng, frames)
    one, other = _of_kept(found, 1.5), _of_free(found, 1.5)
    monkeypatch.setattr(phaselaw, "_STEP", 0.05)
    fine, finer = _of_kept(found, 1.5), _of_free(found, 1.5)
    assert one.max() - other == pytest.approx(fine.max() - finer, abs=0.3)


@pytest.mark.parametrize("frames", [255, 257, 1500])
def test_any_number_of_frames_is_as_likely_as_their_cosh_says(frames: int) -> None:
    rng = np.random.default_rng(frames)
    found, a = _noise(rng, frames), 1.2
    shared, squares = phaselaw._shared(found, a)
    (own,) = _of_kept(found, a, (1.0 + 0.0j,))
    along = 2 * a * (found[:, np.newaxis] - shared).real
    cosh = np.logaddexp(along, -along) - np.log(2)
    apart = (np.abs(found[:, np.newaxis] - shared) ** 2).sum(0) + frames * a**2
    assert squares == pytest.approx(-apart, rel=1e-9)
    assert own == pytest.approx(scipy.special.logsumexp(cosh.sum(0) - apart), rel=1e-9)


@pytest.mark.parametrize("amplitude", [3.0, 10.0, 20.0, 100.0])
def test_phases_at_random_are_not_taken_for_ones_that_move_on(amplitude: float) -> None:
    """However strong the line is: some share of a turn fits six phases within some tenths."""
    rng, frames = np.random.default_rng(int(amplitude)), np.arange(6.0)
    told, steady = [], []
    for _ in range(60):
        phases = np.exp(2j * np.pi * rng.random(6))
        moving = np.exp(2j * np.pi * (rng.random() * frames + rng.random()))
        for found, some in ((phases, told), (moving, steady)):
            own = [amplitude * found + _noise(rng, 6)]
            free = there(own, [amplitude], kept=False, real=False)
            some.append(moving_on(own, [frames], [amplitude]) - free)
    assert np.mean(np.array(told) > np.log(20)) <= 0.1
    assert np.median(told) < 0 < np.median(steady)


def test_turns_are_summed_as_one_by_one() -> None:
    """By the definition: every share of a turn over every frame, what is shared taken off."""
    rng = np.random.default_rng(4)
    numbers = [np.array([2.0, 3.0, 7.0, 30.0]), np.arange(12.0), np.array([5.0])]
    found = [1.5 * _noise(rng, own.size) for own in numbers]
    amplitudes = [1.2, 9.0, 0.4]
    line = np.zeros(phaselaw._STRENGTHS.size)
    for own, number, amplitude in zip(found, numbers, amplitudes, strict=True):
        count = phaselaw._TURNS * int(np.ptp(number) + 1)
        turns = np.exp(2j * np.pi * np.outer(np.arange(count) / count, number))
        turns -= turns.mean(1, keepdims=True)
        for i, strength in enumerate(phaselaw._STRENGTHS):
            scale = phaselaw._MOST / max(strength * amplitude, phaselaw._MOST)
            a, seen = strength * amplitude * scale, np.abs(np.conj(turns) @ own) * scale
            bessel = np.log(scipy.special.i0e(2 * a * seen)) + 2 * a * seen
            each = bessel - a**2 * (np.abs(turns) ** 2).sum(1)
            line[i] += scipy.special.logsumexp(each) - np.log(count)
    expected = scipy.special.logsumexp(line) - np.log(line.size)
    assert moving_on(found, numbers, amplitudes) == pytest.approx(expected, abs=1e-9)


def test_a_turn_is_told_between_the_shares_that_are_tried() -> None:
    """Rife and Boorstyn's error (1974) in white noise: a fifth of the distance of two shares."""
    rng = np.random.default_rng(6)
    number, amplitude, turn = np.arange(16.0), 5.0, 0.3367
    off = []
    for _ in range(200):
        start = np.exp(2j * np.pi * rng.random())
        line = amplitude * start * np.exp(2j * np.pi * turn * number)
        found, error = turns_of(line + _noise(rng, number.size), number, amplitude)
        off.append((found - turn) / error)
    assert 0.7 < np.std(off) < 1.4
    assert abs(np.mean(off)) < 0.4
    assert error < 0.2 / (phaselaw._TURNS * number.size)


@pytest.mark.parametrize(("kept", "real"), [(True, False), (False, False), (True, True)])
def test_exposures_add_up(kept: bool, real: bool) -> None:
    """Two exposures of one strength and phase: the mean of what both say of each."""
    rng = np.random.default_rng(5)
    found, amplitudes = [2 * _noise(rng, 5), _noise(rng, 4)], [1.4, 0.7]
    alone = [
        phaselaw.there_in(own, a, kept=kept, real=real)
        for own, a in zip(found, amplitudes, strict=True)
    ]
    both = np.log(np.mean(np.exp(alone[0]) * np.exp(alone[1])))
    assert there(found, amplitudes, kept=kept, real=real) == pytest.approx(both, rel=1e-9)
