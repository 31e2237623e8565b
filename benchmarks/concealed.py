"""The concealed proof: `python benchmarks/concealed.py --cases 200 --jobs 2`.

Draws stratified random cases - no effect (30 %), one, two, three effects of random strength, every
effect in turn, mono and Bayer, decoys, wrong base numbers, effects that camera.toml has already
(some of a wrong size), effects taken out of the vocabulary, effects planted into the real CCD
recording - with a simulator that shares no code with dsis. Writes recordings and a sealed key,
prints the key's SHA-256, runs the diagnosis on the files alone, opens the key and prints what was
found. Resumable: everything lies in --work, one line of JSON a case.
"""

import argparse
import json
import sys
from pathlib import Path
from tempfile import gettempdir
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import KINDS
from planter import ranking as rank
from planter.deck import deal
from planter.finder import FINDER, diagnose, named
from planter.judgement import judge
from planter.layout import LAYOUTS
from planter.ledger import fingerprint, versions, work_through, write_ledger
from planter.onreal import RealFrames
from planter.seal import CROP, conceal, deal_values, reference, seal, vocabulary

CCD = Path(__file__).resolve().parents[2] / "shared" / "data" / "emva1288_ccd12"
REFERENCE = "real-reference"


def concealed(options: argparse.Namespace) -> dict[str, dict[str, Any]]:
    """Write all recordings and the key; print its hash; return it."""
    deals = deal(options.seed, options.cases, options.only)
    if options.no_word:
        deals = [d for d in deals if d.out is not None]
    if options.real:
        deals = [d for d in deals if d.real]
    ccd = options.ccd / "EMVA1288_Data.txt" if options.ccd.is_dir() else options.ccd
    if not ccd.exists():
        print(f"no real recording at {ccd}: those cases are simulated")
        deals = [type(d)(**{**deal_values(d), "real": False}) for d in deals]
    if any(d.real for d in deals):
        reference(options.work, RealFrames.read(ccd, *CROP))
    names = {d.number: f"case-{d.number:03}" for d in deals}
    tasks = {
        names[d.number]: {
            "deal": deal_values(d),
            "seed": options.seed,
            "layout": options.layout,
            "work": str(options.work),
            "folder": str(options.work / names[d.number]),
            "ccd": str(ccd),
        }
        for d in deals
    }
    key = work_through(options.work / "key.partial", tasks, conceal, options.jobs)
    digest = seal(options.work / "key.jsonl", key)
    print(f"{len(key)} recordings in {options.work}; sealed key SHA-256 {digest}", flush=True)
    return key


def examined(task: dict[str, Any]) -> dict[str, Any]:
    """Run the diagnosis on one folder."""
    values = diagnose(
        Path(task["folder"]),
        finder=task["finder"],
        seed=task["number"],
        vocabulary=task["vocabulary"],
    )
    return {"values": values}


def report(cases: list[dict[str, Any]]) -> None:
    """Print all tables."""
    print("\nGoals\n" + rank.goals(cases))
    print("\nPower against strength\n" + rank.power(cases))
    print("\nWrong names\n" + rank.confusion(cases))
    print("\nParameters\n" + rank.parameters(cases))
    seconds = sorted(case["seconds"] for case in cases)
    print(f"\nSeconds a case: median {seconds[len(seconds) // 2]:.1f}, most {seconds[-1]:.1f}")
    print("\nFell short\n" + "\n".join(rank.remarkable(cases)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=sorted(KINDS), help="this effect alone")
    parser.add_argument(
        "--no-word", action="store_true", help="of these only cases with an effect without a word"
    )
    parser.add_argument(
        "--real", action="store_true", help="of these only cases planted into real frames"
    )
    parser.add_argument("--layout", choices=sorted(LAYOUTS), default="small")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path)
    parser.add_argument("--ccd", type=Path, default=CCD)
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()
    if options.work is None:
        drawn = f"{options.seed}-{options.cases}" + (f"-{options.only}" if options.only else "")
        drawn += "-no-word" if options.no_word else ""
        drawn += "-real" if options.real else ""
        drawn += "" if options.layout == "small" else f"-{options.layout}"
        options.work = Path(gettempdir()) / f"dsis-concealed-{drawn}"
    options.work.mkdir(parents=True, exist_ok=True)
    key = concealed(options)
    tasks = {
        name: {
            "folder": str(options.work / name),
            "finder": options.finder,
            "number": number,
            "vocabulary": vocabulary(key[name]),
            "key": fingerprint(json.dumps(key[name]["case"], sort_keys=True)),
        }
        for number, name in enumerate(sorted(key))
    }
    if any(entry["real"] for entry in key.values()):
        folder = str(options.work / REFERENCE)
        tasks[REFERENCE] = {**tasks[min(tasks)], "folder": folder, "vocabulary": None}
    found = work_through(options.work / "found.jsonl", tasks, examined, options.jobs)
    cases = opened_key(key, found)
    write_ledger(options.work / "judged.jsonl", cases)
    report(cases)
    print("\n" + versions(found.values()))


def opened_key(
    key: dict[str, dict[str, Any]], found: dict[str, dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return all cases with their judgement.

    On real frames only what is named beyond their own physics can be wrong; where that is not
    known, those cases are left out.
    """
    names, own = sorted(key), []
    if REFERENCE in found:
        values = found[REFERENCE]["values"]
        own = named(values)
        says = values.get("error") or ", ".join(own) or "nothing named"
        print(f"the real frames alone: {says} [{values['verdict']}]")
        if "error" in values:
            left_out = [name for name in names if key[name]["real"]]
            print(f"left out, for nothing can be said of them: {', '.join(left_out)}")
            names = [name for name in names if not key[name]["real"]]
    return [opened(key[name], found[name]["values"], own) for name in names]


def opened(entry: dict[str, Any], values: dict[str, Any], own: list[str]) -> dict[str, Any]:
    """Return a case with its judgement."""
    known = own if entry["real"] else []
    return {
        **entry,
        **judge(entry, values, known),
        "own": known,
        "verdict": values["verdict"],
        "mismatches": len(values.get("mismatches", ())),
        "gap_closed": (values.get("fit") or {}).get("gap_closed"),
        "error": values.get("error"),
        "seconds": values["seconds"],
    }


if __name__ == "__main__":
    main()
