"""What a build will take, before it is started: disk, memory, time."""

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

from dsis.spec import Test
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.jobs import jobs_of
from dsis.stimuli.source import SCENE_OVERSAMPLING

_BYTES_PER_SAMPLE = {"player": 1.0, "tiff16": 2.0, "dpx16": 2.0, "exr": 2.0, "png8": 1.0}
_PLANES_PER_THREAD = 40  # float32 planes (row, column) alive while one frame is made


@dataclass(frozen=True)
class Estimate:
    """Cost of a build. Disk is an upper bound where a format compresses."""

    clips: int
    frames: int
    disk_bytes: float
    free_bytes: float
    memory_bytes: float
    seconds: float

    def __str__(self) -> str:
        short = "" if self.disk_bytes < self.free_bytes else ": NOT ENOUGH"
        return (
            f"{self.clips} clips, {self.frames} frames in all\n"
            f"disk   {_size(self.disk_bytes)} of {_size(self.free_bytes)} free{short}\n"
            f"memory about {_size(self.memory_bytes)}\n"
            f"time   about {_duration(self.seconds)}"
        )


def estimate(test: Test, out: Path, jobs: int = 1) -> Estimate:
    """Return what building a test takes; times one frame of the first content, writes nothing."""
    spec, size = test.spec, test.spec.sequence
    work = jobs_of(test)
    clips = sum(1 + len(job.conditions) for job in work)
    samples = size.width * size.height * 3
    disk = clips * size.frames * samples * sum(_BYTES_PER_SAMPLE[f] for f in spec.formats)
    begun = time.perf_counter()
    maker = FrameMaker.of(test, work[0])
    list(maker.frame(0))  # compiles what is not compiled yet
    ready = time.perf_counter()
    list(maker.frame(0))
    per_frame = time.perf_counter() - ready
    seconds = len(work) * (ready - begun) + len(work) * size.frames * per_frame / max(1, jobs)
    travel = max(abs(job.content.pan_px_per_frame) for job in work) * size.frames
    source = SCENE_OVERSAMPLING**2 * (size.width + travel) * size.height * 3 * 4 * 3
    memory = source + jobs * _PLANES_PER_THREAD * samples / 3 * 4 + 300e6
    existing = next(p for p in (out, *out.resolve().parents) if p.exists())
    return Estimate(
        clips, clips * size.frames, disk, shutil.disk_usage(existing).free, memory, seconds
    )


def _size(count: float) -> str:
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} TB"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
