"""Promise: frames that lie in a recording twice are told, and nothing is fitted to them."""

from dataclasses import replace
from weakref import ref

import numpy as np
import pytest

from analysis.mismatch import reading
from analysis.mismatch.copied import copies_of
from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.finding import Finding
from analysis.mismatch.reading import read
from analysis.mismatch.report.sentences import verdict
from analysis.mismatch.source import Source
from analysis.mismatch.spikes import Spikes, without_spikes
from dsis.camera import Camera
from dsis.errors import InputError
from dsis.recording import Recording
from mismatch_recordings import InMemory, camera, recorded

LEVELS = (100.0, 500.0, 1600.0)


def _recording() -> InMemory:
    return recorded(camera(), 4, levels=LEVELS)


def _copied(**copies: tuple[tuple[str, int], int]) -> InMemory:
    """Return a recording in which a frame of an exposure stands for one of another, or its own."""
    made = _recording()
    assert made.stacks is not None
    for name, ((other, source), frame) in copies.items():
        made.stacks[name.replace("_", "-")][frame] = made.stacks[other][source]
    return made


def _found(recording: InMemory) -> Finding:
    return find_mismatch(camera(), recording, vocabulary=frozenset())


def test_an_exposure_with_copies_is_said_and_left_out() -> None:
    found = _found(_copied(flat_1=(("flat-1", 0), 3)))
    says = [one for one in found.remarks if "byte-identical" in one]
    assert len(says) == 1
    assert says[0].endswith("flat-1 (frames 0 = 3).")
    assert "flat-1" not in found.proof.heldout_frames
    recording = _recording()
    others = tuple(e for e in recording.exposures if e.name != "flat-1")
    alone = _found(replace(recording, exposures=others))
    assert found.camera == alone.camera
    assert found.mismatches == alone.mismatches


def test_copies_across_exposures_are_told_with_both() -> None:
    found = _found(_copied(flat_0=(("flat-2", 5), 5)))
    assert any("flat-0 and flat-2 (1 frame in common)" in remark for remark in found.remarks)
    assert found.proof.heldout_frames.keys() == {"dark-0", "dark-1", "flat-1"}


def test_darks_that_are_left_out_are_not_said_to_be_missing() -> None:
    found = _found(_copied(dark_0=(("dark-1", 0), 0)))
    assert any(remark.startswith("No dark could be judged") for remark in found.remarks)
    assert not any("There are no darks" in remark for remark in found.remarks)


def test_a_recording_of_copies_is_refused_in_one_line() -> None:
    made = _recording()
    copies = {e.name.replace("-", "_"): ((e.name, 1), 2) for e in made.exposures}
    with pytest.raises(InputError, match=r"identical .*dark-0 \(frames 1 = 2\)") as said:
        read(_copied(**copies), camera())
    assert len(said.value.faults) == 1


def test_a_recording_of_scenes_is_not_said_to_have_darks_and_flats() -> None:
    made = _recording()
    assert made.stacks is not None
    made.stacks["flat-1"][3] = made.stacks["flat-1"][0]
    scene = replace(made.exposure("flat-1"), kind="scene")
    with pytest.raises(InputError, match="holds no dark or flat of two different frames"):
        _found(replace(made, exposures=(scene,)))


def test_frames_are_not_held_twice_while_they_are_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held: list[ref[Source]] = []

    def watched(recording: Recording, model: Camera) -> tuple[Recording, Source, Spikes | None]:
        assert all(source() is None for source in held)
        found = without_spikes(recording, model)
        held.append(ref(found[1]))
        return found

    monkeypatch.setattr(reading, "without_spikes", watched)
    read(_copied(flat_1=(("flat-1", 0), 3)), camera())
    assert len(held) == 2


def test_without_copies_nothing_is_read_anew_or_left_out() -> None:
    recording = _recording()
    taken = read(recording, camera())
    assert taken.stored is recording
    assert taken.remarks == ()


def test_frames_whose_codes_hardly_move_may_be_equal() -> None:
    """Noise of 0.1 DN in the middle of a code moves no pixel of most frames; that is no copy."""
    made = _recording()
    assert made.stacks is not None
    rng = np.random.default_rng(1)
    offsets = rng.integers(60, 64, made.stacks["dark-0"].shape[1:])
    still = offsets + 0.09 * rng.standard_normal(made.stacks["dark-0"].shape)
    made.stacks["dark-0"][:] = np.rint(still).astype(np.uint16)
    equal = [(a == b).all() for a in made.stacks["dark-0"] for b in made.stacks["dark-0"]]
    assert sum(equal) > len(made.stacks["dark-0"])  # more than each with itself
    assert copies_of(made, Source(made)) == ()
    assert read(made, camera()).stored is made


def _quiet(moved: np.ndarray) -> InMemory:
    """Return a recording whose first dark has noise of 0.05 DN, what moves it, and a hot pixel."""
    made = _recording()
    assert made.stacks is not None
    dark = made.stacks["dark-0"]
    noise = np.random.default_rng(3).normal(0, 0.05, dark.shape)
    dark[:] = np.rint(64 + noise + moved).astype(np.uint16)
    dark[:, 5, 7] = 300
    assert any((a == b).all() for k, a in enumerate(dark) for b in dark[:k])
    return made


def test_what_moves_whole_frames_or_patterns_may_make_frames_equal() -> None:
    """A black level that drifts by codes, and a pattern of two phases, beside little noise."""
    drift = np.array([0.1, 1.0, 0.0, -1.1, 0.0, 1.9, 0.1, 1.0])[:, np.newaxis, np.newaxis]
    rows, columns = np.indices(_recording().frame(_recording().exposures[0], 0).shape)
    signs = np.array([1, -1, 1, 1, -1, -1, 1, -1])[:, np.newaxis, np.newaxis]
    for moved in (drift, 2.0 * signs * (-1.0) ** (rows + columns)):
        made = _quiet(moved)
        assert copies_of(made, Source(made)) == ()


def test_a_match_says_that_copies_were_left_out() -> None:
    found = _found(_copied(flat_1=(("flat-1", 0), 3)))
    assert verdict(found)[0].startswith("As far as exposures without copies can show, simulation")
