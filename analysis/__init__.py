"""Reading what came out of a test: votes to scores, recordings to physics.

The names below are the public ones; each is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.bootstrap import bootstrap_scores
    from analysis.hidden_reference import dmos
    from analysis.inference import (
        conclusions,
        fit_linear,
        fit_ordinal,
        ordinal_contrasts,
        test_contrasts,
    )
    from analysis.labs import read_labs
    from analysis.likelihood import compare_models
    from analysis.models import p910, p913
    from analysis.order import order_effects
    from analysis.planning import Plan, observers_needed, power_from_pilot
    from analysis.rejection import propose_rejections, reject
    from analysis.repeatability import retest
    from analysis.report import write_report
    from analysis.scale import describe_test
    from analysis.scores import mos, observer_table, score_table
    from analysis.screening import remove_outliers, screen_bt500, screen_correlation
    from analysis.screens import compare_screens, screen_inconsistency
    from analysis.sos import sos_parameter
    from analysis.surealfile import write_sureal
    from analysis.votes import codebook, scored
    from analysis.votesfile import read_votes, write_votes
    from analysis.widefile import write_wide

_HOMES = {
    "bootstrap_scores": "bootstrap",
    "codebook": "votes",
    "compare_models": "likelihood",
    "compare_screens": "screens",
    "conclusions": "inference",
    "describe_test": "scale",
    "dmos": "hidden_reference",
    "fit_linear": "inference",
    "fit_ordinal": "inference",
    "mos": "scores",
    "observer_table": "scores",
    "observers_needed": "planning",
    "order_effects": "order",
    "ordinal_contrasts": "inference",
    "p910": "models",
    "p913": "models",
    "Plan": "planning",
    "power_from_pilot": "planning",
    "propose_rejections": "rejection",
    "read_labs": "labs",
    "read_votes": "votesfile",
    "reject": "rejection",
    "remove_outliers": "screening",
    "retest": "repeatability",
    "score_table": "scores",
    "scored": "votes",
    "screen_bt500": "screening",
    "screen_correlation": "screening",
    "screen_inconsistency": "screens",
    "sos_parameter": "sos",
    "test_contrasts": "inference",
    "write_report": "report",
    "write_sureal": "surealfile",
    "write_votes": "votesfile",
    "write_wide": "widefile",
}

__all__ = [
    "Plan",
    "bootstrap_scores",
    "codebook",
    "compare_models",
    "compare_screens",
    "conclusions",
    "describe_test",
    "dmos",
    "fit_linear",
    "fit_ordinal",
    "mos",
    "observer_table",
    "observers_needed",
    "order_effects",
    "ordinal_contrasts",
    "p910",
    "p913",
    "power_from_pilot",
    "propose_rejections",
    "read_labs",
    "read_votes",
    "reject",
    "remove_outliers",
    "retest",
    "score_table",
    "scored",
    "screen_bt500",
    "screen_correlation",
    "screen_inconsistency",
    "sos_parameter",
    "test_contrasts",
    "write_report",
    "write_sureal",
    "write_votes",
    "write_wide",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        fact = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(fact)
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
