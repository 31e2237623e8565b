"""Reading what came out of a test: votes to scores, recordings to physics.

The names below are the public ones; each is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.models import p910, p913
    from analysis.report import write_report
    from analysis.scale import describe_test
    from analysis.scores import mos, observer_table, score_table
    from analysis.screening import remove_outliers, screen_bt500, screen_correlation
    from analysis.votes import codebook, scored
    from analysis.votesfile import read_votes, write_votes

_HOMES = {
    "codebook": "votes",
    "describe_test": "scale",
    "mos": "scores",
    "observer_table": "scores",
    "p910": "models",
    "p913": "models",
    "read_votes": "votesfile",
    "remove_outliers": "screening",
    "score_table": "scores",
    "scored": "votes",
    "screen_bt500": "screening",
    "screen_correlation": "screening",
    "write_report": "report",
    "write_votes": "votesfile",
}

__all__ = [
    "codebook",
    "describe_test",
    "mos",
    "observer_table",
    "p910",
    "p913",
    "read_votes",
    "remove_outliers",
    "score_table",
    "scored",
    "screen_bt500",
    "screen_correlation",
    "write_report",
    "write_votes",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        fact = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(fact)
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
