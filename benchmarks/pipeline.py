"""Stimuli from end to end, four conditions with DLMMSE: `python benchmarks/pipeline.py`.

Each build is a process of its own on two threads, with a picture that pans as its light. The time
begins when the light is ready and ends with the manifest; memory is the peak of the process. The
cost against frames is processor time, which other work on the machine disturbs less, from the
fifth frame on: before, kernels and colour tables are loaded.
"""

import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from timing import Row, exponent, show

from dsis.imagefile import write
from dsis.spec import read_spec
from dsis.stimuli import build_stimuli

JOBS, CONDITIONS, FPS = 2, 4, 25
LARGE, LARGE_FRAMES = (1920, 1080), 24
SMALL, SMALL_FRAMES = (480, 270), (100, 200, 400)
WARM = 4  # frames
ROUNDS = 3  # of each length, in turn: their medians count
SPEC = """\
schema = "dsis-test/1"
seed = 3
formats = ["{form}"]
sequence = {{width = {width}, height = {height}, fps = {fps}, seconds = {seconds}}}
content = [{{name = "picture", files = "picture.exr", pan_px_per_frame = 1.0}}]
camera = {{model = "cameras/dual_gain_cinema.toml"}}
awgn = {{sigma = 4.28}}
conditions = {{noise = ["awgn", "sd"], demosaic = ["none", "dlmmse"], levels = [0]}}
session = {{reference_s = {seconds}, test_s = {seconds}, training = 0}}
color = {{}}
[optics]
f_number = 5.6
wavelength_nm = 550
pitch_um = 8.25
low_pass_spot_separation_px = 0.75
fill_factor = 1.0
"""


def now() -> tuple[float, float]:
    """Return seconds by the clock and of this process on all processors."""
    return time.perf_counter(), time.process_time()


def build(width: int, height: int, frames: int, form: str) -> None:
    """Build once and print seconds and memory as JSON."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        y, x = np.mgrid[0:height, 0 : width + frames].astype(np.float32)
        light = 0.5 + 0.5 * np.sin(x / 9) * np.cos(y / 7)
        write(folder / "picture.exr", np.stack([light, 0.8 * light**2, 0.3 + light / 2], 2), "exr")
        values = {"width": width, "height": height, "fps": FPS, "form": form}
        text = SPEC.format(**values, seconds=frames / FPS)
        (folder / "spec.toml").write_text(text, encoding="utf-8")
        begun: list[tuple[float, float]] = []
        build_stimuli(
            read_spec(folder / "spec.toml"),
            folder / "out",
            jobs=JOBS,
            progress=lambda done, total, what: begun.append(now()),  # noqa: ARG005
        )
        # Told first: the light is about to be made; second: no frame is done yet; then each frame.
        end = now()
    used = resource.getrusage(resource.RUSAGE_SELF)
    found = {
        "s": end[0] - begun[1][0],
        "warm_cpu_s": end[1] - begun[1 + WARM][1],
        "cpu_s": used.ru_utime + used.ru_stime,
        "gb": used.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e9,
    }
    print(json.dumps(found))


def measured(width: int, height: int, frames: int, form: str) -> dict[str, float]:
    command = [sys.executable, __file__, *map(str, (width, height, frames)), form]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(said.splitlines()[-1])


def rows() -> Iterator[Row]:
    for form in ("player", "tiff16"):
        found = measured(*LARGE, LARGE_FRAMES, form)
        what = f"{LARGE[0]}x{LARGE[1]}, {form}, {JOBS} threads"
        speed = CONDITIONS * LARGE_FRAMES / found["s"]
        yield Row("pipeline", what, speed, "frames/s", None, "over four conditions; asked: 6")
        yield Row("pipeline", what, found["gb"], "GB peak", None, "asked: below 2")
        warm = found["warm_cpu_s"] / (LARGE_FRAMES - WARM)
        alone = "what that much processor time allows, nobody else at work"
        yield Row("pipeline", what, CONDITIONS * JOBS / warm, "frames/s", None, alone)
        per_frame = found["cpu_s"] / LARGE_FRAMES
        yield Row(
            "pipeline", what, per_frame, "CPU-s", None, "a frame of all clips, set-up included"
        )
    runs = [
        [measured(*SMALL, frames, "player")["warm_cpu_s"] for frames in SMALL_FRAMES]
        for _ in range(ROUNDS)
    ]
    seconds = [statistics.median(of_one_length) for of_one_length in zip(*runs, strict=True)]
    slope = exponent([frames - WARM for frames in SMALL_FRAMES], seconds)
    yield Row("pipeline", "cost against frames", slope, "exponent", None, "asked: 0.95 to 1.05")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        build(*map(int, sys.argv[1:4]), sys.argv[4])
    else:
        show(rows())
