"""Speed of demosaicking beside other libraries: `python benchmarks/demosaicking.py`.

One frame of 2880 x 1620, outputs re-used where a library can. Rounds go through all rows in turn,
so that a busy machine disturbs all alike; printed is the median of five. The peers are in the
extra `bench`: colour-demosaicing (float64, one thread) and OpenCV (uint16, its own threads).
"""

import importlib
import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from dsis.cfa import Cfa
from dsis.demosaic import METHODS, demosaic
from dsis.demosaic.lu_tan import lu_tan

ROWS, COLUMNS, ROUNDS = 1620, 2880, 5
YARDSTICK = "colour-demosaicing bilinear"

Work = Callable[[], object]


def ours(mosaic: np.ndarray) -> dict[str, Work]:
    out = np.zeros((ROWS, COLUMNS, 3), np.float32)
    rows: dict[str, Work] = {}
    for threads in (1, 2):
        options = {"out": out, "threads": threads}
        for method in METHODS:
            name = f"dsis {method}, threads={threads}"
            rows[name] = partial(demosaic, mosaic, Cfa.RGGB, method, **options)
        name = f"dsis lu_tan with post-processing, threads={threads}"
        rows[name] = partial(lu_tan, mosaic, Cfa.RGGB, post_process=True, **options)
    return rows


def colour_demosaicing(mosaic: np.ndarray) -> dict[str, Work | None]:
    names = ("bilinear", "Malvar2004", "Menon2007")
    try:
        peer = importlib.import_module("colour_demosaicing")
    except ImportError:
        return {f"colour-demosaicing {name}": None for name in names}
    return {
        f"colour-demosaicing {name}": partial(
            getattr(peer, f"demosaicing_CFA_Bayer_{name}"), mosaic.astype(float), "RGGB"
        )
        for name in names
    }


def opencv(mosaic: np.ndarray) -> dict[str, Work | None]:
    name = "OpenCV bilinear"
    try:
        peer = importlib.import_module("cv2")
    except ImportError:
        return {name: None}
    codes = np.rint(mosaic * 65535).astype(np.uint16)
    out = np.zeros((ROWS, COLUMNS, 3), np.uint16)
    # OpenCV names a pattern by its second row: BayerBG is RGGB.
    work = partial(peer.demosaicing, codes, peer.COLOR_BayerBG2RGB, out)
    return {f"{name}, threads={peer.getNumThreads()}": work}


def main() -> None:
    mosaic = np.random.default_rng(1).random((ROWS, COLUMNS), np.float32)
    rows = {**ours(mosaic), **colour_demosaicing(mosaic), **opencv(mosaic)}
    seconds: dict[str, list[float]] = {name: [] for name, work in rows.items() if work is not None}
    for name in seconds:
        rows[name]()  # compiles, and fills buffers
    for _ in range(ROUNDS):
        for name, measured in seconds.items():
            start = time.perf_counter()
            rows[name]()
            measured.append(time.perf_counter() - start)
    speed = {name: ROWS * COLUMNS / 1e6 / statistics.median(s) for name, s in seconds.items()}
    print(f"{COLUMNS} x {ROWS}, median of {ROUNDS}")
    print(f"{'':44} {'Mpix/s':>8}  x {YARDSTICK}")
    for name in rows:
        if name not in speed:
            print(f"{name:44} not installed")
        elif YARDSTICK in speed:
            print(f"{name:44} {speed[name]:8.2f} {speed[name] / speed[YARDSTICK]:8.2f}")
        else:
            print(f"{name:44} {speed[name]:8.2f}        -")


if __name__ == "__main__":
    main()
