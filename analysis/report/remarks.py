"""What a reader of a report must know before believing it: counts and remarks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.inference.sentences import SIGNIFICANT
from analysis.models import p910
from analysis.rejection import Rejected
from analysis.repeatability import Retest
from analysis.scale import Scale
from analysis.screening import THRESHOLD_SD
from analysis.sos import SUSPICIOUS, SosFit
from analysis.votes import SCORED_KINDS, Indexed, complete, index_votes
from dsis.session.robots import ROBOT

FEW_OBSERVERS = 15  # BT.500: fewer make an informal test
MANY_REMOVED = 0.10
FEW_SEQUENCES = 20  # below, the standard error of a correlation of 0.7 is over 0.11
NAMES_LISTED = 6


@dataclass(frozen=True)
class Findings:
    """What other parts of the analysis found and a reader must know."""

    sos: SosFit
    retest: Retest | None
    order: pd.DataFrame
    models: tuple[str, ...]
    rejected: tuple[Rejected, ...]
    threshold: float
    passes: int


@dataclass(frozen=True)
class Counts:
    """Numbers of votes, by what became of them; each vote is counted once."""

    rows: int
    scored: int
    invalid: int
    training: int
    dummy: int
    missing: int
    observers: int
    stimuli: int
    references: int
    simulated_share: float

    def not_scored(self) -> list[tuple[int, str]]:
        """Return (number, what they are) of the votes that are not scored."""
        kinds = (
            (self.invalid, "invalid (dropped frames, repeated later)"),
            (self.training, "training"),
            (self.dummy, "dummy"),
            (self.missing, "not given"),
        )
        return [(number, what) for number, what in kinds if number]


def count_votes(votes: pd.DataFrame) -> Counts:
    """Count the rows of a table of votes; `simulated_share` is that of the scored ones."""
    whole = complete(votes)
    valid, given = whole["valid"], whole["vote"].notna()
    judged = whole["kind"].isin(SCORED_KINDS)
    scored = whole[valid & judged & given]
    stimuli = scored.drop_duplicates("stimulus")
    return Counts(
        rows=len(whole),
        scored=len(scored),
        invalid=int((~valid).sum()),
        training=int((valid & (whole["kind"] == "training")).sum()),
        dummy=int((valid & (whole["kind"] == "dummy")).sum()),
        missing=int((valid & judged & ~given).sum()),
        observers=len(scored.drop_duplicates(["lab", "observer"])),
        stimuli=len(stimuli),
        references=int((stimuli["kind"] == "reference").sum()),
        simulated_share=float(scored["simulated"].mean()) if len(scored) else 0.0,
    )


def observer_name(table: pd.DataFrame) -> list[str]:
    """Return the names of the `observer` column; with the laboratory where there are several."""
    if len(table["lab"].unique()) < 2:
        return [str(name) for name in table["observer"]]
    return [f"{lab} / {name}" for lab, name in zip(table["lab"], table["observer"], strict=True)]


def remarks(
    votes: pd.DataFrame,
    scale: Scale,
    counts: Counts,
    scores: pd.DataFrame,
    observers: pd.DataFrame,
    findings: Findings,
) -> Iterator[str]:
    """Yield the remarks of a report, one sentence or two each."""
    yield from _about_the_test(votes, scale, counts)
    if findings.rejected:
        gone = pd.Series([str(one) for one in findings.rejected])
        yield (
            f"Left out by decision: {_names(gone)}. Every number of this report is "
            "without the votes of these observers."
        )
    yield from _about_the_removal(counts, scores, findings)
    yield from _about_intervals(scale, scores)
    yield from _about_the_screens(observers, counts)
    yield from _about_the_model(votes)
    yield from _about_quality(findings)
    yield from findings.models


def _about_the_test(votes: pd.DataFrame, scale: Scale, counts: Counts) -> Iterator[str]:
    if counts.simulated_share > 0:
        yield (
            f"{100 * counts.simulated_share:.3g} % of the scored votes are simulated: they show "
            "that the procedure works and say nothing about what people see."
        )
    scored = index_votes(votes)
    yield from unmarked_robots(scored)
    if counts.observers < FEW_OBSERVERS:
        yield (
            f"{_number(counts.observers, 'observer')}: with fewer than {FEW_OBSERVERS} BT.500 "
            "calls a test informal."
        )
    if (scale.low, scale.high) != (1, 5):
        yield f"The scale is {scale}, not BT.500's impairment scale of five grades."
    if len(scored.table["repetition"].unique()) > 1:
        yield (
            "Sequences were shown repeatedly to the same observers. Their votes are pooled, as if "
            "independent: Student's intervals are too short; the bootstrap over observers in "
            "mos.csv is not."
        )
    labs = scored.observers["lab"].nunique()
    if labs > 1:
        yield f"Votes of {labs} laboratories are pooled."
    most = int(scored.per_stimulus(np.ones(len(scored.vote))).max())
    if len(scored.vote) < most * len(scored.stimuli):
        yield "Not all sequences have the same number of votes: see n."


def unmarked_robots(scored: Indexed) -> Iterator[str]:
    """Yield a sentence on observers who are called as dsis calls its robots and not marked so."""
    people = scored.observers[~scored.observers["simulated"]]
    named = people[people["observer"].str.startswith(ROBOT)]
    if len(named):
        yield (
            "Not marked as simulated, but called as dsis calls its simulated observers: "
            f"{_names(pd.Series(observer_name(named)))}. If they are, the column simulated must be "
            "true for their votes."
        )


def _about_the_removal(counts: Counts, scores: pd.DataFrame, findings: Findings) -> Iterator[str]:
    threshold, removed = findings.threshold, int(scores["n_removed"].sum())
    if threshold != THRESHOLD_SD:
        yield f"Votes are removed beyond {threshold:g} sd, not the paper's {THRESHOLD_SD:g}."
    if findings.passes != 1:
        yield f"Votes are removed in at most {findings.passes} passes, not in the paper's one."
    if removed > MANY_REMOVED * counts.scored:
        yield (
            f"The {threshold:g}\u03c3 rule removes {100 * removed / counts.scored:.1f} % of the "
            f"votes, more than {100 * MANY_REMOVED:.0f} %: the votes are far from normal, or "
            "observers did not agree on what to judge."
        )
    # With the sample sd, |z| is at most (n - 1) / sqrt(n): below 2 up to n = 5.
    small = scores[(scores["n"] - 1) / np.sqrt(scores["n"]) <= threshold]
    if len(small):
        least = int(np.floor((threshold / 2 + np.sqrt(threshold**2 / 4 + 1)) ** 2 + 1e-9))
        yield (
            f"The {threshold:g}\u03c3 rule cannot remove anything where there are {least} votes "
            f"or fewer: {_names(small['stimulus'])}."
        )


def _about_intervals(scale: Scale, scores: pd.DataFrame) -> Iterator[str]:
    single = scores[scores["n"] == 1]
    if len(single):
        yield (
            f"A single vote has no interval of Student's: {_names(single['stimulus'])}. The "
            "binomial one stands there."
        )
    agreed = scores[scores["sd"] == 0]
    if len(agreed):
        yield (
            f"All votes are equal on {_names(agreed['stimulus'])}: Student's interval has no width "
            "there, the binomial one stands in its place; and BT.500's screening passes such a "
            "sequence over."
        )
    beyond = scores[(scores["ci_low"] < scale.low) | (scores["ci_high"] > scale.high)]
    if len(beyond):
        yield (
            f"The interval leaves the scale on {_names(beyond['stimulus'])}: near the ends of the "
            "scale it is an approximation; the binomial interval in mos.csv never does."
        )


def _about_the_screens(observers: pd.DataFrame, counts: Counts) -> Iterator[str]:
    proposed = observers[observers["bt500_rejected"] | observers["correlation_rejected"]]
    if len(proposed):
        yield (
            f"Screening proposes to reject {_names(pd.Series(observer_name(proposed)))}: see "
            "Observers."
        )
    if observers["correlation_rejected"].any() and counts.stimuli < FEW_SEQUENCES:
        error = (1 - 0.7**2) / np.sqrt(max(counts.stimuli - 1, 1))
        yield (
            f"A correlation of 0.7 over {_number(counts.stimuli, 'sequence')} is uncertain by "
            f"{error:.2f} (standard error): the correlation screen meets faultless observers too."
        )
    if observers["bt500_rejected"].all():
        yield "BT.500's screening rejects every observer: there is no MOS after it."
    unknown = observers[observers["correlation"].isna()]
    if len(unknown):
        yield (
            f"No correlation exists for {_names(pd.Series(observer_name(unknown)))}: the votes, or "
            "the MOS of the sequences judged, are all equal; nobody is rejected for that."
        )


def _about_the_model(votes: pd.DataFrame) -> Iterator[str]:
    fit = p910(votes)
    if not fit.converged:
        yield f"The P.910 model did not converge in {fit.rounds} rounds."
    if fit.degenerate:
        rigid = fit.observers[fit.observers["rigid"]]
        yield (
            f"The P.910 model finds no inconsistency in {_names(pd.Series(observer_name(rigid)))}: "
            "it then rests on these votes alone; do not use its scores. They, their intervals and "
            "its likelihood are left blank; inconsistencies of others are distances from these "
            "votes."
        )


def _about_quality(findings: Findings) -> Iterator[str]:
    if findings.sos.suspicious:
        yield (
            f"The votes spread unusually: SOS parameter a = {findings.sos.a:.2f}, over "
            f"{SUSPICIOUS}. Look for observers who did something else, or files that were mixed up."
        )
    found = findings.order[findings.order["p_holm"] < SIGNIFICANT]
    for row in found.itertuples():
        yield (
            f"The order of presentations shows in the votes ({row.effect}): {row.meaning}, "
            f"{row.slope:+.2f} [{row.ci_low:+.2f}, {row.ci_high:+.2f}].".replace("-", "\u2212")
        )
    repeated = findings.retest
    if repeated is not None and repeated.shift_ci[0] * repeated.shift_ci[1] > 0:
        low, high = repeated.shift_ci
        yield (
            f"Second votes on the same sequence differ from first ones by {repeated.shift:+.2f} "
            f"[{low:+.2f}, {high:+.2f}] on average.".replace("-", "\u2212")
        )


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _names(names: "pd.Series[str]") -> str:
    listed = [str(name) for name in names[:NAMES_LISTED]]
    more = len(names) - len(listed)
    return ", ".join(listed) + (f" and {more} more" if more else "")
