"""Preparing a test: light through a camera becomes four versions of one sequence."""

from dsis.stimuli.build import build_stimuli
from dsis.stimuli.check import check_stimuli, summary
from dsis.stimuli.estimate import estimate
from dsis.stimuli.resolved import build_digest

__all__ = [
    "build_digest",
    "build_stimuli",
    "check_stimuli",
    "estimate",
    "summary",
]
