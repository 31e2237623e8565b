"""Promise: what is a copy of a frame is one question, with one answer for all that ask it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from weakref import ref

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.reading import read
from analysis.photon_transfer import fit_camera
from dsis.recording.copies import Same, copies_of, identity_of
from mismatch_recordings import InMemory, camera, recorded

Frames = NDArray[np.uint16]
BLACK, LEVELS = 64.0, (100.0, 500.0, 3500.0)
DRIFT = np.array([0.0, 1.0, 0.0, -1.0, 0.0, 2.0, 0.0, 1.0])
HALF_A_CODE = 0.5  # that rounding hides
TELLS = "noise cannot repeat itself"


def _recording() -> InMemory:
    return _of_files(recorded(camera(black=BLACK), 4, levels=LEVELS), lambda _, number: number)


def _of_files(made: InMemory, file: Callable[[str, int], int]) -> InMemory:
    """Return a recording each of whose frames is a file of its exposure, by name and number."""
    assert made.stacks is not None
    exposures = [
        replace(e, frames=tuple(Path(f"{e.name}/{file(e.name, k)}") for k in range(many)))
        for e in made.exposures
        for many in [len(made.stacks[e.name])]
    ]
    return replace(made, exposures=tuple(exposures))


def _quiet() -> InMemory:
    """Return a recording whose darks have noise of 0.08 DN, and a black that drifts by codes."""
    made = _recording()
    assert made.stacks is not None
    rng = np.random.default_rng(3)
    for dark in (made.stacks["dark-0"], made.stacks["dark-1"]):
        offsets = BLACK + DRIFT[:, np.newaxis, np.newaxis] + rng.normal(0, 0.08, dark.shape)
        dark[:] = np.rint(offsets).astype(np.uint16)
        dark[:, 5, 7] += 200
        assert len({frame.tobytes() for frame in dark}) < len(dark)
    stated = made.sensor.model_copy(update={"black_level": BLACK - 9})
    return replace(made, sensor=stated)


def _asked(recording: InMemory) -> tuple[tuple[str, ...], ...]:
    """Return the remarks of all that ask, in the order: remarks, fit, diagnosis."""
    return recording.remarks(), fit_camera(recording).remarks, read(recording, camera()).remarks


def test_quiet_darks_that_drift_by_codes_tell_the_black_level() -> None:
    """Fit left them out as copies, and took the stated black level, which is 9 DN off."""
    made = _quiet()
    fit = fit_camera(made)
    assert abs(fit.black_dn - BLACK - DRIFT.mean()) < HALF_A_CODE
    assert fit.black_se_dn is not None
    for remarks in _asked(made):
        assert not any(TELLS in one or "bit for bit" in one for one in remarks)


def test_a_black_level_within_their_drift_is_not_contradicted() -> None:
    """Their mean is known as well as frames that move as a whole tell it, not as pixels do."""
    made = _quiet()
    stated = BLACK + DRIFT.mean() - 2 * DRIFT.std(ddof=1) / DRIFT.size**0.5 - HALF_A_CODE
    near = made.sensor.model_copy(update={"black_level": float(stated)})
    for remarks in _asked(replace(made, sensor=near)):
        assert not any("black_level is given as" in one for one in remarks)
    assert any("black_level is given as" in one for one in fit_camera(made).remarks)


@pytest.mark.parametrize("name", ["dark-0", "flat-0", "flat-2"])
@pytest.mark.parametrize("frames", [[0, 1, 2, 3, 1], [0, 1, 0, 1]])
def test_a_copy_is_told_by_all_that_ask(name: str, frames: list[int]) -> None:
    """In darks, and in flats whose noise of 40 DN spreads over more codes than there are frames."""
    made = _recording()
    assert made.stacks is not None
    made.stacks[name] = made.stacks[name][frames]
    for remarks in _asked(_of_files(made, lambda _, number: number)):
        (says,) = [one for one in remarks if TELLS in one]
        assert name in says


def test_a_file_that_is_listed_twice_is_a_copy_however_quiet_it_is() -> None:
    made = _quiet()
    assert made.stacks is not None
    made.stacks["dark-0"][1] = made.stacks["dark-0"][0]
    twice = _of_files(made, lambda name, number: 0 if (name, number) == ("dark-0", 1) else number)
    remarks, fit, diagnosis = _asked(twice)
    says = "the same file is listed more than once: 0 is dark-0 frame 0, dark-0 frame 1"
    assert says in remarks
    assert says in fit
    assert any("dark-0 (frames 0 = 1)" in one for one in diagnosis)


def test_one_picture_is_said_to_tell_no_noise() -> None:
    made = _recording()
    assert made.stacks is not None
    made.stacks["flat-0"][:] = made.stacks["flat-0"][0].copy()
    remarks, fit, _ = _asked(made)
    says = "flat-0: its 8 frames are byte-identical, temporal noise cannot be measured"
    assert says in remarks
    assert says in fit
    assert any("equal the frame before" in one and "flat-0" in one for one in fit)


@dataclass
class _Streamed:
    """A recording of one exposure, which counts how many of its frames are held at once."""

    make: Callable[[int], Frames]
    frames_of_it: int = 20
    most: int = 0

    @property
    def exposures(self) -> list[SimpleNamespace]:
        return [SimpleNamespace(name="one", frames=range(self.frames_of_it))]

    def frames(self, exposure: SimpleNamespace, /) -> Iterator[Frames]:
        held = []
        for number in exposure.frames:
            frame = self.make(number)
            held.append(ref(frame))
            self.most = max(self.most, sum(one() is not None for one in held))
            yield frame
            del frame

    def copies(self) -> tuple[Same, ...]:
        frames = self.frames(self.exposures[0])
        return copies_of(self, {("one", k): identity_of(one) for k, one in enumerate(frames)})


def _noise(rows: int, columns: int, *, again: int = 10) -> Callable[[int], Frames]:
    """Return frames of noise; each that is `again` frames on is a copy."""
    return lambda number: np.rint(
        np.random.default_rng(number % again).normal(1000.0, 9.0, (rows, columns))
    ).astype(np.uint16)


def test_of_an_exposure_two_frames_are_held_at_most() -> None:
    streamed = _Streamed(_noise(64, 80))
    assert len(streamed.copies()) == 10
    assert streamed.most <= 2  # one that is looked at, and the next


@pytest.mark.parametrize("size", [(8, 8), (1, 128), (128, 1), (2, 64), (1200, 1100)])
def test_copies_are_told_in_frames_of_any_size(size: tuple[int, int]) -> None:
    """Of few pixels, of one line, and of more than are compared."""
    assert len(_Streamed(_noise(*size)).copies()) == 10


def _phases(frequency: tuple[float, float]) -> Callable[[int], Frames]:
    """Return frames of a cosine of 9 DN whose sign flips, and little else: two are unequal."""
    y, x = np.indices((48, 64))
    wave = 9.0 * np.cos(2 * np.pi * (frequency[0] * x + frequency[1] * y) + 0.3)
    signs = np.random.default_rng(5).choice([-1.0, 1.0], 20)
    return lambda number: np.rint(1000.0 + signs[number] * wave).astype(np.uint16)


@pytest.mark.parametrize("frequency", [(0.5, 0.5), (0.25, 0.25), (0.125, 0.31), (0.03, 0.02)])
def test_two_phases_of_a_pattern_are_no_copies(frequency: tuple[float, float]) -> None:
    assert _Streamed(_phases(frequency)).copies() == ()


def test_an_edge_between_two_codes_makes_no_copies() -> None:
    """A black level at half a code lets each pixel toggle; a code's middle lets none."""
    levels = (64.0, 64.5, 64.0, 65.0, 64.5)

    def make(number: int) -> Frames:
        noise = np.random.default_rng(number).normal(0, 0.05, (48, 64))
        noise[3, 4] += 50
        return np.rint(levels[number] + noise).astype(np.uint16)

    assert _Streamed(make, len(levels)).copies() == ()
