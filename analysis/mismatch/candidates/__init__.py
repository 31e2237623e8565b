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

__all__ = ["CANDIDATES", "Candidate", "Proposal", "measured"]
