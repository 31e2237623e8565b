"""Every effect's way of being recognised: the vocabulary of the diagnosis."""

from analysis.mismatch.candidates import (
    currents,
    edges,
    fields,
    neighbours,
    patterns,
    pixels,
    response,
    rows,
    temporal,
)
from analysis.mismatch.candidates.candidate import Candidate, Proposal, measured

CANDIDATES: dict[str, Candidate] = {
    candidate.kind: candidate
    for module in (temporal, rows, pixels, neighbours, patterns, currents, fields, edges, response)
    for candidate in module.CANDIDATES
}


def calls_of(kind: str) -> tuple[str, ...]:
    """Return the statistics that call for a kind of effect; none for a second read-out path."""
    return CANDIDATES[kind].calls if kind in CANDIDATES else ()


__all__ = ["CANDIDATES", "Candidate", "Proposal", "calls_of", "measured"]
