"""Mismatch: where simulation and recording differ, what physics was left out, and the proof.

Public: `find_mismatch` gives a `Finding`; `analysis.mismatch.files.write_finding` writes it.
"""

from analysis.mismatch.diagnose import VOCABULARY, find_mismatch
from analysis.mismatch.finding import Finding

__all__ = ["VOCABULARY", "Finding", "find_mismatch"]
