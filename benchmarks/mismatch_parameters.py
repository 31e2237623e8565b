"""Wrong numbers are no physics: `python benchmarks/mismatch_parameters.py --cases 100`.

Recordings without hidden effects whose camera.toml is off by 3 to 30 standard errors in slope,
intercept, black level or switch. Goals: verdict `parameters` in 95 % or more, the recorded values'
95 % intervals cover the truth in 92-98 %. Resumable: WORK/parameters.jsonl.
"""

import argparse
import shutil
import sys
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import Case, Choice, draw_case, plant
from planter.finder import FINDER, diagnose, named
from planter.ledger import versions, work_through
from planter.parameters import covered, truth_of
from planter.tables import share, table

PARAMETERS = ("noise.slope", "noise.intercept", "black_level", "noise.switch_dn")


def drawn(seed: int, number: int) -> Case:
    """Return a case of which one number is wrong; every fourth is of each parameter."""
    rng = np.random.default_rng([seed, number, 42])
    parameter = PARAMETERS[number % 4]
    segments = 2 if parameter == "noise.switch_dn" else None
    case = draw_case(int(rng.integers(2**31)), "small", Choice(segments=segments))
    off = float(rng.choice([-1, 1]) * rng.uniform(3, 30))
    if parameter == "noise.switch_dn":
        off = float(rng.choice([-1, 1]))  # whole gaps between levels: less is not recorded
    return replace(case, wrong={parameter: off})


def judged(task: dict[str, Any]) -> dict[str, Any]:
    """Plant, diagnose, compare the numbers."""
    case = drawn(task["seed"], task["number"])
    folder = Path(task["work"]) / f"parameters-{task['number']}"
    try:
        values = diagnose(plant(folder, case), finder=task["finder"], seed=task["number"])
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    found = []
    for entry in values.get("parameter_errors", ()):
        truth = truth_of(case, entry)
        plain, middle = (truth[0], sum(truth[1]) / 2) if truth else ("unknown", float("nan"))
        inside = truth is not None and covered(entry, truth[1])
        found.append({**entry, "is": plain, "true": middle, "covered": inside})
    ((parameter, off),) = case.wrong.items()
    return {
        "parameter": parameter,
        "off": off,
        "verdict": values["verdict"],
        "named": named(values),
        "mismatches": [[m["statistic"], m["z"]] for m in values.get("mismatches", ())],
        "found": found,
        "error": values.get("error"),
        "seconds": values["seconds"],
    }


def report(entries: list[dict[str, Any]]) -> None:
    """Print verdicts and coverage, by parameter and by size of the error."""
    right = [e for e in entries if e["verdict"] == "parameters"]
    print(f"verdict `parameters`   {share(len(right), len(entries))}, goal >= 95 %")
    print("other verdicts         ", dict(Counter(e["verdict"] for e in entries)))
    print(f"an effect named        {share(sum(bool(e['named']) for e in entries), len(entries))}")
    judged_values = [found for e in entries for found in e["found"]]
    inside = sum(found["covered"] for found in judged_values)
    print(f"95 % intervals cover   {share(inside, len(judged_values))}, goal 92-98 %")
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for e in entries:
        size = "switch" if "switch" in e["parameter"] else "3-10" if abs(e["off"]) < 10 else "10-30"
        groups[f"{e['parameter']}, {size} se"].append(e)
    rows = []
    for name, own in sorted(groups.items()):
        verdict = sum(e["verdict"] == "parameters" for e in own)
        listed = sum(any(f["is"] == e["parameter"] for f in e["found"]) for e in own)
        mine = [f for e in own for f in e["found"] if f["is"] == e["parameter"]]
        others = sum(any(f["is"] != e["parameter"] for f in e["found"]) for e in own)
        cover = share(sum(f["covered"] for f in mine), len(mine))
        rows.append((name, share(verdict, len(own)), f"{listed}/{len(own)}", cover, others))
    print(table(["wrong", "verdict parameters", "listed", "covered", "others listed"], rows))
    for e in entries:
        if e["verdict"] != "parameters":
            off = f"{e['parameter']} {e['off']:+.1f}"
            print(f"  {e['task']}: {off}: {e['verdict']} {e['error'] or e['mismatches'][:3]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-parameters")
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()
    common = {"work": str(options.work), "seed": options.seed, "finder": options.finder}
    tasks = {f"wrong-{options.seed}-{i}": {**common, "number": i} for i in range(options.cases)}
    done = work_through(options.work / "parameters.jsonl", tasks, judged, options.jobs)
    report(list(done.values()))
    print(versions(done.values()))


if __name__ == "__main__":
    main()
