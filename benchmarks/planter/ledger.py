"""Many cases, in processes, each one line of JSON: killed runs go on where they stopped."""

import json
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

Task = TypeVar("Task")


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


def work_through(
    path: Path, tasks: Mapping[str, Task], work: Callable[[Task], Mapping[str, Any]], jobs: int
) -> dict[str, dict[str, Any]]:
    """Do every task that the ledger lacks and return all entries, in the order of `tasks`.

    Parameters
    ----------
    path
        The ledger, one line of JSON a task.
    tasks
        By name; a name stands for the same task in every run.
    work
        Makes an entry of a task, in another process; importable.
    jobs
        Processes.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    done = read_ledger(path)
    left = {name: task for name, task in tasks.items() if name not in done}
    begun = time.monotonic()
    with (
        path.open("a", encoding="utf-8") as lines,
        ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool,
    ):
        if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
            lines.write("\n")
        waiting = {pool.submit(work, task): name for name, task in left.items()}
        for number, future in enumerate(as_completed(waiting), 1):
            entry = {"task": waiting[future], **future.result()}
            lines.write(json.dumps(entry, sort_keys=True) + "\n")
            lines.flush()
            done[entry["task"]] = entry
            _say(number, len(left), time.monotonic() - begun)
    return {name: done[name] for name in tasks}


def _say(number: int, total: int, seconds: float) -> None:
    if sys.stderr.isatty():
        left = seconds / number * (total - number)
        print(f"\r{number}/{total}, {left / 60:.0f} min left ", end="", file=sys.stderr)
