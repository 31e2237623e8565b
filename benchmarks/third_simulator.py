"""A third proof by another hand: `python benchmarks/third_simulator.py --cases 30 --seed 2`.

Writes recordings and a sealed key with a simulator that was written from the contract and
docs/effects.md alone, apart from the project and from the other two; prints the key's SHA-256,
runs the diagnosis on the files alone, opens the key and prints what was found. Resumable:
everything lies in --work, one line of JSON a case. Seeds 1 and 2 have been used: what they say is
no proof any more.
"""

import argparse
import json
import sys
from pathlib import Path
from tempfile import gettempdir
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter.finder import FINDER, diagnose
from planter.ledger import fingerprint, versions, work_through, write_ledger
from third.cases import conceal, seal
from third.judging import judge
from third.summary import figures, shortfalls


def concealed(options: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Write all recordings, one after another, and the key; print its hash; return it."""
    task = {"seed": options.seed, "cases": options.cases, "folder": str(options.work)}
    done = work_through(options.work / "key.partial", {"deck": task}, conceal, 1)
    key: dict[str, dict[str, Any]] = done["deck"]["cases"]
    digest = seal(options.work / "key.jsonl", key)
    print(f"sealed key SHA-256 {digest}: {len(key)} recordings in {options.work}", flush=True)
    return key


def examined(task: dict[str, Any]) -> dict[str, Any]:
    """Run the diagnosis on one folder."""
    folder = Path(task["folder"])
    values = diagnose(folder / "rec", finder=task["finder"], camera=folder / "camera.toml")
    return {"values": values}


def report(cases: list[dict[str, Any]]) -> None:
    """Print figures and shortfalls."""
    print("\n".join(["", *figures(cases)]))
    print("\nFell short\n" + "\n".join(shortfalls(cases) or ["none"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path)
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()
    if options.work is None:
        options.work = Path(gettempdir()) / f"dsis-third-{options.seed}-{options.cases}"
    options.work.mkdir(parents=True, exist_ok=True)
    key = concealed(options)
    tasks = {
        name: {
            "folder": str(options.work / name),
            "finder": options.finder,
            "key": fingerprint(json.dumps(key[name], sort_keys=True)),
        }
        for name in sorted(key)
    }
    found = work_through(options.work / "found.jsonl", tasks, examined, options.jobs)
    cases = [judge(key[name], found[name]["values"]) for name in tasks]
    write_ledger(options.work / "judged.jsonl", cases)
    report(cases)
    print("\n" + versions(found.values()))


if __name__ == "__main__":
    main()
