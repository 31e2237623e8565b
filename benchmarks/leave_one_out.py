"""Leave one effect out: `python benchmarks/leave_one_out.py CAMERA.toml RECORDING`.

Diagnoses a recording with the whole vocabulary, then once more for each effect that was named,
without it: nothing else may be named in its place, and what it explained must stay unexplained.
Exit status 1 where something else is named.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import KINDS
from planter.finder import FINDER, diagnose, named
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("camera", type=Path)
    parser.add_argument("recording", type=Path, help="folder or EMVA 1288 descriptor")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()

    def found(vocabulary: list[str] | None) -> dict[str, Any]:
        values = diagnose(
            options.recording,
            finder=options.finder,
            seed=options.seed,
            vocabulary=vocabulary,
            camera=options.camera,
        )
        if "error" in values:
            sys.exit(values["traceback"])
        return values

    whole = found(None)
    print(f"named: {', '.join(named(whole)) or 'nothing'} ({whole['seconds']:.0f} s)", flush=True)
    rows = [row(whole, found(sorted(KINDS - {kind})), kind) for kind in named(whole)]
    print(table(["left out", "named instead", "no longer named", "left unexplained"], rows))
    wrong = [left for left, instead, _, _ in rows if instead != "-"]
    print("nothing else is named" if not wrong else f"named in place of: {', '.join(wrong)}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
