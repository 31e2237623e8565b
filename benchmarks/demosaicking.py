"""Speed of demosaicking beside other libraries: `python benchmarks/demosaicking.py`.

One frame of 2880 x 1620, outputs re-used where a library can. The peers are in the extra `bench`:
colour-demosaicing (float64, one thread) and OpenCV, whose uint16 moves half the bytes of float32.
Limits: for bilinear a copy that reads one float32 and writes three; for the others the additions
and multiplications of one core, against the operations per pixel counted in their sources.
"""

import importlib
from collections.abc import Iterator
from functools import partial

import numpy as np
from timing import Row, Work, copying, medians, operations_per_s, show

from dsis.cfa import Cfa
from dsis.demosaic import METHODS, demosaic

ROWS, COLUMNS = 1620, 2880
MPIX = ROWS * COLUMNS / 1e6
OPERATIONS = {"dlmmse": 165, "lu_tan": 235}  # per pixel
MENON = "colour-demosaicing Menon2007"
PEERS = {
    "bilinear": ("colour-demosaicing bilinear", "OpenCV bilinear uint16"),
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

    return {"OpenCV bilinear uint16": work}


def rows() -> Iterator[Row]:
    mosaic = np.random.default_rng(1).random((ROWS, COLUMNS), np.float32)
    out = np.zeros((ROWS, COLUMNS, 3), np.float32)
    slow = medians(colour_demosaicing(mosaic), rounds=1)  # seconds a frame: no need of many
    for threads in (1, 2):
        name = f"{threads} threads"
        works: dict[str, Work] = {"copy": copying(mosaic, out, threads)}
        for method in METHODS:
            works[method] = partial(demosaic, mosaic, Cfa.RGGB, method, out=out, threads=threads)
        works |= opencv(mosaic, threads)
        seconds = medians(works, rounds=9)
        yield Row("demosaicking", f"copy 1 -> 3 float32, {name}", MPIX / seconds["copy"], "Mpix/s")
        for method in METHODS:
            took = seconds[method]
            speed = MPIX / took
            what = f"{method}, {name}"
            if method == "bilinear":
                ratio, limit = seconds["copy"] / took, "the copy (roofline: 16 bytes a pixel)"
            else:
                most = operations_per_s() * threads
                ratio = OPERATIONS[method] * speed * 1e6 / most
                limit = f"{most / 1e9:.0f} Gop/s (roofline: {OPERATIONS[method]} a pixel)"
            yield Row("demosaicking", what, speed, "Mpix/s", ratio, limit)
            for peer, theirs in (seconds | slow).items():
                if peer in PEERS[method]:
                    yield Row("demosaicking", what, speed, "Mpix/s", theirs / took, peer)


if __name__ == "__main__":
    show(rows())
