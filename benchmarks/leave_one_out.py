"""Leave one effect out: `python benchmarks/leave_one_out.py CAMERA.toml RECORDING`.

Diagnoses a recording with the whole vocabulary, then once more for each effect that was named,
without it: nothing else may be named in its place, and what it explained must stay unexplained.
Resumable: one line of JSON a diagnosis in --work. Exit status 1 where something else is named.
"""

import argparse
import sys
from pathlib import Path
from tempfile import gettempdir
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import KINDS
from planter.finder import FINDER, diagnose, named
from planter.ledger import versions, work_through
from planter.tables import table


def explained_by(values: dict[str, Any], kind: str) -> set[str]:
    """Return the statistics that an effect was called upon for."""
    entries = values.get("omitted_physics", ())
    return {name for entry in entries if entry["effect"] == kind for name in entry["because"]}


def row(whole: dict[str, Any], left: dict[str, Any], kind: str) -> tuple[str, ...]:
    """Return what changes when an effect is left out."""
    instead = sorted(set(named(left)) - (set(named(whole)) - {kind}))
    lost = sorted(set(named(whole)) - set(named(left)) - {kind})
    unexplained = {entry["statistic"] for entry in left.get("unexplained", ())}
    still = sorted(explained_by(whole, kind) & unexplained)
    return kind, ", ".join(instead) or "-", ", ".join(lost) or "-", ", ".join(still) or "-"


def found(task: dict[str, Any]) -> dict[str, Any]:
    """Return what a recording is diagnosed as, with some vocabulary; None: the whole."""
    values = diagnose(
        Path(task["recording"]),
        finder=task["finder"],
        seed=task["seed"],
        vocabulary=task["vocabulary"],
        camera=Path(task["camera"]),
    )
    return {"values": values}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("camera", type=Path)
    parser.add_argument("recording", type=Path, help="folder or EMVA 1288 descriptor")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses side by side")
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-leave-one-out")
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()

    def diagnosed(vocabularies: dict[str, list[str] | None]) -> dict[str, dict[str, Any]]:
        how = {name: str(getattr(options, name)) for name in ("camera", "recording", "finder")}
        tasks = {
            name: {**how, "seed": options.seed, "vocabulary": words}
            for name, words in vocabularies.items()
        }
        done = work_through(options.work / "found.jsonl", tasks, found, options.jobs)
        print(versions(done.values()))
        values = {name: entry["values"] for name, entry in done.items()}
        for failed in (one for one in values.values() if "error" in one):
            sys.exit(failed["traceback"])
        return values

    whole = diagnosed({"all": None})["all"]
    print(f"named: {', '.join(named(whole)) or 'nothing'} ({whole['seconds']:.0f} s)", flush=True)
    without = diagnosed({kind: sorted(KINDS - {kind}) for kind in named(whole)})
    rows = [row(whole, left, kind) for kind, left in without.items()]
    print(table(["left out", "named instead", "no longer named", "left unexplained"], rows))
    wrong = [left for left, instead, _, _ in rows if instead != "-"]
    print("nothing else is named" if not wrong else f"named in place of: {', '.join(wrong)}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
