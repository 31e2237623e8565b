"""What a build will take, before it is started: disk, memory, time."""

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from dsis.imagefile import info
from dsis.scenes import is_ready, render
from dsis.spec import Content, Sequence, Test
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.jobs import Job, jobs_of
from dsis.stimuli.match import matching_frames, solve_sigma
from dsis.stimuli.panoramas import strip_of
from dsis.stimuli.source import source_of

_BYTES_PER_SAMPLE = {"player": 1.0, "tiff16": 2.0, "dpx16": 2.0, "exr": 2.0, "png8": 1.0}
_PLANES_PER_THREAD = 40  # float32 planes (row, column) alive while one frame is made
_SOURCE_COPIES = 3  # the picture, its light, and its light after the optics
TIMED_PX = 320 * 180
_TIMED_COLUMNS = (32, 96)


@dataclass(frozen=True)
class Estimate:
    """Cost of a build. Disk is an upper bound where a format compresses; time is extrapolated.

    Attributes
    ----------
    timed
        Size of the frame that was timed: (columns, rows).
    """

    clips: int
    frames: int
    disk_bytes: float
    free_bytes: float
    memory_bytes: float
    seconds: float
    timed: tuple[int, int]

    def __str__(self) -> str:
        short = "" if self.disk_bytes < self.free_bytes else ": NOT ENOUGH"
        columns, rows = self.timed
        return (
            f"{self.clips} clips, {self.frames} frames in all\n"
            f"disk   {_size(self.disk_bytes)} of {_size(self.free_bytes)} free{short}\n"
            f"memory about {_size(self.memory_bytes)}\n"
            f"time   about {_duration(self.seconds)}"
            f" (extrapolated from one frame of {columns}x{rows} pixels)"
        )


def estimate(test: Test, out: Path, jobs: int = 1) -> Estimate:
    """Return what building a test takes; times one small frame of the first content.

    Nothing is written. Time counts the making of frames, not the disk's.
    """
    spec, size = test.spec, test.spec.sequence
    work = jobs_of(test)
    clips = sum(1 + len(job.conditions) for job in work)
    samples = size.width * size.height * 3
    disk = clips * size.frames * samples * sum(_BYTES_PER_SAMPLE[f] for f in spec.formats)
    small = _smaller(size)
    set_up, per_frame = _timed(test, work[0], small)
    seconds = len(work) * (set_up + size.frames * per_frame / max(1, jobs))
    source = max(_source_px(test, job) for job in work) * 3 * 4 * _SOURCE_COPIES
    memory = source + jobs * _PLANES_PER_THREAD * samples / 3 * 4 + 300e6
    existing = next(p for p in (out, *out.resolve().parents) if p.exists())
    free = shutil.disk_usage(existing).free
    timed = (small.width, small.height)
    return Estimate(clips, clips * size.frames, disk, free, memory, seconds, timed)


def _smaller(size: Sequence) -> Sequence:
    """Return a sequence of at most `TIMED_PX` pixels, and as much shorter as it is narrower."""
    shrink = min(1.0, (TIMED_PX / (size.width * size.height)) ** 0.5)
    return Sequence(
        width=max(8, int(shrink * size.width)),
        height=max(8, int(shrink * size.height)),
        fps=size.fps,
        seconds=max(1, int(shrink * size.frames)) / size.fps,
    )


def _timed(test: Test, job: Job, small: Sequence) -> tuple[float, float]:
    """Return seconds to set up a content and to make one frame of all its clips, in one thread.

    What grows with the clips' size is timed on the small sequence and scaled by pixels. Light from
    files is timed as it is: they are read whole, however small the sequence.
    """
    size, spec = test.spec.sequence, test.spec.model_copy(update={"sequence": small})
    little = replace(test, spec=spec)
    ratio = size.width * size.height / (small.width * small.height)
    maker = FrameMaker.of(little, job)
    list(maker.frame(0))  # compiles what is not compiled yet
    transform = maker.rendering.transform
    files = job.content.scene is None
    begun = time.perf_counter()
    source = source_of(job.content, test if files else little, transform)
    grows = 1.0 if files else ratio
    opening = (time.perf_counter() - begun) * grows + _rendering(job.content, size, small)
    light = _seconds(lambda: source.light(0)) * grows
    small_light = _seconds(lambda: maker.source.light(0))

    def scaled(seconds: float, lights: int) -> float:
        return max(0.0, seconds - lights * small_light) * ratio + lights * light

    solving = 0.0
    if maker.sigma and spec.awgn.match is not None:
        level = max(maker.sigma)
        once = _seconds(lambda: solve_sigma(spec, maker.source, maker.rendering, job.name, level))
        solving = len(maker.sigma) * scaled(once, len(matching_frames(small.frames)))
    return opening + solving, scaled(_seconds(lambda: list(maker.frame(0))), 1)


def _rendering(content: Content, size: Sequence, small: Sequence) -> float:
    """Return seconds that one thread renders a content's panorama; 0 where it is there already.

    From two small ones of other width: a part of the time is the same however many the pixels.
    """
    strip, little = strip_of(content, size), strip_of(content, small)
    if strip is None or little is None or is_ready(strip):
        return 0.0
    narrow, wide = (replace(little, columns=columns) for columns in _TIMED_COLUMNS)
    render(replace(little, columns=1))  # compiles what is not compiled yet
    took = _seconds(lambda: render(narrow))
    per_px = max(0.0, _seconds(lambda: render(wide)) - took) / (wide.pixels - narrow.pixels)
    return took + per_px * strip.pixels


def _seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def _source_px(test: Test, job: Job) -> float:
    """Return the pixels of the picture that a content's light comes from."""
    footage = test.footage.get(job.name)
    if footage is not None:
        header = info(footage.paths[0])
        return header.rows * header.columns
    size, scale = test.spec.sequence, job.content.scale
    travel = abs(job.content.pan_px_per_frame) * size.frames
    return scale**2 * (size.width + travel) * size.height


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
