"""What the commands have in common: kinds of value, and options that several take."""

import argparse
import math
import os
from collections.abc import Callable
from typing import TypeAlias

Add = Callable[..., argparse.ArgumentParser]
Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # noqa: SLF001 - argparse has no public name for it


def adder(commands: Commands, prefix: str = "") -> Add:
    """Return what adds a command with its help and an example to a group of commands."""

    def add(
        name: str, function: Callable[[argparse.Namespace], None], says: str, example: str
    ) -> argparse.ArgumentParser:
        sub = commands.add_parser(
            name,
            help=says,
            description=says,
            epilog=f"example:\n  dsis {prefix}{example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        sub.set_defaults(command=function)
        return sub

    return add


_LARGEST = 2**63 - 1


def whole(low: int, high: int = _LARGEST) -> Callable[[str], int]:
    """Return what reads a whole number from `low` to `high`."""
    bounds = f"from {low} to {high}" if high < _LARGEST else f"of {low} or more"

    def read(text: str) -> int:
        if not text.isdecimal() or not low <= int(text) <= high:
            message = f"is {text!r}, must be a whole number {bounds}"
            raise argparse.ArgumentTypeError(message)
        return int(text)

    return read


def number(low: float = -math.inf) -> Callable[[str], float]:
    """Return what reads a finite number, no smaller than `low`."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or value < low:
            bound = "" if low == -math.inf else f" from {low:g}"
            message = f"is {text!r}, must be a number{bound}"
            raise argparse.ArgumentTypeError(message)
        return value

    return read


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def add_jobs(sub: argparse.ArgumentParser) -> None:
    """Take how many threads or processes work."""
    sub.add_argument(
        "--jobs",
        type=whole(1),
        default=_cores(),
        metavar="N",
        help="threads or processes (default: one a core)",
    )


def add_scheduler(sub: argparse.ArgumentParser) -> None:
    """Take the cluster that works instead of this machine."""
    cluster = "of a Dask cluster that does the work instead: tcp://HOST:8786 (extra dsis[cluster])"
    sub.add_argument("--scheduler", metavar="ADDRESS", help=cluster)


def add_seed(sub: argparse.ArgumentParser, default: str) -> None:
    """Take the seed; `default` says what holds without it."""
    sub.add_argument(
        "--seed", type=whole(0), metavar="N", help=f"fixes every random number ({default})"
    )


def add_scale(sub: argparse.ArgumentParser) -> None:
    """Take the ends of the scale of votes."""
    ends = "ends of the scale, worst first; default: datapackage.json"
    sub.add_argument("--scale", nargs=2, type=number(), metavar=("LOW", "HIGH"), help=ends)
