"""Speed of the measures, and whether their errors are right: `python benchmarks/measures.py`.

First: seconds for all measures of 50 frames of 640 x 480 (mono) and 16 of 2880 x 1620 (Bayer), one
thread and two, against numpy's mean and variance of the same stack in memory. Then, for base model
and planted noise, T = 4 to 50: mean and standard deviation of (value - null) / null_error, which
should be 0 and 1, and rms standard error over the scatter of the values, which should be 1.
`--runs N` sets the number of simulated exposures per case.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np

from dsis.cfa import Cfa
from dsis.measures import MEASURES, measure_exposure

RUNS, REPEATS = 300, 3
ROWS, COLUMNS, SIGMA_DN, LEVEL_DN = 64, 48, 5.5, 1000.3


def seconds(work: Callable[[], object]) -> float:
    work()
    times = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def speed() -> None:
    print(f"{'exposure':34}{'threads':>8}{'s':>8}{'ns/sample':>11}{'numpy mean + var, s':>21}")
    for frames, rows, columns, cfa in ((50, 480, 640, Cfa.MONO), (16, 1620, 2880, Cfa.RGGB)):
        rng = np.random.default_rng(0)
        stack = np.empty((frames, rows, columns), np.uint16)
        for t in range(frames):
            stack[t] = np.rint(rng.normal(2000, 12, (rows, columns)))
        plain = seconds(lambda s=stack: (s.mean(0), s.var(0, ddof=1)))
        for threads in (1, 2):
            took = seconds(lambda s=stack, c=cfa, n=threads: measure_exposure(s, c, threads=n))
            name = f"{frames} x {columns} x {rows} {cfa}"
            print(f"{name:34}{threads:8}{took:8.2f}{took / stack.size * 1e9:11.1f}{plain:21.2f}")


def exposures(
    frames: int, runs: int, *, row: float, column: float, frame: float, pixel: float
) -> Iterator[np.ndarray]:
    """Yield whole-code stacks of white noise with planted row, column, frame and fixed noise."""
    rng = np.random.default_rng([frames, runs])
    shape = (frames, ROWS, COLUMNS)
    for _ in range(runs):
        stack = LEVEL_DN + SIGMA_DN * rng.normal(size=shape)
        stack += row * rng.normal(size=(frames, ROWS, 1))
        stack += column * rng.normal(size=(frames, 1, COLUMNS))
        stack += frame * rng.normal(size=(frames, 1, 1))
        stack += pixel * rng.normal(size=shape[1:])
        yield np.rint(stack).astype(np.uint16)


def errors(runs: int) -> None:
    planted = {"row": 2.0, "column": 1.5, "frame": 1.0, "pixel": 3.0}
    white = SIGMA_DN**2 + 1 / 12
    for title, strength in (("base model", 0.0), ("rows, columns, flicker, DSNU", 1.0)):
        amplitudes = {name: strength * value for name, value in planted.items()}
        truth = {"level": LEVEL_DN, "pixel_variance": white, "fixed_pixel_variance": 0.0}
        truth |= {f"{name}_variance": value**2 for name, value in amplitudes.items()}
        truth |= {"pixel_variance": white, "fixed_pixel_variance": amplitudes["pixel"] ** 2}
        for frames in (4, 8, 16, 50):
            made = [
                measure_exposure(stack).channels["MONO"].estimates
                for stack in exposures(frames, runs, **amplitudes)
            ]
            print(f"\n{title}, T = {frames}, {runs} exposures of {ROWS} x {COLUMNS}")
            print(f"{'':24}{'mean, its se':>14}{'null: mean':>12}{'sd':>7}{'rms(se)/sd':>12}")
            for name in MEASURES:
                if name == "code_spacing":
                    continue  # exact: nothing scatters
                found = np.array(
                    [(m[name].value, m[name].standard_error, m[name].null_error) for m in made]
                )
                difference = found[:, 0] - truth.get(name, np.nan_to_num(made[0][name].null_value))
                scatter = difference.std(ddof=1)
                z = difference / found[:, 2]
                print(
                    f"{name:24}{difference.mean() / scatter * runs**0.5:14.2f}"
                    f"{z.mean():12.3f}{z.std(ddof=1):7.3f}"
                    f"{np.sqrt((found[:, 1] ** 2).mean()) / scatter:12.3f}"
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=RUNS)
    speed()
    errors(parser.parse_args().runs)


if __name__ == "__main__":
    main()
