"""What a set of judged cases says: shares with their intervals, and a line a shortfall."""

from collections.abc import Iterable, Mapping, Sequence
from statistics import median
from typing import Any

from planter.tables import share

STRONG = 10.0  # z from which on a name is asked for
Judged = Mapping[str, Any]


def figures(cases: Sequence[Judged]) -> list[str]:
    """Return the lines of figures."""
    effects = [effect for case in cases for effect in case["effects"]]
    listed = [effect for effect in effects if effect["listed"]]
    strong = [effect for effect in listed if effect["z"] >= STRONG]
    outside = [effect for effect in effects if not effect["listed"]]
    nulls = [case for case in cases if case["kind"] == "null"]
    off = [case for case in nulls if case["wrong_numbers"]]
    wrong, named = (sum(len(case[of]) for case in cases) for of in ("wrong", "named"))
    seconds = sorted(case["seconds"] for case in cases)
    rows = {
        f"right names from z = {STRONG:g} on": _right(strong),
        "  of the exact law": _right(e for e in strong if e["law"] == "exact"),
        "  of a neighbouring law": _right(e for e in strong if e["law"] != "exact"),
        f"right names below z = {STRONG:g}": _right(e for e in listed if e["z"] < STRONG),
        "cases with a wrong name": _many(bool(case["wrong"]) for case in cases),
        "wrong names of all given": share(wrong, named),
        "nulls: nothing named or left open": _many(case["silent"] for case in nulls),
        "  with wrong numbers: told as those": _many(case["numbers_told"] for case in off),
        "on no list: left open, unnamed": _many(e["mark"] == "abstained" for e in outside),
        "on no list: named": _many(e["mark"] == "named" for e in outside),
        "on no list: not seen": _many(e["mark"] == "not seen" for e in outside),
        "crashes": _many(bool(case["error"]) for case in cases),
        "seconds a case": f"median {median(seconds):.1f}, most {seconds[-1]:.1f}",
    }
    width = max(map(len, rows))
    return [f"{name.ljust(width)}  {seen}" for name, seen in rows.items()]


def shortfalls(cases: Iterable[Judged]) -> list[str]:
    """Return a line for each case that fell short."""
    return [line for case in cases if (line := _shortfall(case))]


def _many(holds: Iterable[bool]) -> str:
    found = list(holds)
    return share(sum(found), len(found))


def _right(effects: Iterable[Mapping[str, Any]]) -> str:
    return _many(effect["mark"] == "right" for effect in effects)


def _shortfall(case: Judged) -> str:
    marks = {"missed": "not named", "named": "on no list, but named", "not seen": "not seen"}
    said = []
    for mark, words in marks.items():
        those = [e["effect"] for e in case["effects"] if e["mark"] == mark and _asked(e)]
        said += [f"{words}: {', '.join(those)}"] * bool(those)
    said += [f"wrong: {', '.join(case['wrong'])}"] * bool(case["wrong"])
    if case["kind"] == "null":
        said += ["left open: " + ", ".join(case["unexplained"])] * bool(case["unexplained"])
        if case["wrong_numbers"] and not case["numbers_told"]:
            said.append(f"not told: {', '.join(case['wrong_numbers'])}")
    said += [str(case["error"])] * bool(case["error"])
    if not said:
        return ""
    there = ", ".join(_words(effect) for effect in case["effects"]) or "nothing"
    off = f"; camera.toml has {', '.join(case['wrong_numbers'])} wrong"
    named = ", ".join(case["named"]) or "nothing"
    return (
        f"{case['case']}: {'; '.join(said)} (hidden {there}{off * bool(case['wrong_numbers'])}; "
        f"named {named}) [{case['verdict']}]"
    )


def _asked(effect: Mapping[str, Any]) -> bool:
    return not effect["listed"] or effect["z"] >= STRONG


def _words(effect: Mapping[str, Any]) -> str:
    law = "" if effect["law"] == "exact" else ", neighbouring law"
    return f"{effect['effect']} {effect['z']:.0f}{law}"
