"""Signal-dependent noise against numpy's generator: `python benchmarks/noise.py`.

The peer is numpy's `Generator.standard_normal(float32)` followed by the scaling, one draw a sample;
dsis draws shot and read noise apart, two. The limit: additions and multiplications of one core,
against the operations per sample counted in the sources (of which half are on integers).
"""

from collections.abc import Iterator

import numpy as np
from timing import Row, Work, medians, operations_per_s, show

from dsis.cfa import Cfa
from dsis.draw import Draw
from dsis.grid import PixelGrid
from dsis.noise import Segments, camera_noise

ROWS, COLUMNS = 1620, 2880
OPERATIONS = {"normal field": 66, "camera noise": 140}


def rows() -> Iterator[Row]:
    segments = Segments.of([(-np.inf, 2.18, 22.9), (1000.0, 8.7, 383.0)])
    grid = PixelGrid(ROWS, COLUMNS, Cfa.RGGB)
    clean = np.full(grid.shape, 800.0, np.float32)
    generator, deviates = np.random.default_rng(0), np.empty(grid.shape, np.float32)

    def peer() -> np.ndarray:
        generator.standard_normal(dtype=np.float32, out=deviates)
        return clean + np.sqrt(np.float32(2.18) * clean + np.float32(22.9)) * deviates

    works: dict[str, Work] = {"numpy standard_normal + scaling": peer}
    for n in (1, 2):
        works |= {
            f"normal field, {n} threads": lambda n=n: Draw(1).normal("a", grid, 0, threads=n),
            f"camera noise, {n} threads": lambda n=n: camera_noise(
                clean, segments, Draw(1), grid, 0, threads=n
            ),
        }
    seconds = medians(works, rounds=9)
    base = seconds["numpy standard_normal + scaling"]
    for what, took in seconds.items():
        speed = clean.size / 1e6 / took
        yield Row("noise", what, speed, "Msample/s", base / took, "numpy")
        if what.endswith("1 threads"):
            operations = OPERATIONS[what.partition(",")[0]]
            share = operations * speed * 1e6 / operations_per_s()
            limit = f"{operations_per_s() / 1e9:.0f} Gop/s (roofline: {operations} a sample)"
            yield Row("noise", what, speed, "Msample/s", share, limit)


if __name__ == "__main__":
    show(rows())
