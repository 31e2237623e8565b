"""Leave one effect out: `python benchmarks/leave_one_out.py CAMERA.toml RECORDING`.

Diagnoses a recording with the whole vocabulary, then once more for each effect that was named,
without it: nothing else may be named in its place, and what it explained must stay unexplained.
Exit status 1 where something else is named.
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
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


def found(
    vocabulary: list[str] | None, recording: Path, finder: str, seed: int, camera: Path
) -> dict[str, Any]:
    """Return what a recording is diagnosed as with some vocabulary; None: the whole."""
    values = diagnose(recording, finder=finder, seed=seed, vocabulary=vocabulary, camera=camera)
    if "error" in values:
        sys.exit(values["traceback"])
    return values


def without(how: tuple[Path, str, int, Path], kind: str) -> dict[str, Any]:
    """Return the same without a kind."""
    return found(sorted(KINDS - {kind}), *how)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("camera", type=Path)
    parser.add_argument("recording", type=Path, help="folder or EMVA 1288 descriptor")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="diagnoses side by side")
    parser.add_argument("--finder", default=FINDER)
    options = parser.parse_args()

    how = options.recording, options.finder, options.seed, options.camera
    whole = found(None, *how)
    print(f"named: {', '.join(named(whole)) or 'nothing'} ({whole['seconds']:.0f} s)", flush=True)
    asked = partial(without, how)
    kinds = named(whole)
    with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
        rows = []
        for kind, left in zip(kinds, pool.map(asked, kinds), strict=True):
            rows.append(row(whole, left, kind))
            print(f"without {kind}: {', '.join(named(left))} ({left['seconds']:.0f} s)", flush=True)
    print(table(["left out", "named instead", "no longer named", "left unexplained"], rows))
    wrong = [left for left, instead, _, _ in rows if instead != "-"]
    print("nothing else is named" if not wrong else f"named in place of: {', '.join(wrong)}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
