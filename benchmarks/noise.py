"""Signal-dependent noise against numpy's generator, in one run: `python benchmarks/noise.py`.

Prints nanoseconds per sample (median of 5, one thread and two) and the ratio to numpy's
`Generator.standard_normal(float32)` followed by the scaling.
"""

import statistics
import time
from collections.abc import Callable

import numpy as np

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.noise import Segments, camera_noise

ROWS, COLUMNS, RUNS = 1620, 2880, 5


def seconds(work: Callable[[], object]) -> float:
    work()
    times = []
    for _ in range(RUNS):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def main() -> None:
    segments = Segments.of([(-np.inf, 2.18, 22.9), (1000.0, 8.7, 383.0)])
    grid = PixelGrid(ROWS, COLUMNS, Cfa.RGGB)
    clean = np.full(grid.shape, 800.0, np.float32)
    generator = np.random.default_rng(0)
    deviates = np.empty(grid.shape, np.float32)

    def numpy_noise() -> np.ndarray:
        generator.standard_normal(dtype=np.float32, out=deviates)
        return clean + np.sqrt(np.float32(2.18) * clean + np.float32(22.9)) * deviates

    rows = [
        ("numpy standard_normal + scaling", seconds(numpy_noise)),
        ("numpy standard_normal alone", seconds(
            lambda: generator.standard_normal(dtype=np.float32, out=deviates))),
    ]  # fmt: skip
    for threads in (1, 2):
        rows += [
            (f"dsis normal field, {threads} thread(s)", seconds(
                lambda n=threads: Draw(1).normal("a", grid, 0, threads=n))),
            (f"dsis camera noise (shot + read), {threads} thread(s)", seconds(
                lambda n=threads: camera_noise(clean, segments, Draw(1), grid, 0, threads=n))),
        ]  # fmt: skip
    base = rows[0][1]
    print(f"{'':44}{'ns/sample':>10}{'x numpy':>9}")
    for name, took in rows:
        print(f"{name:44}{took / clean.size * 1e9:10.2f}{base / took:9.2f}")


if __name__ == "__main__":
    main()
