"""Promise: why exposures are left out is said as it is, and how little a match may rest on."""

from dataclasses import replace

import numpy as np

from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.finding import Finding
from analysis.mismatch.report import headline
from analysis.mismatch.report.sentences import verdict
from mismatch_recordings import InMemory, camera, recorded

LEVELS = (100.0, 500.0, 1600.0)
AGREE = "Simulation and recording agree"
SHORT = 1000
"""A code that stands for all above, below the white level."""


def _recording() -> InMemory:
    return recorded(camera(), 4, levels=LEVELS)


def _found(recording: InMemory) -> Finding:
    return find_mismatch(camera(), recording, vocabulary=frozenset())


def _only(recording: InMemory, *names: str) -> InMemory:
    kept = tuple(e for e in recording.exposures if e.name in names)
    return replace(recording, exposures=kept)


def _said(found: Finding, start: str) -> list[str]:
    return [remark for remark in found.remarks if remark.startswith(start)]


def test_flats_that_stand_still_below_white_limit_a_match() -> None:
    recording = _recording()
    assert recording.stacks is not None
    recording.stacks["flat-2"][:] = np.minimum(recording.stacks["flat-2"], SHORT)
    found = _found(recording)
    (says,) = _said(found, "Flats stand still below the white level")
    assert f"at code {SHORT}" in says
    assert "4095" in says
    assert says.endswith("flat-2.")
    assert found.verdict == "match"
    assert verdict(found)[0].startswith("As far as levels below those that stand still can show, ")
    assert headline(found) == f"{AGREE} as far as levels below those that stand still can show"


def test_every_reason_has_its_own_sentence() -> None:
    recording = _recording()
    assert recording.stacks is not None
    recording.stacks["dark-0"][:] = 0
    recording.stacks["flat-2"][:] = 4095
    recording.stacks["flat-1"] = recording.stacks["flat-1"][:1]
    short = [
        replace(e, frames=e.frames[:1]) if e.name == "flat-1" else e for e in recording.exposures
    ]
    found = _found(replace(recording, exposures=tuple(short)))
    assert sorted(_said(found, "Exposures left out")) == [
        "Exposures left out, clipped at the white level: flat-2.",
        "Exposures left out, of a single frame that may be looked at: flat-1.",
        "Exposures left out, they hold code 0 only: dark-0.",
    ]
    assert verdict(found)[0].startswith(AGREE)


def test_one_level_without_a_dark_tells_no_slope() -> None:
    found = _found(_only(_recording(), "flat-1"))
    assert _said(found, "There is one level of light")
    assert verdict(found)[0].startswith("As far as one level of light without a dark can show, ")


def test_more_levels_or_a_dark_are_enough() -> None:
    for names in (("flat-1", "flat-2"), ("dark-0", "flat-1")):
        found = _found(_only(_recording(), *names))
        assert not _said(found, "There is one level of light"), names
        assert verdict(found)[0].startswith(AGREE)


def test_coloured_light_gives_a_mosaic_several_levels() -> None:
    recording = _only(recorded(camera(cfa="RGGB"), 4, levels=LEVELS), "flat-1")
    assert recording.stacks is not None
    mosaic = camera(cfa="RGGB")
    assert _said(find_mismatch(mosaic, recording, vocabulary=frozenset()), "There is one")
    red = recording.stacks["flat-1"][:, ::2, ::2]
    red[:] = 64 + (red - 64) // 2
    assert not _said(find_mismatch(mosaic, recording, vocabulary=frozenset()), "There is one")
