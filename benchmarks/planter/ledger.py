"""Many cases, in processes, each one line of JSON: killed runs go on where they stopped.

An entry keeps a fingerprint of its task, so that a ledger of other cases is not taken for this
one's, and of the code that was judged: `versions` says where a ledger mixes several.
"""

import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

Task = TypeVar("Task")
PROJECT = Path(__file__).resolve().parents[2]
JUDGED = ("analysis", "dsis", "benchmarks/planter")


def read_ledger(path: Path) -> dict[str, dict[str, Any]]:
    """Return what is done, by task; a last line that a kill cut short does not count."""
    done = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        done[entry["task"]] = entry
    return done


def write_ledger(path: Path, entries: Iterable[Mapping[str, Any]]) -> None:
    """Write entries, a line of JSON each."""
    lines = (json.dumps(entry, sort_keys=True) + "\n" for entry in entries)
    path.write_text("".join(lines), encoding="utf-8")


def work_through(
    path: Path, tasks: Mapping[str, Task], work: Callable[[Task], Mapping[str, Any]], jobs: int
) -> dict[str, dict[str, Any]]:
    """Do every task that the ledger lacks and return all entries, in the order of `tasks`.

    Parameters
    ----------
    path
        The ledger, one line of JSON a task.
    tasks
        By name, JSON-able; an entry of the same name but of another task is done anew.
    work
        Makes an entry of a task, in another process; importable.
    jobs
        Processes.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    done, code = read_ledger(path), fingerprint_of_code()
    marks = {name: fingerprint(json.dumps(task, sort_keys=True)) for name, task in tasks.items()}
    left = {n: task for n, task in tasks.items() if done.get(n, {}).get("of") != marks[n]}
    begun = time.monotonic()
    with (
        path.open("a", encoding="utf-8") as lines,
        ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool,
    ):
        if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
            lines.write("\n")
        waiting = {pool.submit(work, task): name for name, task in left.items()}
        for number, future in enumerate(as_completed(waiting), 1):
            name = waiting[future]
            entry = {"task": name, "of": marks[name], "code": code, **future.result()}
            lines.write(json.dumps(entry, sort_keys=True) + "\n")
            lines.flush()
            done[entry["task"]] = entry
            _say(number, len(left), time.monotonic() - begun)
    return {name: done[name] for name in tasks}


def fingerprint(*texts: str) -> str:
    """Return the first digits of the SHA-256 of texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:12]


def fingerprint_of_code() -> str:
    """Return a fingerprint of all source files that results depend on."""
    paths = sorted(path for part in JUDGED for path in (PROJECT / part).rglob("*.py"))
    return fingerprint(*(path.read_text(encoding="utf-8") for path in paths))


def versions(entries: Iterable[Mapping[str, Any]]) -> str:
    """Return a line that says by which code entries were made."""
    codes = Counter(entry["code"] for entry in entries)
    mixed = "" if len(codes) == 1 else " (MIXED: delete the ledger to judge one)"
    made = ", ".join(f"{code}: {count}" for code, count in codes.most_common())
    return f"cases by version of the code: {made}{mixed}"


def _say(number: int, total: int, seconds: float) -> None:
    if sys.stderr.isatty():
        left = seconds / number * (total - number)
        print(f"\r{number}/{total}, {left / 60:.0f} min left ", end="", file=sys.stderr)
