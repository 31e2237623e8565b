"""False alarms of `dsis mismatch`: `python benchmarks/mismatch_nulls.py --cases 200`.

Recordings of random base cameras without any hidden effect, mono and Bayer, one and two segments,
6 to 100 frames an exposure, read noise of 0.3 to 50 DN, codes of 12 to 16 bits; camera.toml is
true, or fitted by `dsis camera fit` to the same recording or to another one of the same camera.
Goal: a mismatch claimed in at most 1 % + 2 standard errors of them. `--large N` adds N recordings
of 10^7 pixels a frame, `--narrow N` such whose read noise is a tenth to four tenths of a code, half
of them with offsets of pixels. Resumable: finished cases are in WORK/nulls.jsonl.
"""

import argparse
import shutil
import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))  # processes that are started afresh need it too
from planter import Case, Choice, Effect, Layout, draw_case, plant
from planter.finder import FINDER, diagnose, largest, named
from planter.fitted import fit_into
from planter.layout import BAYER
from planter.ledger import versions, work_through
from planter.tables import share, table

from dsis.errors import InputError

Task = dict[str, Any]
ALLOWED = 0.01


def drawn(seed: int, number: int) -> tuple[Case, str]:
    """Return null case `number` and where its camera.toml comes from."""
    rng = np.random.default_rng([seed, number, 41])
    frames = int(rng.choice([6, 8, 8, 12, 16, 30, 50, 100]))
    # As many samples whatever the number of frames: 2^17 or so an exposure.
    rows, columns = {6: (96, 128), 8: (96, 128), 12: (96, 128), 16: (80, 104)}.get(
        frames, (48, 64) if frames < 100 else (36, 48)
    )
    choice = Choice(
        cfa="MONO" if number % 2 else str(rng.choice(BAYER)),
        segments=1 + (number // 2) % 2,
        read_noise_dn=float(np.exp(rng.uniform(np.log(0.3), np.log(50)))),
        frames=frames,
        scene=bool(rng.random() < 0.25),
    )
    layout = Layout(rows, columns, int(rng.integers(5, 9)), frames, frames)
    case = draw_case(int(rng.integers(2**31)), layout, choice)
    origin = ("true", "fitted to another", "fitted to the same")[(number // 4) % 3]
    # Skewed, and camera.toml says so: a fit would not.
    if rng.random() < 0.2 and origin == "true":
        case = replace(case, shot="poisson")
    return case, origin


def large(seed: int, number: int) -> tuple[Case, str]:
    """Return null case `number` of 10^7 pixels a frame."""
    choice = Choice(cfa=("MONO", "RGGB")[number % 2], segments=1 + number // 2 % 2)
    return draw_case(seed + 10**6 + number, "large", choice), "true"


def narrow(seed: int, number: int) -> tuple[Case, str]:
    """Return null case `number` whose read noise is narrower than half a code."""
    rng = np.random.default_rng([seed, number, 43])
    choice = Choice(
        cfa=("MONO", "RGGB")[number // 2 % 2],
        segments=1,
        bit_depth=12,
        read_noise_dn=float(rng.uniform(0.1, 0.4)),
        electrons=float(rng.uniform(3e4, 9e4)),
    )
    case = draw_case(seed + 2 * 10**6 + number, "small", choice)
    if number % 2:
        offsets = Effect("dsnu", {"sigma_dn": float(rng.uniform(0.05, 0.3))})
        case = replace(case.having(offsets), known=("dsnu",))
    return case, "true"


KINDS = {"null": drawn, "large": large, "narrow": narrow}


def judged(task: Task) -> dict[str, Any]:
    """Plant, diagnose, return what a null must not show."""
    case, origin = KINDS[task["kind"]](task["seed"], task["number"])
    folder = Path(task["work"]) / f"{task['kind']}-{task['number']}"
    try:
        plant(folder, case)
        if origin != "true":
            other = folder
            if origin == "fitted to another":
                other = plant(folder / "calibration", replace(case, seed=case.seed + 2**33))
            try:
                fit_into(folder, other)
            except InputError:  # too few levels for a line: the camera stays as it is
                origin = "true"
        values = diagnose(folder, finder=task["finder"], seed=task["number"])
    finally:
        if not task["keep"]:
            shutil.rmtree(folder, ignore_errors=True)
    z, statistic = largest(values)
    return {
        "verdict": values["verdict"],
        "named": named(values),
        "mismatches": [[m["statistic"], m["z"]] for m in values.get("mismatches", ())],
        "parameter_errors": [p["parameter"] for p in values.get("parameter_errors", ())],
        "largest_z": z,
        "statistic": statistic,
        "seconds": values["seconds"],
        "error": values.get("error"),
        "camera": origin,
        "cfa": "mono" if case.cfa == "MONO" else "Bayer",
        "segments": len(case.segments),
        "frames": case.exposures[0].frames,
        "read_noise_dn": round(case.segments[0].intercept ** 0.5, 2),
        "kind": task["kind"],
    }


def alarm(entry: dict[str, Any]) -> bool:
    """Tell whether a null was mistaken; a crash shows nothing, so it is no success."""
    return bool(entry["mismatches"] or entry["error"])


def report(entries: list[dict[str, Any]]) -> None:
    """Print shares, then the same by stratum."""
    alarms = [e for e in entries if alarm(e)]
    allowed = ALLOWED + 2 * (ALLOWED * (1 - ALLOWED) / len(entries)) ** 0.5
    print(
        f"a mismatch or a crash  {share(len(alarms), len(entries))}, goal <= {100 * allowed:.1f} %"
    )
    for verdict, count in Counter(e["verdict"] for e in entries).most_common():
        print(f"verdict {verdict:15}{share(count, len(entries))}")
    print(f"an effect named        {share(sum(bool(e['named']) for e in entries), len(entries))}")
    top = max(entries, key=lambda e: e["largest_z"])
    print(f"largest |z| claimed    {top['largest_z']:.1f} ({top['statistic']}, {top['task']})")
    seconds = sorted(e["seconds"] for e in entries)
    print(f"seconds a case         median {seconds[len(seconds) // 2]:.1f}, most {seconds[-1]:.1f}")
    for e in entries:
        if e["error"] or e["mismatches"] or e["verdict"] != "match":
            what = e["error"] or ", ".join(f"{s} {z:.1f}" for s, z in e["mismatches"])
            print(f"  {e['task']}: {e['verdict']} {what or e['parameter_errors']}")
    print()
    print(table(["stratum", "mismatch or crash", "parameters claimed"], strata(entries)))


def strata(entries: list[dict[str, Any]]) -> Iterable[tuple[str, str, str]]:
    """Yield a row for each group of cases."""
    groups = {
        "camera.toml": lambda e: e["camera"],
        "sensor": lambda e: e["cfa"],
        "segments": lambda e: e["segments"],
        "frames": lambda e: e["frames"],
        "read noise": lambda e: (
            "0.1-1 DN"
            if e["read_noise_dn"] < 1
            else "1-7 DN"
            if e["read_noise_dn"] < 7
            else "7-50 DN"
        ),
        "recordings": lambda e: {"null": "small", "large": "10^7 pixels"}.get(e["kind"], e["kind"]),
    }
    for name, key in groups.items():
        for value in sorted({key(e) for e in entries}):
            own = [e for e in entries if key(e) == value]
            alarms = sum(alarm(e) for e in own)
            wrong = sum(e["verdict"] == "parameters" for e in own)
            yield f"{name}: {value}", share(alarms, len(own)), share(wrong, len(own))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--large", type=int, default=0)
    parser.add_argument("--narrow", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--work", type=Path, default=Path(gettempdir()) / "dsis-nulls")
    parser.add_argument("--finder", default=FINDER)
    parser.add_argument("--keep", action="store_true", help="keep the recordings")
    options = parser.parse_args()
    common = {"work": str(options.work), "seed": options.seed, "finder": options.finder}
    common["keep"] = options.keep
    counts = {"null": options.cases, "large": options.large, "narrow": options.narrow}
    tasks = {
        f"{kind}-{options.seed}-{i}": {**common, "number": i, "kind": kind}
        for kind, count in counts.items()
        for i in range(count)
    }
    done = work_through(options.work / "nulls.jsonl", tasks, judged, options.jobs)
    report(list(done.values()))
    print(versions(done.values()))


if __name__ == "__main__":
    main()
