"""A second proof by another hand: `python benchmarks/second_simulator.py --cases 48 --jobs 2`.

Writes recordings and a sealed key with a simulator that was written from the contract alone,
apart from the project and from `concealed.py`'s; prints the key's SHA-256, runs the diagnosis on
the files alone, opens the key and prints what was found. Resumable: everything lies in --work,
one line of JSON a case. The seeds 101, 202 and so on to 1111 have been used to better the
diagnosis: what they say is no proof any more.
"""

import argparse
import json
import sys
import tomllib
from pathlib import Path
from tempfile import gettempdir
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter.finder import FINDER, diagnose
from planter.ledger import fingerprint, versions, work_through, write_ledger
from second.cases import conceal, hand_values, seal
from second.dealing import deal, deal_unlisted
from second.judging import judge
from second.summary import figures, parameters, shortfalls


def concealed(options: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Write all recordings and the key; print its hash; return it."""
    tasks = {}
    hands = deal_unlisted() if options.unlisted else deal(options.seed, options.cases)
    for hand in hands:
        name = f"case-{hand.number:03d}"
        folder = str(options.work / name)
        tasks[name] = {"hand": hand_values(hand), "seed": options.seed, "folder": folder}
    key = work_through(options.work / "key.partial", tasks, conceal, options.jobs)
    digest = seal(options.work / "key.jsonl", key)
    print(f"sealed key SHA-256 {digest}: {len(key)} recordings in {options.work}", flush=True)
    return key


def examined(task: dict[str, Any]) -> dict[str, Any]:
    """Run the diagnosis on one folder."""
    return {"values": diagnose(Path(task["folder"]), finder=task["finder"])}


def kinds_of(folder: Path) -> dict[str, str]:
    """Return the kind of each exposure by its name."""
    recording = tomllib.loads((folder / "recording.toml").read_text(encoding="utf-8"))
    return {exposure["name"]: exposure["kind"] for exposure in recording["exposure"]}


def report(cases: list[dict[str, Any]]) -> None:
    """Print figures, parameters and shortfalls."""
    print("\n".join(["", *figures(cases)]))
    print("\nParameters that both read alike\n" + "\n".join(parameters(cases) or ["none"]))
    print("\nFell short\n" + "\n".join(shortfalls(cases) or ["none"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=48)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unlisted", action="store_true", help="each effect on no list, alone")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path)
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()
    if options.work is None:
        which = "unlisted" if options.unlisted else options.cases
        options.work = Path(gettempdir()) / f"dsis-second-{options.seed}-{which}"
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
    cases = [
        judge(key[name], found[name]["values"], kinds_of(options.work / name)) for name in tasks
    ]
    write_ledger(options.work / "judged.jsonl", cases)
    report(cases)
    print("\n" + versions(found.values()))


if __name__ == "__main__":
    main()
