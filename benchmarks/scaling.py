"""How cost grows with pixels, effects, observers and megapixels: `python benchmarks/scaling.py`.

Printed is the exponent of a power law through the medians; 1 is linear. For `dsis camera fit` and
`dsis mismatch` also the speed, and the share of the time that reading the files alone takes.
"""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from timing import Row, exponent, medians, show

import analysis
from analysis.mismatch.folders import diagnose_recordings
from analysis.photon_transfer import fit_camera
from dsis.camera import BaseNoise, Camera, Segment, write_camera
from dsis.cfa import Cfa
from dsis.color import Color, DisplayTransform
from dsis.demosaic import METHODS, demosaic
from dsis.draw import Draw
from dsis.effects import registry
from dsis.grid import PixelGrid
from dsis.noise import camera_noise
from dsis.recording import Recording
from dsis.simulate import dark, flat, simulate

SIDES = (512, 1024, 2048)
OBSERVERS = (100, 200, 400, 800)
EFFECTS = ("row_noise", "column_noise", "row_fpn", "column_fpn")
THREADS = 2
CAMERA = Camera(
    name="single gain (assumed numbers)",
    cfa=Cfa.RGGB,
    black_level=256.0,
    white_level=16383.0,
    bit_depth=14,
    noise=BaseNoise(segment=(Segment(slope=2.18, intercept=22.9),)),
)


def grown(what: str, sizes: tuple[int, ...], work: Callable[[int], Callable[[], object]]) -> Row:
    seconds = medians({str(size): work(size) for size in sizes}).values()
    return Row("scaling", what, exponent(sizes, list(seconds)), "exponent")


def with_pixels() -> Iterator[Row]:
    def pixels(side: int, planes: int = 1) -> np.ndarray:
        shape = (side, side, 3) if planes == 3 else (side, side)
        return np.random.default_rng(1).random(shape, np.float32)

    def demosaicking(method: str, side: int) -> Callable[[], object]:
        mosaic, out = pixels(side), np.zeros((side, side, 3), np.float32)
        return lambda: demosaic(mosaic, Cfa.RGGB, method, out=out)

    def noise(side: int) -> Callable[[], object]:
        clean, grid = pixels(side), PixelGrid(side, side, Cfa.RGGB)
        return lambda: camera_noise(clean, CAMERA.segments, Draw(1), grid, 0)

    def display(side: int) -> Callable[[], object]:
        light, transform = pixels(side, 3), DisplayTransform(Color())
        return lambda: transform.display_from_scene(light)

    # The exponent counts in pixels: twice the side is four times as many.
    squares = tuple(side * side for side in SIDES)
    for method in METHODS:
        yield grown(
            f"{method} against pixels", squares, lambda n, m=method: demosaicking(m, int(n**0.5))
        )
    yield grown("camera noise against pixels", squares, lambda n: noise(int(n**0.5)))
    yield grown("display transform against pixels", squares, lambda n: display(int(n**0.5)))


def with_effects() -> Iterator[Row]:
    grid = PixelGrid(1024, 1024, Cfa.RGGB)
    clean = np.full(grid.shape, 800.0, np.float32)

    def exposing(count: int) -> Callable[[], object]:
        known = registry()
        effects = tuple(known[kind](sigma_dn=1.0) for kind in EFFECTS[:count])
        camera = CAMERA.model_copy(update={"effect": effects})
        return lambda: camera.expose(clean, Draw(1), Draw(1), 0, grid)

    counts = range(len(EFFECTS) + 1)
    seconds = list(medians({str(n): exposing(n) for n in counts}).values())
    slope = float(np.polyfit(list(counts), seconds, 1)[0])
    what = "one more line effect, of a frame's time"
    yield Row("scaling", what, slope / seconds[0], "share", None, "additive in effects")


def with_observers() -> Iterator[Row]:
    def votes(observers: int) -> pd.DataFrame:
        rng = np.random.default_rng(1)
        stimuli = 200
        table = {
            "observer": np.tile([f"o{i}" for i in range(observers)], stimuli),
            "stimulus": np.repeat([f"s{j}" for j in range(stimuli)], observers),
            "vote": rng.integers(1, 11, stimuli * observers),
        }
        return pd.DataFrame(table)

    with tempfile.TemporaryDirectory() as scratch:
        read = {}
        for observers in OBSERVERS:
            path = Path(scratch) / f"{observers}.csv"
            votes(observers).to_csv(path, index=False)
            read[observers] = analysis.read_votes(path, (1, 10))
        for function in (analysis.mos, analysis.screen_bt500):
            what = f"{function.__name__} against observers"
            yield grown(what, OBSERVERS, lambda n, f=function: lambda: f(read[n]))


def recorded(folder: Path, side: int) -> Recording:
    shots = [dark("dark", frames=8, exposure_time_s=0.01)]
    shots += [
        flat(f"flat-{k}", 60 * 2.0**k, frames=8, exposure_time_s=0.01, light=2.0**k)
        for k in range(8)
    ]
    return simulate(CAMERA, shots, side, side, folder / f"{side}", jobs=THREADS)


def with_megapixels(sides: tuple[int, ...] = (256, 512, 1024)) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_camera(CAMERA, folder / "camera.toml")
        files = {side: recorded(folder, side) for side in sides}

        def reading(side: int) -> float:
            begun = time.perf_counter()
            for exposure in files[side].exposures:
                for _ in files[side].frames(exposure):
                    pass
            return time.perf_counter() - begun

        def fitting(side: int) -> object:
            return fit_camera(files[side], threads=THREADS)

        def diagnosing(side: int) -> object:
            out = folder / f"{side}-out"
            source = [folder / f"{side}"]
            return diagnose_recordings(folder / "camera.toml", source, out, jobs=THREADS)

        for name, work, used in (
            ("camera fit", fitting, sides),
            ("mismatch", diagnosing, sides[:2]),
        ):
            seconds = []
            work(used[0])  # compiles
            for side in used:
                begun = time.perf_counter()
                work(side)
                seconds.append(time.perf_counter() - begun)
            mpix = [side * side * 72 / 1e6 for side in used]
            yield Row("scaling", f"{name} against megapixels", exponent(mpix, seconds), "exponent")
            speed, share = mpix[-1] / seconds[-1], reading(used[-1]) / seconds[-1]
            against = f"{mpix[-1]:.0f} Mpix; reading alone takes {100 * share:.0f} % of that"
            yield Row("scaling", f"{name}, {THREADS} threads", speed, "Mpix/s", None, against)


def rows() -> Iterator[Row]:
    yield from with_pixels()
    yield from with_effects()
    yield from with_observers()
    yield from with_megapixels()


if __name__ == "__main__":
    show(rows())
