"""Test spec -> four conditions -> frames and manifest; resumable, whatever the workers."""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dsis.manifest import MANIFEST, Clip, ClipFiles, Manifest, Quality, write_manifest
from dsis.outdir import result_folder
from dsis.spec import TRAINING, Test
from dsis.stimuli.clipfiles import clip_path, read_frame_bytes, store_frame_bytes
from dsis.stimuli.clipwriter import ClipWriter, Records, frame_from_afar
from dsis.stimuli.conditions import Condition
from dsis.stimuli.figure import write_figures
from dsis.stimuli.jobs import jobs_of
from dsis.stimuli.journal import Journal, sha256
from dsis.stimuli.panoramas import render_panoramas
from dsis.stimuli.resolved import build_digest, manifest_of
from dsis.workers import Workers, completed, workers

Progress = Callable[[int, int, str], None]

VOTES = "session"


def build_stimuli(
    test: Test,
    out: Path,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Manifest:
    """Build all clips of a test in `out` and return their manifest.

    Parameters
    ----------
    test
        A test spec, see `dsis.read_spec`.
    out
        Folder of the result. Work goes on in `out` + ".partial"; a build that was interrupted is
        taken up there, and the result replaces an earlier one in one step.
    jobs
        Number of threads; no influence on the result.
    scheduler
        Address of a Dask scheduler whose workers render scenes and make the frames instead; the
        same bytes. They find footage under the same paths.
    progress
        Called with (frames done, frames in all, what is being done).

    Raises
    ------
    InputError
        `out` holds something else, or recorded votes, or unfinished work of another spec; the
        scheduler cannot be used.
    WorkersLostError
        Workers die again and again.
    OSError
        The disk is full, or the place cannot be written.
    """
    digest = build_digest(test)
    work = jobs_of(test)
    frames = test.spec.sequence.frames
    total = len(work) * frames
    tell = progress or _silent
    with (
        workers(jobs, scheduler=scheduler) as pool,
        result_folder(out, MANIFEST, keep=recorded_votes, resume=digest) as folder,
    ):
        render_panoramas(test, progress=tell, pool=pool)
        journal = Journal(folder)
        clips: list[Clip] = []
        sigmas: dict[str, dict[str, float]] = {}
        for number, job in enumerate(work):
            done = number * frames
            tell(done, total, f"{job.name}: light")
            builder = Builder(ClipWriter(test, number), folder, journal)
            sigmas[job.name] = {str(level): s for level, s in builder.maker.sigma.items()}
            builder.build(pool, _from(tell, done, total, job.name))
            clips += builder.clips(jobs)
            middle = builder.maker.figure_frames(frames // 2)
            write_figures(middle, folder / "figures", job.name)
        manifest = manifest_of(test, tuple(clips), sigmas)
        write_manifest(manifest, folder)
    return manifest


def recorded_votes(folder: Path) -> str | None:
    """Return what must not be lost with a stimuli folder: its recorded votes."""
    return f"recorded votes ({VOTES})" if (folder / VOTES).exists() else None


class Builder:
    """Builds all clips of one content."""

    def __init__(self, writer: ClipWriter, folder: Path, journal: Journal) -> None:
        self.writer, self.folder, self.journal = writer, folder, journal
        self.test, self.maker = writer.test, writer.maker
        self.job, self.assessor = writer.maker.job, writer.assessor
        self.size = writer.test.spec.sequence

    def build(self, pool: Workers, done: Callable[[int], None]) -> None:
        """Write every frame that is not there yet."""
        frames = range(self.size.frames)
        todo = [frame for frame in frames if not self._finished(frame)]
        done(self.size.frames - len(todo))
        written = self._received(pool, todo) if pool.apart else completed(pool, self._write, todo)
        for n, (frame, records) in enumerate(written, self.size.frames - len(todo) + 1):
            self.journal.add(self.job.name, frame, records)
            done(n)

    def clips(self, jobs: int) -> list[Clip]:
        """Return the manifest's entries of all clips, from what the journal holds."""
        conditions = self._conditions()
        names = [self.job.reference, *conditions]
        with ThreadPoolExecutor(max(1, jobs)) as pool:
            files = list(pool.map(self._files, names))
        return [
            self._clip(name, conditions.get(name), found)
            for name, found in zip(names, files, strict=True)
        ]

    def _clip(self, name: str, condition: Condition | None, files: dict[str, ClipFiles]) -> Clip:
        if condition is None:
            return Clip(stimulus=name, content=self.job.name, role="reference", files=files)
        white = condition.noise == "awgn"
        return Clip(
            stimulus=name,
            content=self.job.name,
            role="training" if self.job.role == TRAINING else "test",
            reference=self.job.reference,
            noise=condition.noise,
            demosaic=condition.demosaic,
            level=condition.level,
            awgn_sigma=self.maker.sigma[condition.level] if white else None,
            files=files,
            quality=self._quality(name),
        )

    def _quality(self, name: str) -> Quality:
        records = [self._record(name, frame) for frame in range(self.size.frames)]
        seen = [records[frame] for frame in self.assessor.visible]
        lightness, colour = np.mean([r["visible"] for r in seen], axis=0)
        base = [r["without_effects"] for r in seen if "without_effects" in r]
        return Quality(
            psnr_db=tuple(r["psnr_db"] for r in records),
            psnr_float_db=tuple(r["psnr_float_db"] for r in records),
            psnr_demosaicked_db=tuple(r["psnr_demosaicked_db"] for r in records),
            visible_frames=self.assessor.visible,
            visible_noise=float(lightness + colour),
            visible_lightness=float(lightness),
            visible_colour=float(colour),
            base_psnr_db=tuple(r["psnr_db"] for r in base),
            base_visible_noise=float(np.mean([sum(r["visible"]) for r in base])) if base else None,
        )

    def _files(self, name: str) -> dict[str, ClipFiles]:
        found: dict[str, ClipFiles] = {}
        for form in self.test.spec.formats:
            whole = hashlib.sha256()
            for frame in range(self.size.frames):
                whole.update(read_frame_bytes(self.folder, name, form, frame, self.size))
            found[form] = ClipFiles(
                path=clip_path(name, form),
                sha256=whole.hexdigest(),
                frame_sha256=tuple(
                    self._record(name, frame)["sha256"][form] for frame in range(self.size.frames)
                ),
            )
        return found

    def _conditions(self) -> dict[str, Condition]:
        return {c.stimulus(self.job.name): c for c in self.job.conditions}

    def _record(self, name: str, frame: int) -> dict[str, Any]:
        record: dict[str, Any] = self.journal.frames[self.job.name, frame]["clips"][name]
        return record

    def _finished(self, frame: int) -> bool:
        """Tell whether a frame of all clips is on disk with the digests that the journal has."""
        line = self.journal.frames.get((self.job.name, frame))
        return line is not None and all(
            sha256(read_frame_bytes(self.folder, name, form, frame, self.size))
            == line["clips"].get(name, {}).get("sha256", {}).get(form)
            for name in (self.job.reference, *self._conditions())
            for form in self.test.spec.formats
        )

    def _write(self, frame: int) -> Records:
        return self.writer.write(frame, self.folder)

    def _received(self, pool: Workers, todo: Iterable[int]) -> Iterator[tuple[int, Records]]:
        """Yield frames that others made, once their files are here."""
        make = partial(frame_from_afar, self.writer.order())
        for frame, (records, files) in completed(pool, make, todo):
            for (name, form), data in files.items():
                store_frame_bytes(self.folder, name, form, frame, data)
            yield frame, records


def _silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


def _from(tell: Progress, start: int, total: int, what: str) -> Callable[[int], None]:
    """Return what tells that so many frames after `start` are done."""
    return lambda done: tell(start + done, total, what)
