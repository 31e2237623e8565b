"""The tables of the concealed proof: power, confusion, wrong names, parameters."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from statistics import median
from typing import Any

from planter.judgement import OUTCOMES
from planter.tables import share, table

Judged = Mapping[str, Any]  # the key's entry, the finding's summary and the judgement
BINS = ((0, 5), (5, 10), (10, 20), (20, float("inf")))
COVERED = 1.96


def planted(cases: Iterable[Judged]) -> Iterable[tuple[str, float, str, Judged]]:
    """Yield (effect, z, outcome, case) of every effect that may be named and can be seen.

    What the real frames have by themselves proves nothing where it is planted besides.
    """
    for case in cases:
        for kind, z in case["z"].items():
            if kind not in (case["out"], *case["own"]) and z > 0:
                yield kind, z, case["outcome"][kind], case


def power(cases: list[Judged]) -> str:
    """Return right names by effect and strength."""
    counts: dict[str, dict[int, list[int]]] = defaultdict(lambda: defaultdict(lambda: [0, 0]))
    for kind, z, outcome, _ in planted(cases):
        place = next(i for i, (low, high) in enumerate(BINS) if low <= z < high)
        counts[kind][place][0] += outcome == "right"
        counts[kind][place][1] += 1
    head = ["effect, right / planted at z", *(f"{low}-{high:g}" for low, high in BINS)]
    rows = [(kind, *(_ratio(counts[kind][i]) for i in range(len(BINS)))) for kind in sorted(counts)]
    return table(head, rows)


def _ratio(pair: list[int]) -> str:
    return f"{pair[0]}/{pair[1]}" if pair[1] else "-"


def goals(cases: list[Judged]) -> str:
    """Return the figures that the proof is judged by, beside their goals."""
    strong = [(kind, outcome) for kind, z, outcome, _ in planted(cases) if z >= 10]
    nulls = [c for c in cases if not c["z"]]
    outside = [c for c in cases if c["out"] and c["z"][c["out"]] >= 10]
    hidden = [c for c in cases if c["z"]]
    errors = [error for c in cases for error in c["errors_se"].values()]
    gaps = [c["gap_closed"] for c in hidden if c["named"] and c["gap_closed"] is not None]
    wrong_numbers = [found for c in cases for found in c["wrong_found"].values()]
    left = [c for c in outside if c["left_unexplained"][c["out"]] and not c["wrong"]]
    right = sum(outcome == "right" for _, outcome in strong)
    rows = [
        ("right names from z = 10 on", share(right, len(strong)), ">= 95 %"),
        ("cases with a wrong name", _many(cases, lambda c: c["wrong"]), "<= 2 %"),
        (
            "nulls: nothing named",
            _many(nulls, lambda c: not c["named"] and not c["error"]),
            ">= 98 %",
        ),
        (
            "nulls: no mismatch claimed",
            _many(nulls, lambda c: not c["mismatches"] and not c["error"]),
            ">= 99 %",
        ),
        ("out of vocabulary: located, unexplained", share(len(left), len(outside)), ">= 90 %"),
        (
            "95 % intervals cover",
            share(sum(abs(e) < COVERED for e in errors), len(errors)),
            ">= 90 %",
        ),
        ("gap closed, median", f"{median(gaps):.2f}" if gaps else "-", ">= 0.9"),
        ("wrong numbers listed", share(sum(wrong_numbers), len(wrong_numbers)), "-"),
        ("crashes", share(sum(bool(c["error"]) for c in cases), len(cases)), "0"),
    ]
    for outcome in OUTCOMES[1:]:
        count = sum(found == outcome for _, found in strong)
        rows.append((f"{outcome} from z = 10 on", share(count, len(strong)), "-"))
    return table(["", "seen", "goal"], rows)


def _many(cases: list[Judged], holds: Any) -> str:
    return share(sum(bool(holds(case)) for case in cases), len(cases))


def confusion(cases: list[Judged]) -> str:
    """Return what was named where it was not planted, by what was planted there."""
    pairs: Counter[tuple[str, str]] = Counter()
    for case in cases:
        missing = [k for k, outcome in case["outcome"].items() if outcome != "right"]
        for wrong in case["wrong"]:
            pairs.update({(kind, wrong): 1 for kind in missing or ["(nothing else missing)"]})
    rows = [(kind, wrong, count) for (kind, wrong), count in pairs.most_common()]
    return table(["planted, not named", "named wrongly", "cases"], rows) if rows else "none"


def parameters(cases: list[Judged]) -> str:
    """Return errors of parameters in standard errors."""
    errors: dict[str, list[float]] = defaultdict(list)
    for case in cases:
        for name, error in case["errors_se"].items():
            errors[name].append(error)
    rows = [
        (
            name,
            share(sum(abs(e) < COVERED for e in found), len(found)),
            f"{median(found):+.1f}",
            f"{max(found, key=abs):+.1f}",
        )
        for name, found in sorted(errors.items())
    ]
    return table(["parameter", "95 % interval covers", "median error, se", "largest, se"], rows)


def remarkable(cases: list[Judged]) -> Iterable[str]:
    """Yield a line for each case that fell short."""
    for case in cases:
        short = [k for k, z, o, _ in planted([case]) if z >= 10 and o != "right"]
        if short or case["wrong"] or case["error"]:
            there = ", ".join(f"{kind} {z:.0f}" for kind, z in case["z"].items()) or "nothing"
            extra = [case["decoy"] if case["decoy"] != "none" else "", "real" * case["real"]]
            note = ", ".join(part for part in (*extra, *case["case"]["wrong"]) if part)
            yield (
                f"{case['task']}: planted {there} ({note or 'plain'}; out: {case['out'] or '-'}), "
                f"named {', '.join(case['named']) or 'nothing'} [{case['verdict']}]"
                + (f" {case['error']}" if case["error"] else "")
            )
