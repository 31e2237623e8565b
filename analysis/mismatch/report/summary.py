"""What the terminal shows of a diagnosis; of several, one line each."""

from collections.abc import Iterable, Mapping

from analysis.mismatch.finding import Change, Finding
from analysis.mismatch.report.numbers import plain
from analysis.mismatch.report.sentences import (
    considered,
    credited,
    gain,
    parameters,
    strongest,
    tie,
    verdict,
)
from analysis.mismatch.words import place, statistic_words

_SHOWN = 8


def summary(finding: Finding) -> str:
    """Return a finding as Markdown: verdict, physics, where it differs, what is left, the proof."""
    lines = [f"**{finding.verdict}**: {' '.join(verdict(finding))}", ""]
    if finding.omitted_physics:
        lines += ["| physics left out | parameters | held-out gain, nats/frame (95 %) |"]
        lines += ["|---|---|---|"]
    for effect in finding.omitted_physics:
        lines.append(f"| {effect.effect} | {parameters(effect)} | {gain(effect.heldout_gain)} |")
    ties = [a for of, a in considered(finding) if not of or a.would_settle]
    lines += [f"- {tie(a)}" for a in ties]
    after = ("z after", "explained by") if finding.searched else ()
    if finding.mismatches:
        head = ("differs", "where", "z", *after)
        lines += ["", _row(head), _row("---" for _ in head).replace(" ", "")]
    for m in strongest(finding.mismatches)[:_SHOWN]:
        cells = (statistic_words(m.statistic), place(m.where), plain(m.z))
        rest = (
            (plain(m.z_after), m.explained_by or credited(m, finding) or "nothing") if after else ()
        )
        lines.append(_row((*cells, *rest)))
    more = len(finding.mismatches) - _SHOWN
    if more > 0:
        lines.append(f"and {more} more, in the report")
    proof = _proof(finding) if finding.searched else [""]
    lines += ["", *proof, *(f"- {remark}" for remark in finding.remarks)]
    return "\n".join(lines).strip() + "\n"


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _proof(finding: Finding) -> list[str]:
    proof = finding.proof
    said = [f"departures {_change(proof.discrepancies)}"]
    if proof.gap_closed is not None:
        said.append(f"gap closed {plain(proof.gap_closed)}")
    if proof.classifier_auc is not None:
        said.append(f"classifier AUC {_change(proof.classifier_auc)}")
    if proof.photon_transfer_chi2 is not None:
        said.append(f"photon-transfer chi²/dof {_change(proof.photon_transfer_chi2)}")
    return ["Before and after: " + "; ".join(said) + ".", ""]


def _change(change: Change) -> str:
    return f"{plain(change.before)} -> {plain(change.after)}"


def comparison(findings: Mapping[str, Finding]) -> str:
    """Return one line per recording: verdict, physics, what is left."""
    lines = [
        "| recording | verdict | physics left out | unexplained | gap closed |",
        "|---|---|---|---|---|",
    ]
    for name, finding in findings.items():
        effects = ", ".join(effect.effect for effect in finding.omitted_physics) or "-"
        left, gap = len(finding.unexplained), finding.proof.gap_closed
        closed = "none was open" if gap is None else plain(gap)
        lines.append(f"| {name} | {finding.verdict} | {effects} | {left} | {closed} |")
    return "\n".join(lines) + "\n"
