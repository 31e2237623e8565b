"""Promise: text claims no more than was done: words that were left out, searches that were not."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.diagnose import VOCABULARY
from analysis.mismatch.explain import explained
from analysis.mismatch.finding import Where
from analysis.mismatch.remarks import remarks_on_words
from analysis.mismatch.report import render
from analysis.mismatch.report.sentences import verdict
from analysis.mismatch.report.summary import summary
from analysis.mismatch.says import sentence
from mismatch_findings import FOUND, LINE, NOTHING

UNKNOWN = replace(NOTHING, verdict="unexplained", mismatches=(LINE,), unexplained=(LINE,))
ALLOWED = "no effect of the vocabulary that was allowed (without row noise and flicker)"


def test_effects_that_were_not_allowed_are_named_in_the_verdict() -> None:
    found = replace(UNKNOWN, without=("row_noise", "flicker"))
    assert ALLOWED in verdict(found)[0]
    assert ALLOWED in summary(found)
    assert ALLOWED in render(found, [], "")
    assert "no effect of the vocabulary is proven" in verdict(UNKNOWN)[0]
    assert "and 3 more)" in verdict(replace(UNKNOWN, without=tuple(sorted(VOCABULARY)[:9])))[0]


def test_effects_that_were_not_allowed_are_remarked_under_any_verdict() -> None:
    assert remarks_on_words(VOCABULARY, VOCABULARY) == ()
    (says,) = remarks_on_words(VOCABULARY - {"row_noise"}, VOCABULARY)
    assert says == "Not allowed to be named: row noise."
    assert remarks_on_words(frozenset(), VOCABULARY)[0].startswith("No physics was looked for")


def test_a_report_that_looked_for_no_physics_claims_no_search() -> None:
    searched, located = (render(replace(UNKNOWN, searched=own), [], "") for own in (True, False))
    for claim in ("Effects were added one at a time", "Parameters of effects were", "Gap closed"):
        assert claim in searched
        assert claim not in located
    assert "with the physics named" not in located
    assert "with the physics named, ready" in render(FOUND, [], "")


def test_alternatives_that_tie_say_what_would_settle_it() -> None:
    says = "explains the recording no better than rts"
    tie = replace(FOUND.undecided[0], why_not=says, would_settle="a stack of 50 darks")
    found = replace(FOUND, undecided=(tie,))
    wanted = f"{says}. What would settle it: a stack of 50 darks."
    assert wanted in summary(found)
    assert wanted in render(found, [], "")


@pytest.mark.parametrize("after", [-21.6, 0.5, 30.0])
def test_a_departure_has_its_sign_before_and_after(after: float) -> None:
    key = Key("pixel_variance", "exposure", "flat-0", "MONO", "")

    def state(z: float) -> Any:
        matrix, sd = np.zeros((0, 1)), np.zeros(0)
        null = SimpleNamespace(keys=[key], contrasts=SimpleNamespace(matrix=matrix), contrast_sd=sd)
        mismatch = SimpleNamespace(statistic=key.statistic, z=z)
        return SimpleNamespace(
            null=null, chances=np.zeros(1), departures=np.array([z]), mismatches=(mismatch,)
        )

    assert explained(state(-21.6), state(after), {}) == {key.statistic: (None, after)}


def test_lines_of_mean_frames_are_not_said_to_be_fixed() -> None:
    """Row noise leaves some in the mean of few frames; one exposure shows it best, not alone."""
    key = Key("fixed_row_variance", "offset", "", "MONO", "")
    says = sentence(key.statistic, key, 50.7, Where(("flat-2",)))
    assert says.startswith("The mean frames differ from row to row, alike at all signals")
    assert says.endswith("(clearest in flat-2).")


def test_a_sentence_holds_no_label_of_the_bank() -> None:
    where = Where(exposures=("dark-0",))
    said = {
        detail: sentence(name, Key(name, "contrast", "", "", detail), 9.0, where)
        for name, detail in (
            ("line_correlation", "all rows 1"),
            ("column_variance_spread", "all"),
            ("variance_spread", "with the signal"),
        )
    }
    assert "(all" not in " ".join(said.values())
    assert "(1 pixel of one colour apart along rows)" in said["all rows 1"]
    assert "(with the signal)" in said["with the signal"]
