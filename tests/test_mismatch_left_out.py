"""Promise: exposures that are left out prove nothing, and what a recording lacks is said."""

from dataclasses import replace

from analysis.mismatch.diagnose import find_mismatch
from analysis.mismatch.report import headline
from analysis.mismatch.report.sentences import verdict
from mismatch_recordings import camera, recorded

LEVELS = (100.0, 500.0, 1600.0)
TOLD_APART = 0.75  # area under the curve; of 0.5 by chance


def test_copies_of_one_frame_prove_nothing() -> None:
    recording = recorded(camera(), 4, levels=LEVELS)
    assert recording.stacks is not None
    recording.stacks["flat-1"][:] = recording.stacks["flat-1"][0].copy()
    found = find_mismatch(camera(), recording, vocabulary=frozenset())
    assert found.verdict == "match"
    assert any("flat-1" in remark for remark in found.remarks)
    assert found.proof.heldout_frames.keys() == {"dark-0", "dark-1", "flat-0", "flat-2"}
    assert found.proof.classifier_auc is not None
    assert found.proof.classifier_auc.before < TOLD_APART


def test_darks_alone_do_not_judge_light() -> None:
    recording = recorded(camera(), 4, levels=LEVELS)
    assert recording.stacks is not None
    darks = replace(recording, exposures=recording.of_kind("dark"))
    found = find_mismatch(camera(), darks, vocabulary=frozenset())
    assert any("No flat could be judged" in remark for remark in found.remarks)
    assert found.verdict == "match"
    assert verdict(found) == ("In darks simulation and recording agree; no flat could be judged.",)
    assert headline(found) == "In darks simulation and recording agree"
