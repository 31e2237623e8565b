"""Speed of demosaicking beside other libraries: `python benchmarks/demosaicking.py`.

One frame of 2880 x 1620, outputs re-used where a library can. The peers are in the extra `bench`:
colour-demosaicing (float64, one thread) and OpenCV, whose uint16 moves half the bytes of float32.
One thread is timed by its processor time, which other work on the machine disturbs less.
Limits: for bilinear a copy that reads one float32 and writes three, and beside it the bytes that
each moves in a second, which two threads share; for the others the additions and multiplications
of one core, against the operations per pixel counted in their sources.
"""

import importlib
import time
from collections.abc import Iterator
from functools import partial

import numpy as np
from timing import Row, Work, copying, medians, operations_per_s, show

from dsis.cfa import Cfa
from dsis.demosaic import METHODS, demosaic

ROWS, COLUMNS = 1620, 2880
MPIX = ROWS * COLUMNS / 1e6
OPERATIONS = {"dlmmse": 165, "lu_tan": 235}  # per pixel
BYTES, THEIR_BYTES = 16, 8  # of a pixel that bilinear demosaicking must move: float32, uint16
MENON = "colour-demosaicing Menon2007"
OPENCV = "OpenCV bilinear uint16"
PEERS = {
    "bilinear": ("colour-demosaicing bilinear", OPENCV),
    "dlmmse": (MENON,),
    "lu_tan": (MENON,),
}


def colour_demosaicing(mosaic: np.ndarray) -> dict[str, Work]:
    try:
        peer = importlib.import_module("colour_demosaicing")
    except ImportError:
        return {}
    return {
        f"colour-demosaicing {name}": partial(
            getattr(peer, f"demosaicing_CFA_Bayer_{name}"), mosaic.astype(float), "RGGB"
        )
        for name in ("bilinear", "Menon2007")
    }


def opencv(mosaic: np.ndarray, threads: int) -> dict[str, Work]:
    try:
        peer = importlib.import_module("cv2")
    except ImportError:
        return {}
    codes, out = np.rint(mosaic * 65535).astype(np.uint16), np.zeros((ROWS, COLUMNS, 3), np.uint16)

    def work() -> None:
        peer.setNumThreads(threads)
        peer.demosaicing(codes, peer.COLOR_BayerBG2RGB, out)  # named by its second row: RGGB

    return {OPENCV: work}


def rows() -> Iterator[Row]:
    mosaic = np.random.default_rng(1).random((ROWS, COLUMNS), np.float32)
    out = np.zeros((ROWS, COLUMNS, 3), np.float32)
    # Seconds a frame: no need of many.
    slow = medians(colour_demosaicing(mosaic), 1, time.process_time)
    for threads in (1, 2):
        name = f"{threads} threads"
        works: dict[str, Work] = {"copy": copying(mosaic, out, threads)}
        for method in METHODS:
            works[method] = partial(demosaic, mosaic, Cfa.RGGB, method, out=out, threads=threads)
        works |= opencv(mosaic, threads)
        clock = time.process_time if threads == 1 else time.perf_counter
        seconds = medians(works, 9, clock)
        yield Row("demosaicking", f"copy 1 -> 3 float32, {name}", MPIX / seconds["copy"], "Mpix/s")
        for method in METHODS:
            took = seconds[method]
            speed = MPIX / took
            what = f"{method}, {name}"
            if method == "bilinear":
                ratio, limit = seconds["copy"] / took, f"the copy (roofline: {BYTES} bytes a pixel)"
            else:
                most = operations_per_s() * threads
                ratio = OPERATIONS[method] * speed * 1e6 / most
                limit = f"{most / 1e9:.0f} Gop/s (roofline: {OPERATIONS[method]} a pixel)"
            yield Row("demosaicking", what, speed, "Mpix/s", ratio, limit)
            for peer, theirs in (seconds | slow).items():
                if peer in PEERS[method]:
                    yield Row("demosaicking", what, speed, "Mpix/s", theirs / took, peer)
            if method == "bilinear" and OPENCV in seconds:
                ratio = BYTES * seconds[OPENCV] / (THEIR_BYTES * took)
                against = f"{OPENCV}, of its {THEIR_BYTES} bytes a pixel"
                yield Row("demosaicking", what, BYTES * speed / 1e3, "GB/s", ratio, against)


if __name__ == "__main__":
    show(rows())
