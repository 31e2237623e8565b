"""EMVA 1288's figures beside the emva1288 package, on the same files, in one run.

    python benchmarks/emva1288_comparison.py EMVA1288_Data.txt --peer /path/to/python

`--peer` is the Python of an environment that holds `emva1288` (GPL-3, 1.0.2; it needs numpy < 2):
it runs there as a program of its own and hands back JSON. Times are the best of three, of reading
plus computing (figures alone, and the whole fit with segments, maps and distribution), and of
computing alone from frames that are held in memory. The package has one thread; ours has `--jobs`.
Beneath stand the bounds: what unpacking these files takes by itself, by zlib and by isal, and what
the package's own loader (Pillow) takes.
"""

import argparse
import importlib
import importlib.util
import json
import subprocess
import time
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from analysis.photon_transfer import fit_camera
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.statistics import expose_statistics
from dsis.recording import png, read_recording

ROUNDS = 3
TOLERANCE = 0.01

# ours: (name, unit) -> the peer's attribute
COMPARED = {
    ("K", "DN/e-"): "K",
    ("R", "DN/light"): "R",
    ("sigma_y.dark", "DN"): "sigma_y_dark",
    ("sigma_d", "e-"): "sigma_d",
    ("DSNU1288", "e-"): "DSNU1288",
    ("PRNU1288", "%"): "PRNU1288",
    ("LE_min", "%"): "LE_min",
    ("LE_max", "%"): "LE_max",
    ("mu_e.sat", "e-"): "u_e_sat",
    ("mu_p.min", "light"): "u_p_min",
    ("SNR_max", "1"): "SNR_max",
    ("DR_dB", "dB"): "DR_dB",
    ("mu_I.mean", "DN/s"): "u_I_mean_DN",
}
DIFFERENCES = """\
Definitions that differ:
  saturation     both: the level of the largest temporal variance.
  dark current   the package fits the dark means without weights; here each dark's error weighs it.
  DSNU, PRNU     no spatial high-pass in either. The package takes the frames' common change as part
                 of the temporal variance that it subtracts; here it is removed.
  LE             both: relative line, 5 to 95 % of saturation, extremes (LE_min, LE_max). `LE` here
                 is release 3.1's mean absolute deviation; the package does not give it.
  K              both pair each flat with its dark; here the stack of 50 flats counts too."""

PEER = """
import json, logging, sys, time
import numpy as np
from PIL import Image
from emva1288.process.parser import ParseEmvaDescriptorFile
from emva1288.process.loader import LoadImageData
from emva1288.process.data import Data1288
from emva1288.process.results import Results1288
file, names, rounds = sys.argv[1], sys.argv[2].split(","), int(sys.argv[3])
held = {}
def load(name):
    return np.asarray(Image.open(name).split()[0])
def remembered(name):
    if name not in held:
        held[name] = load(name)
    return held[name]
def run(reader):
    quiet = {"loglevel": logging.ERROR}
    images = ParseEmvaDescriptorFile(file, **quiet).images
    data = Data1288(LoadImageData(images, fload=reader, **quiet).data, **quiet)
    results = Results1288(data.data, **quiet)
    values = {name: getattr(results, name) for name in names}
    return {name: float(v() if callable(v) else v) for name, v in values.items()}
def best(reader):
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        found = run(reader)
        times.append(time.perf_counter() - begun)
    return found, min(times)
found, reading = best(load)
begun = time.perf_counter()
parsed = ParseEmvaDescriptorFile(file, loglevel=logging.ERROR).images
names_of_files = {name for kinds in parsed.values() for times in kinds.values()
                  for lights in times.values() for name in lights}
for name in names_of_files:
    load(name)
loading = time.perf_counter() - begun
remembered_found, computing = best(remembered)
print(json.dumps({"figures": found, "reading": reading, "computing": computing,
                  "loading": loading}))
"""


