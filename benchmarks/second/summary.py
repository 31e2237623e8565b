"""What a set of judged cases says: shares with their intervals, and a line a shortfall."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from statistics import median
from typing import Any

from scipy.stats import beta

from second.judging import COVERED

STRONG = 10.0  # z from which on a name is asked for
Judged = Mapping[str, Any]


def share(hits: int, total: int, level: float = 0.95) -> str:
    """Return "3/20 = 15.0 % [3.2, 37.9]", with the Clopper-Pearson interval."""
    if not total:
        return "0/0"
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, hits, total - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, total - hits)) if hits < total else 1.0
    return f"{hits}/{total} = {100 * hits / total:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def _many(holds: Iterable[bool]) -> str:
    found = list(holds)
    return share(sum(found), len(found))


def figures(cases: list[Judged]) -> list[str]:
    """Return the lines of figures."""
    strong = [
        kind not in case["missed"]
        for case in cases
        for kind, z in case["z"].items()
        if kind not in case["outside"] and z >= STRONG
    ]
    nulls = [c for c in cases if not c["z"]]
    outside = [left and not c["wrong"] for c in cases for left in c["outside"].values()]
    off = [c for c in nulls if c["off"]]
    quoted = [found for c in cases for found in c["off"].values()]
    errors = [abs(error) < COVERED for c in cases for error in c["errors_se"].values()]
    seconds = sorted(c["seconds"] for c in cases)
    rows = {
        f"right names from z = {STRONG:g} on": _many(strong),
        "cases with a wrong name": _many(bool(c["wrong"]) for c in cases),
        "nulls: nothing named": _many(not c["named"] and not c["error"] for c in nulls),
        "on no list: located, left unexplained": _many(outside),
        "nothing but a wrong number: verdict": _many(c["verdict"] == "parameters" for c in off),
        "wrong numbers listed": _many(quoted),
        "95 % intervals cover": _many(errors),
        "crashes": _many(bool(c["error"]) for c in cases),
        "seconds a case": f"median {median(seconds):.1f}, most {seconds[-1]:.1f}",
    }
    width = max(map(len, rows))
    return [f"{name.ljust(width)}  {seen}" for name, seen in rows.items()]


def parameters(cases: list[Judged]) -> list[str]:
    """Return a line for each parameter: how many intervals cover, and the largest error."""
    errors: dict[str, list[float]] = defaultdict(list)
    for case in cases:
        for name, error in case["errors_se"].items():
            errors[name].append(error)
    return [
        f"{name}: {sum(abs(e) < COVERED for e in found)}/{len(found)}, "
        f"largest {max(found, key=abs):+.1f} standard errors"
        for name, found in sorted(errors.items())
    ]


def shortfalls(cases: list[Judged]) -> list[str]:
    """Return a line for each case that fell short."""
    return [line for case in cases if (line := _shortfall(case))]


def _shortfall(case: Judged) -> str:
    strong = [kind for kind in case["missed"] if case["z"][kind] >= STRONG]
    said = [f"not named: {', '.join(strong)}"] * bool(strong)
    said += [f"wrong: {', '.join(case['wrong'])}"] * bool(case["wrong"])
    said += [f"not located: {kind}" for kind, left in case["outside"].items() if not left]
    if case["expected"] == "parameters" and case["verdict"] != "parameters":
        said.append("the wrong number is no verdict")
    said += [f"not listed: {name}" for name, found in case["off"].items() if not found]
    said += [str(case["error"])] * bool(case["error"])
    if not said:
        return ""
    there = ", ".join(f"{kind} {z:.0f}" for kind, z in case["z"].items()) or "nothing"
    also = f"; in camera.toml {', '.join(case['known'])}" if case["known"] else ""
    return (
        f"{case['case']}: {'; '.join(said)} (hidden {there}{also}; "
        f"named {', '.join(case['named']) or 'nothing'}) [{case['verdict']}]"
    )
