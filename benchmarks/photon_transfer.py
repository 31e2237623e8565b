"""How right and how fast `fit_camera` is: `python benchmarks/photon_transfer.py [--runs 500]`.

Prints (1) how many of `runs` 95 % intervals hold the planted camera, mono and Bayer, one and two
segments, without a fixed pattern and with one (DSNU, PRNU, columns; each run another sensor); (2)
how often a second segment is invented in single-gain recordings, and found where it shifts the
variance by 10 standard errors at three levels; (3) time and memory for a recording of 2880 x 1620,
12 levels of 16 frames, its frames made beforehand and held in memory. About 8 minutes; `--only`
does one of the three.
"""

import argparse
import collections
import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import planted_camera as planted
from analysis.photon_transfer import fit_camera
from dsis.camera import Camera
from dsis.cfa import Cfa

SIZE = (32, 48)
RUNS_SEGMENTS = 200


def coverage(made: Camera, runs: int, first: int) -> None:
    inside: collections.Counter[str] = collections.Counter()
    counts: collections.Counter[int] = collections.Counter()
    begun = time.perf_counter()
    for seed in range(first, first + runs):
        # Intervals are those of all such sensors: each run has another.
        fit = fit_camera(planted.record(made, seed, size=SIZE, sensor_seed=10_000 + seed))
        counts[len(fit.segments.lines)] += 1
        if len(fit.segments.lines) != len(made.noise.segment):
            continue
        for name, z in planted.misses(fit, made).items():
            inside[name] += abs(z) < 1.96
        for switch in fit.segments.switches:
            true = made.noise.segment[0].upper_dn or 0.0
            inside["switch"] += switch.low_dn < true <= switch.high_dn
    right = counts[len(made.noise.segment)]
    name = f"{made.cfa.value}, {len(made.noise.segment)} segment(s)"
    name += ", fixed pattern" if made.effect else ""
    shares = "  ".join(f"{key} {100 * count / right:.1f}" for key, count in inside.items())
    took = (time.perf_counter() - begun) / runs
    print(f"{name:35} {right}/{runs} with the right number;  {shares}  ({1e3 * took:.0f} ms a run)")


def step_of_ten_errors(cfa: Cfa, at_dn: float) -> Camera:
    """Return the one-segment camera with a step of 10 errors at three levels from `at_dn` on."""
    levels = sorted(level for level in planted.LEVELS_DN if level >= at_dn)[:3]
    relative = np.sqrt(2 / (3 * SIZE[0] * SIZE[1]))  # of a level: all channels, four frames
    step = 10 * relative * float(np.median([1.7 * level + 30 for level in levels]))
    made = planted.camera((at_dn - 1, 1.7, 30.0), (None, 1.7, 30.0 + step))
    # A colour that sees less passes the switch at another level; equal colours keep three levels.
    return made.model_copy(update={"cfa": cfa})


def number_of_segments() -> None:
    for cfa in (Cfa.MONO, Cfa.RGGB):
        single = planted.ONE.model_copy(update={"cfa": cfa})
        invented = sum(
            len(fit_camera(planted.record(single, 10_000 + s, size=SIZE)).segments.lines) > 1
            for s in range(RUNS_SEGMENTS)
        )
        print(
            f"{cfa.value:6} invented in {invented} of {RUNS_SEGMENTS} single-gain runs (at most 4)"
        )
        for at_dn in (200.0, 500.0, 1100.0, 3000.0):
            made = step_of_ten_errors(cfa, at_dn)
            found = 0
            for seed in range(RUNS_SEGMENTS):
                recording = planted.record(made, seed, size=SIZE, gains=((1.0, 1.0), (1.0, 1.0)))
                found += len(fit_camera(recording).segments.lines) > 1
            share = 100 * found / RUNS_SEGMENTS
            print(f"{cfa.value:6} step of 10 errors from {at_dn:g} DN on found in {share:.1f} %")


def speed() -> None:
    made = planted.TWO.model_copy(update={"cfa": Cfa.RGGB, "white_level": 65535.0, "bit_depth": 16})
    levels = (
        0.0,
        0.0,
        100.0,
        300.0,
        700.0,
        1500.0,
        3000.0,
        6000.0,
        12000.0,
        24000.0,
        40000.0,
        60000.0,
    )
    small = planted.record(made, 1, levels=levels, frames=16, size=(54, 96))
    # The content does not matter to the time; the size does.
    tiles = [
        replace(exposure, stack=Tiled(exposure.stack, (30, 30))) for exposure in small.exposures
    ]
    recording = replace(small, exposures=tuple(tiles))
    fit_camera(small)  # compiles
    begun, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime
    fit_camera(recording, threads=2)
    took = time.perf_counter() - begun
    busy = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"2880 x 1620 Bayer, 12 levels x 16 frames: {took:.1f} s, two threads (making the frames "
        f"included), {busy:.1f} s of processor, {memory:.2f} GB at most"
    )


class Tiled:
    """Frames tiled to full size when they are asked for: 1.8 GB need not be held."""

    def __init__(self, stack: np.ndarray, times: tuple[int, int]) -> None:
        self.stack, self.times = stack, times

    def __len__(self) -> int:
        return len(self.stack)

    def __iter__(self) -> Iterator[np.ndarray]:
        return (np.tile(frame, self.times) for frame in self.stack)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=500)
    parser.add_argument("--first", type=int, default=0, help="seed of the first run")
    parser.add_argument("--only", choices=("coverage", "segments", "speed"))
    options = parser.parse_args()
    if options.only in (None, "coverage"):
        print("95 % intervals that hold the planted value, %")
        for made in (planted.ONE, planted.TWO):
            for strata in (made, planted.patterned(made)):
                for cfa in (Cfa.MONO, Cfa.RGGB):
                    planned = strata.model_copy(update={"cfa": cfa})
                    coverage(planned, options.runs, options.first)
    if options.only in (None, "segments"):
        number_of_segments()
    if options.only in (None, "speed"):
        speed()


if __name__ == "__main__":
    main()
