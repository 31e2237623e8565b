"""Power of `dsis mismatch`: `python benchmarks/mismatch_power.py --repeats 3`.

Every effect, planted so that the planter's own statistic stands at z of 5, 10 and 20: is the right
statistic located, in the right place (exposures, channel, frequency), and is the effect named?
Goal: located in 95 % or more from z = 10 on. Resumable: WORK/power.jsonl.
"""

import argparse
import shutil
import sys
from pathlib import Path
from tempfile import gettempdir
from typing import Any
from zlib import crc32

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import KINDS, Case, Choice, draw_case, plant
from planter.acceptable import located
from planter.finder import FINDER, diagnose, named
from planter.ledger import versions, work_through
from planter.recipes import RECIPES
from planter.strength import Unidentifiable, calibrate
from planter.tables import share, table

STRENGTHS = (5, 10, 20)
DRAWS = 40
CLEAR = 10  # from here on effects are to be located


def background(kind: str, seed: int, number: int) -> Case:
    """Return a camera that the effect fits: mono and Bayer in turn."""
    segments = {"dual_gain": 1, "dual_gain_mismatch": 2}.get(kind)
    bayer = number % 2 == 1 or kind == "channel_imbalance"
    for draw in range(DRAWS):
        # Every effect on noise of its own: one unlucky recording is not counted for all.
        rng = np.random.default_rng([seed, number, draw, 43, crc32(kind.encode())])
        cfa = str(rng.choice(["RGGB", "BGGR", "GRBG", "GBRG"])) if bayer else "MONO"
        choice = Choice(cfa=cfa, segments=segments, times="darks", light=True)
        case = draw_case(int(rng.integers(2**31)), "small", choice)
        if RECIPES[kind].fits(case):
            return case
    message = f"no camera fits {kind}"
    raise RuntimeError(message)


def judged(task: dict[str, Any]) -> dict[str, Any]:
    """Plant one effect at one strength, diagnose, look where it was found."""
    kind = task["kind"]
    try:
        planting = calibrate(background(kind, task["seed"], task["number"]), kind, task["z"])
    except Unidentifiable:
        return {"kind": kind, "wanted": task["z"], "unidentifiable": True}
    folder = Path(task["work"]) / f"power-{kind}-{task['z']}-{task['number']}"
    try:
        plant(folder, planting.case)
        words = [] if task["locate_only"] else None
        values = diagnose(folder, finder=task["finder"], seed=task["number"], vocabulary=words)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    suits, placed = located(planting.case, kind, values.get("mismatches", []))
    return {
        "kind": kind,
        "wanted": task["z"],
        "z": planting.z,
        "planted": dict(planting.case.planted(kind) or {}),
        "cfa": planting.case.cfa,
        "located": suits,
        "placed": placed,
        "named": named(values),
        "verdict": values["verdict"],
        "mismatches": [
            [m["statistic"], m["z"], m.get("where")] for m in values.get("mismatches", ())
        ],
        "error": values.get("error"),
        "seconds": values["seconds"],
    }


def report(entries: list[dict[str, Any]]) -> None:
    """Print power against strength, per effect and over all."""
    seen = [e for e in entries if "z" in e]
    rows = []
    for kind in sorted({e["kind"] for e in seen}):
        for wanted in sorted({e["wanted"] for e in seen}):
            own = [e for e in seen if e["kind"] == kind and e["wanted"] == wanted]
            if own:
                rows.append((kind, wanted, *counted(own)))
    print(table(HEAD, rows))
    for wanted in sorted({e["wanted"] for e in seen}):
        own = [e for e in seen if e["wanted"] == wanted]
        placed = share(sum(e["placed"] for e in own), len(own))
        right = share(sum(e["kind"] in e["named"] for e in own), len(own))
        print(f"z {wanted}: located in its place {placed}; named {right}")
    clear = [e for e in seen if e["z"] >= CLEAR]
    print(f"z {CLEAR} and more: located in its place "
          f"{share(sum(e['placed'] for e in clear), len(clear))}")  # fmt: skip
    for e in seen:
        if not e["placed"] and e["z"] >= 0.9 * 10:
            what = e["error"] or [m[:2] for m in e["mismatches"][:4]]
            print(f"  {e['task']}: z {e['z']:.1f}, {e['verdict']} {what}")


HEAD = ["effect", "z wanted", "z", "cases", "statistic", "in its place", "named", "named besides"]


def counted(own: list[dict[str, Any]]) -> tuple[object, ...]:
    """Return one row of the table."""
    besides = sorted({name for e in own for name in e["named"] if name != e["kind"]})
    return (
        f"{min(e['z'] for e in own):.1f}-{max(e['z'] for e in own):.1f}",
        len(own),
        sum(e["located"] for e in own),
        sum(e["placed"] for e in own),
        sum(e["kind"] in e["named"] for e in own),
        ", ".join(besides) or "-",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3, help="cases per effect and strength")
    parser.add_argument("--only", nargs="*", choices=sorted(KINDS), help="these effects")
    parser.add_argument("--strengths", type=float, nargs="*", default=STRENGTHS)
    parser.add_argument("--locate-only", action="store_true", help="name nothing, which is faster")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-power")
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()
    common = {
        "work": str(options.work),
        "seed": options.seed,
        "finder": options.finder,
        "locate_only": options.locate_only,
    }
    tasks = {
        f"{kind}-{z:g}-{options.seed}-{i}": {**common, "kind": kind, "z": z, "number": i}
        for kind in options.only or sorted(KINDS)
        for z in options.strengths
        for i in range(options.repeats)
    }
    done = work_through(options.work / "power.jsonl", tasks, judged, options.jobs)
    report(list(done.values()))
    print(versions(done.values()))


if __name__ == "__main__":
    main()
