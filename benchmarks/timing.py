"""How the benchmarks measure and report: interleaved medians, limits of the machine, tables."""

import csv
import math
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from dsis.compiled import kernel, over_rows

Work = Callable[[], object]
PACKAGES = ("dsis", "numpy", "numba", "opencolorio", "openimageio", "opencv-python-headless",
            "colour-demosaicing")  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One figure, and what it is a ratio to."""

    benchmark: str
    what: str
    value: float
    unit: str
    ratio: float | None = None
    against: str = ""

    def __str__(self) -> str:
        ratio = f"{self.ratio:8.2f} x {self.against}" if self.ratio is not None else self.against
        return f"{self.benchmark:14}{self.what:46}{self.value:10.4g} {self.unit:10}{ratio}"


def medians(
    works: Mapping[str, Work], rounds: int = 5, clock: Callable[[], float] = time.perf_counter
) -> dict[str, float]:
    """Return the median seconds of each; in turn, so that a busy machine disturbs all alike.

    `time.process_time` as the clock counts the time of this process alone, all threads summed.
    """
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()  # compiles, and fills buffers
    for _ in range(rounds):
        for name, work in works.items():
            begun = clock()
            work()
            seconds[name].append(clock() - begun)
    return {name: statistics.median(measured) for name, measured in seconds.items()}


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Return the slope of log seconds against log size: 1 is linear growth."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def copying(mosaic: np.ndarray, out: np.ndarray, threads: int) -> Work:
    """Return what reads each sample and writes it three times: what demosaicking must move."""

    def block(first: int, last: int) -> None:
        _copy(mosaic[first:last].reshape(-1), out[first:last].reshape(-1))

    return lambda: over_rows(block, len(mosaic), threads)


@kernel
def _copy(samples: np.ndarray, out: np.ndarray) -> None:
    for i in range(np.uintp(samples.size)):
        out[3 * i], out[3 * i + 1], out[3 * i + 2] = samples[i], samples[i], samples[i]


@cache
def operations_per_s() -> float:
    """Return float32 additions and multiplications per second of one core, on cached data."""
    values, repeats = np.full(2048, 0.5, np.float32), 2000
    took = min(medians({str(n): lambda: _polynomial(values, repeats) for n in range(5)}).values())
    return 16 * values.size * repeats / took


@kernel
def _polynomial(values: np.ndarray, repeats: int) -> None:
    c = np.float32(0.25)
    for _ in range(repeats):
        for i in range(np.uintp(values.size)):
            x = values[i]
            y = ((((((x * x + c) * x + c) * x + c) * x + c) * x + c) * x + c) * x + c
            values[i] = y * x + c


def machine() -> dict[str, str]:
    """Return what the figures depend on: processor, load, versions, date."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").splitlines()
        names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        model = names[0] if names else model
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": model,
        "cores": str(os.cpu_count()),
        "load": load,
        "python": platform.python_version(),
    } | {name: _version(name) for name in PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def show(rows: Iterable[Row]) -> list[Row]:
    """Print rows as they come, and return them."""
    kept = []
    for row in rows:
        print(row, flush=True)
        kept.append(row)
    return kept


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """Write rows, each with the machine it was measured on."""
    here = machine()
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [*asdict(rows[0]), *here])
        table.writeheader()
        for row in rows:
            values = asdict(row)
            if row.ratio is not None and not math.isfinite(row.ratio):
                values["ratio"] = ""
            table.writerow(values | here)
