"""The key against a finding: each planted effect, names too many, wrong numbers.

What an effect may be: right (named), missed; of an effect on no list abstained (left unexplained
without a name), named (by some name, all of which are wrong), not seen.
"""

import re
from collections.abc import Mapping
from typing import Any


def judge(entry: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the judgement of one case: its entry of the key, and what mismatch.json holds."""
    named = [found["effect"] for found in values.get("omitted_physics", ())]
    unexplained = [found["statistic"] for found in values.get("unexplained", ())]
    left, effects = list(named), []
    for planted in entry["planted"]:
        mark = _named(planted, left) if planted["listed"] else _left_open(named, unexplained)
        effects.append({**{k: planted[k] for k in ("effect", "z", "law", "listed")}, "mark": mark})
    allowed = {name for planted in entry["planted"] for name in _names(planted)}
    silent = not named and not unexplained and not values.get("error")
    wanted = sorted(entry["wrong_numbers"])
    return {
        "case": entry["case"],
        "kind": entry["kind"],
        "effects": effects,
        "named": named,
        "wrong": [name for name in left if name not in allowed],
        "twice": [name for name in left if name in allowed],
        "silent": silent,
        "wrong_numbers": wanted,
        "numbers_told": silent and values["verdict"] == "parameters" and _told(wanted, values),
        "unexplained": unexplained,
        "verdict": values["verdict"],
        "error": values.get("error"),
        "seconds": values["seconds"],
    }


def _names(planted: Mapping[str, Any]) -> list[str]:
    """Return the names that are right for an effect."""
    return [planted["effect"], *planted["also_right"]] if planted["listed"] else []


def _named(planted: Mapping[str, Any], left: list[str]) -> str:
    """Take an effect's name from those left over and tell whether it was there."""
    name = next((name for name in _names(planted) if name in left), None)
    if name is None:
        return "missed"
    left.remove(name)
    return "right"


def _left_open(named: list[str], unexplained: list[str]) -> str:
    if named:
        return "named"
    return "abstained" if unexplained else "not seen"


def _told(wanted: list[str], values: Mapping[str, Any]) -> bool:
    """Return whether all wrong numbers were told, those of read-out paths by any of these."""
    said = {
        re.sub(r"\.segment\[\d+\]", "", found["parameter"])
        for found in values.get("parameter_errors", ())
    }
    return all(any(name in other or other in name for other in said) for name in wanted)
