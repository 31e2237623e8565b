"""Simulating a large recording, with and without files: `python benchmarks/simulate.py [FOLDER]`.

2880 x 1620 pixels, 16 bit, Bayer, 12 levels of 16 frames (896 megapixels, 1.8 GB in a temporary
folder inside FOLDER). Prints megapixels per second of the base model; reading and the remarks are
timed on the written files, which the system may still hold in memory.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from dsis.camera import BaseNoise, Camera, Segment
from dsis.cfa import Cfa
from dsis.grid import PixelGrid
from dsis.recording import Recording
from dsis.simulate import flat, simulate, simulate_like, simulated_frames

ROWS, COLUMNS, LEVELS, FRAMES = 1620, 2880, 12, 16
MEGAPIXELS = ROWS * COLUMNS * LEVELS * FRAMES / 1e6
CAMERA = Camera(
    name="dual gain (assumed numbers)",
    cfa=Cfa.RGGB,
    black_level=256.0,
    white_level=65535.0,
    bit_depth=16,
    noise=BaseNoise(
        segment=(
            Segment(upper_dn=1000.0, slope=2.18, intercept=22.9),
            Segment(slope=8.7, intercept=383.0),
        )
    ),
)
SHOTS = [
    flat(f"flat-{k:02d}", 100 * 1.6**k, frames=FRAMES, exposure_time_s=0.01, light=1.6**k)
    for k in range(LEVELS)
]


def timed(name: str, work: Callable[[], object]) -> None:
    begun = time.perf_counter()
    work()
    took = time.perf_counter() - begun
    print(f"{name:44}{took:8.1f} s{MEGAPIXELS / took:9.1f} Mpix/s", flush=True)


def drain(frames: Iterable[object]) -> None:
    for _ in frames:
        pass


def streamed(recording: Recording, ahead: int) -> None:
    for exposure in recording.exposures:
        drain(recording.frames(exposure, ahead=ahead))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", nargs="?", help="where to write 1.8 GB for a while")
    folder = parser.parse_args().folder
    grid = PixelGrid(ROWS, COLUMNS, CAMERA.cfa)
    drain(simulated_frames(CAMERA, SHOTS[:1], grid))  # compiles
    for jobs in (1, 2):
        timed(
            f"simulate, no files, {jobs} job(s)",
            lambda n=jobs: drain(simulated_frames(CAMERA, SHOTS, grid, jobs=n)),
        )
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        out, made = Path(scratch) / "recording", []
        timed(
            "simulate and write, 2 jobs",
            lambda: made.append(simulate(CAMERA, SHOTS, ROWS, COLUMNS, out, jobs=2)),
        )
        timed("read, 1 thread ahead", lambda: streamed(made[0], 1))
        timed("remarks, 2 threads", lambda: made[0].remarks(threads=2))
        timed(
            "simulate like it and write, 2 jobs",
            lambda: simulate_like(CAMERA, made[0], Path(scratch) / "like", jobs=2),
        )


if __name__ == "__main__":
    main()