class Held:
    """A recording whose frames lie in memory."""

    def __init__(self, recording: Any) -> None:
        self.sensor, self.exposures = recording.sensor, recording.exposures
        self._frames = {e.name: list(recording.frames(e)) for e in recording.exposures}

    def frames(self, exposure: Any, /) -> Iterator[np.ndarray]:
        """Return the frames of one exposure."""
        return iter(self._frames[exposure.name])


def figures(recording: Any, jobs: int = 1) -> dict[tuple[str, str], float | None]:
    by_length = sorted(recording.exposures, key=lambda e: -len(e.frames))
    with ThreadPoolExecutor(jobs) as pool:
        parts = pool.map(lambda e: (e.name, expose_statistics(recording, e)), by_length)
    found = dict(parts)
    levels = [s for e in recording.exposures for s in found[e.name]]
    return {(q.name, q.unit): q.value for q in figures_of_merit(levels)}


def best(work: Any) -> tuple[Any, float]:
    times = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        found = work()
        times.append(time.perf_counter() - begun)
    return found, min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description="EMVA 1288's figures beside the emva1288 package")
    parser.add_argument("descriptor", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--peer", required=True, help="Python that has emva1288")
    options = parser.parse_args()
    arguments = [str(options.descriptor), ",".join(COMPARED.values()), str(ROUNDS)]
    done = subprocess.run(
        [options.peer, "-c", PEER, *arguments], capture_output=True, text=True, check=True
    )
    peer = json.loads(done.stdout.strip().splitlines()[-1])
    recording = read_recording(options.descriptor)
    held = Held(recording)
    figures(held)  # compiles
    ours, computing = best(lambda: figures(held))
    jobs = options.jobs
    _, reading = best(lambda: figures(read_recording(options.descriptor), jobs))
    fit_camera(recording, threads=jobs)  # compiles
    _, whole = best(lambda: fit_camera(read_recording(options.descriptor), threads=jobs))
    print(f"{'quantity':22}{'dsis':>14}{'emva1288':>14}{'difference':>12}")
    for key, name in COMPARED.items():
        value, theirs = ours[key], peer["figures"][name]
        if value is None:
            continue
        relative = value / theirs - 1
        mark = "" if abs(relative) <= TOLERANCE else "  beyond 1 %"
        print(f"{' '.join(key):22}{value:14.6g}{theirs:14.6g}{100 * relative:11.3f} %{mark}")
    print(DIFFERENCES)
    print(f"{'computing, s':22}{computing:14.4f}{peer['computing']:14.4f}"
          f"{peer['computing'] / computing:10.1f} x")  # fmt: skip
    print(f"{'reading + computing, s':22}{reading:14.3f}{peer['reading']:14.3f}"
          f"{peer['reading'] / reading:10.1f} x  ({jobs} threads)")  # fmt: skip
    print(f"{'reading + whole fit, s':22}{whole:14.3f}{peer['reading']:14.3f}"
          f"{peer['reading'] / whole:10.1f} x  ({jobs} threads)")  # fmt: skip
    print(f"the package's loader alone (Pillow): {peer['loading']:.3f} s")
    bounds(recording, jobs)


def bounds(recording: Any, jobs: int) -> None:
    """Print what unpacking the files takes, nothing else."""
    files = [path for e in recording.exposures for path in e.frames]
    contents = [png.chunks(path.read_bytes()) for path in files]
    packed = [content[1] for content in contents if content is not None]
    ways: dict[str, Callable[[bytes], bytes]] = {"zlib": zlib.decompress}
    if importlib.util.find_spec("isal"):
        ways["isal"] = importlib.import_module("isal.isal_zlib").decompress
    for name, unpack in ways.items():
        times = []
        for threads in (1, jobs):
            with ThreadPoolExecutor(threads) as pool:
                _, took = best(lambda: list(pool.map(unpack, packed)))  # noqa: B023 - called here
            times.append(took)
        print(f"unpacking {len(packed)} files, {name}: {times[0]:.3f} s, "
              f"{jobs} threads {times[1]:.3f} s")  # fmt: skip


if __name__ == "__main__":
    main()
