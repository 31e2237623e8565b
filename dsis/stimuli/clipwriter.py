"""One frame of a content in all clips and formats, on disk: here, or made by a distant worker."""

import pickle
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dsis.spec import Test
from dsis.stimuli.assess import Assessor
from dsis.stimuli.clipfiles import read_frame_bytes, write_frame
from dsis.stimuli.frames import FrameMaker
from dsis.stimuli.jobs import jobs_of
from dsis.stimuli.match import matching_frames

Frame = NDArray[np.float32]
Records = dict[str, dict[str, Any]]  # by clip: digests by format, PSNR, visible noise
Files = dict[tuple[str, str], bytes]  # by clip and format

VISIBLE_FRAMES = 3
_one_at_a_time = Lock()


class ClipWriter:
    """Writes the frames of all clips of one content.

    Attributes
    ----------
    maker
        Makes them.
    assessor
        Compares them with the reference.
    """

    def __init__(self, test: Test, number: int) -> None:
        self.test, self.number = test, number
        job = jobs_of(test)[number]
        self.maker = FrameMaker.of(test, job)
        visible = matching_frames(test.spec.sequence.frames, VISIBLE_FRAMES)
        self.assessor = Assessor(test.spec, self.maker, visible)

    def write(self, frame: int, folder: Path) -> Records:
        """Write one frame of all clips below `folder` and return what is logged of them."""
        clips = self.maker.frame(frame)
        name, reference, _ = next(clips)
        records: Records = {name: {"sha256": self._written(name, frame, reference, folder)}}
        seen = self.assessor.seen(reference) if frame in self.assessor.visible else None
        for name, display, clean_dem in clips:
            record: dict[str, Any] = {"sha256": self._written(name, frame, display, folder)}
            record |= self.assessor.compare(display, reference, clean_dem)
            if seen is not None:
                record["visible"] = self.assessor.visible_noise(display, seen)
            records[name] = record
        if seen is not None:
            base = self.assessor.without_effects(frame, reference, seen)
            for name, found in base.items():
                records[name]["without_effects"] = found
        return records

    def order(self) -> bytes:
        """Return what `frame_from_afar` needs to make the same frames: all is solved already."""
        name = self.maker.job.name
        solved: Mapping[tuple[str, int], float] = {
            (name, level): sigma for level, sigma in self.maker.sigma.items()
        }
        return pickle.dumps((replace(self.test, sigma={**self.test.sigma, **solved}), self.number))

    def _written(self, name: str, frame: int, display: Frame, folder: Path) -> dict[str, str]:
        """Write one frame of a clip in all formats and return the digests."""
        return {
            form: write_frame(folder, name, form, frame, display) for form in self.test.spec.formats
        }


def frame_from_afar(order: bytes, frame: int) -> tuple[Records, Files]:
    """Make one frame in a worker that shares neither memory nor disk with who asks for it.

    Footage must lie in the same place for all of them.
    """
    writer = _writer(order)
    spec = writer.test.spec
    with TemporaryDirectory() as place:
        folder = Path(place)
        records = writer.write(frame, folder)
        return records, {
            (name, form): read_frame_bytes(folder, name, form, frame, spec.sequence)
            for name in records
            for form in spec.formats
        }


def _writer(order: bytes) -> ClipWriter:
    with _one_at_a_time:  # the threads of a worker share one
        return _kept(order)


@lru_cache(maxsize=1)
def _kept(order: bytes) -> ClipWriter:
    return ClipWriter(*pickle.loads(order))  # noqa: S301 - `ClipWriter.order` wrote it
