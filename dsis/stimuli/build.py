"""Test spec -> four conditions -> frames and manifest; resumable, whatever the workers."""

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

import dsis
from dsis.camera import camera_values
from dsis.color import STUDIO_CONFIG, DisplayTransform
from dsis.errors import InputError
from dsis.manifest import (
    MANIFEST,
    Clip,
    ClipFiles,
    Manifest,
    Quality,
    write_manifest,
)
from dsis.outdir import check_replaceable, finish, partial_of
from dsis.scenes import SCENES
from dsis.spec import Content, Test
from dsis.stimuli.clipfiles import clip_path, read_frame_bytes, write_frame
from dsis.stimuli.conditions import CODE_MAX, Condition, Rendering, conditions_of
from dsis.stimuli.figure import write_figures
from dsis.stimuli.journal import Journal, sha256
from dsis.stimuli.match import matching_frames, solve_sigma
from dsis.stimuli.quality import delivered, psnr_db, psnr_float_db
from dsis.stimuli.source import Source, remarks_on, source_of
from dsis.visibility import Eye, pixels_per_degree

Frame = NDArray[np.float32]
Progress = Callable[[int, int, str], None]

TRAINING = "training"
VISIBLE_FRAMES = 3
VOTES = "session"
_TRAINING_SEED_STEP = 1_000_003


@dataclass(frozen=True)
class Job:
    """A content with the conditions that it is shown in."""

    content: Content
    role: str
    conditions: tuple[Condition, ...]

    @property
    def name(self) -> str:
        """Name of the content."""
        return self.content.name or ""

    @property
    def reference(self) -> str:
        """Name of the content's reference stimulus."""
        return f"{self.name}__reference"


def jobs_of(test: Test) -> tuple[Job, ...]:
    """Return what is to be built: the test's contents in all conditions, and the training's.

    Training shows another scene, or the same with another seed: never a clip of the test.
    """
    conditions = conditions_of(test.spec)
    jobs = [Job(content, "test", conditions) for content in test.contents()]
    wanted = min(test.spec.session.training, len(conditions))
    if wanted:
        places = np.linspace(0, len(conditions) - 1, wanted).round().astype(int)
        jobs.append(Job(training_content(test), TRAINING, tuple(conditions[i] for i in places)))
    return tuple(jobs)


def training_content(test: Test) -> Content:
    """Return the content of the training: a scene that the test does not show."""
    shown = [content for content in test.spec.content if content.scene is not None]
    unused = [scene for scene in SCENES if scene not in {c.scene for c in shown}]
    model = shown[0] if shown else Content(name=TRAINING, scene=SCENES[0])
    scene = unused[0] if unused else model.scene
    seed = max((c.scene_seed for c in shown), default=0) + _TRAINING_SEED_STEP
    return model.model_copy(update={"name": TRAINING, "scene": scene, "scene_seed": seed})


def build_stimuli(
    test: Test,
    out: Path,
    *,
    jobs: int = 1,
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
    progress
        Called with (frames done, frames in all, what is being done).

    Raises
    ------
    InputError
        `out` holds something else, or recorded votes, or unfinished work of another spec.
    """
    digest = build_digest(test)
    check_replaceable(out, MANIFEST, kept=VOTES)
    partial = partial_of(out)
    with _locked(partial):
        journal = Journal(partial, digest)
        work = jobs_of(test)
        total = len(work) * test.spec.sequence.frames
        tell = progress or _silent
        clips: list[Clip] = []
        sigmas: dict[str, dict[str, float]] = {}
        for i, job in enumerate(work):
            done = i * test.spec.sequence.frames
            tell(done, total, f"{job.name}: light")
            builder = Builder(test, job, partial, journal)
            sigmas[job.name] = {str(level): s for level, s in builder.sigma.items()}
            builder.build(jobs, _from(tell, done, total, job.name))
            clips += builder.clips(jobs)
            write_figures(builder.figure_frames(), partial / "figures", job.name)
        manifest = _manifest(test, tuple(clips), sigmas)
        write_manifest(manifest, partial)
        journal.remove()
        finish(partial, out)
    return manifest


class Builder:
    """Builds all clips of one content."""

    def __init__(self, test: Test, job: Job, folder: Path, journal: Journal) -> None:
        self.test, self.job, self.folder, self.journal = test, job, folder, journal
        spec = test.spec
        self.size = spec.sequence
        transform = DisplayTransform(spec.color)
        self.rendering = Rendering(test.camera, transform, spec.seed)
        self.source: Source = source_of(job.content, test, transform)
        self.eye = Eye(pixels_per_degree(spec.viewing, self.size.height))
        self.visible = matching_frames(self.size.frames, VISIBLE_FRAMES)
        self.sigma = {
            level: self._sigma(level)
            for level in sorted({c.level for c in job.conditions if c.noise == "awgn"})
        }

    def _sigma(self, level: int) -> float:
        known = self.test.sigma.get((self.job.name, level))
        if known is not None:
            return known
        return solve_sigma(self.test.spec, self.source, self.rendering, self.job.name, level)

    def build(self, jobs: int, done: Callable[[int], None]) -> None:
        """Write every frame that is not there yet."""
        frames = range(self.size.frames)
        todo = [frame for frame in frames if not self._finished(frame)]
        done(self.size.frames - len(todo))
        with ThreadPoolExecutor(max(1, jobs)) as pool:
            running = [pool.submit(self._write, frame) for frame in todo]
            try:
                for n, result in enumerate(as_completed(running), self.size.frames - len(todo) + 1):
                    result.result()
                    done(n)
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise

    def frame(self, frame: int) -> Iterator[tuple[str, Frame, Frame | None]]:
        """Yield (stimulus, display frame 0..1, demosaicked noise-free frame) of all clips.

        The first is the reference.
        """
        make, job = self.rendering, self.job
        clean = make.camera.clean_raw(self.source.light(frame))
        reference = make.reference(clean)
        yield job.reference, reference, None
        methods = sorted({c.demosaic for c in job.conditions} - {"none"})
        noises = {c.noise for c in job.conditions}
        clean_dem: dict[tuple[str, str], Frame] = {}
        for method in methods:
            if "sd" in noises:
                clean_dem["sd", method] = make.display_demosaicked(clean, method)
            if "awgn" in noises:
                codes = make.mosaicked_display(reference * CODE_MAX, method)
                clean_dem["awgn", method] = codes / CODE_MAX
        fields: dict[tuple[str, int], Frame] = {}
        for condition in job.conditions:
            noise, level = condition.noise, condition.level
            if (noise, level) not in fields:
                fields[noise, level] = (
                    make.noisy_raw(clean, job.name, level, frame)
                    if noise == "sd"
                    else make.noisy_display(reference, self.sigma[level], job.name, level, frame)
                )
            field = fields[noise, level]
            name = condition.stimulus(job.name)
            if condition.demosaic == "none":
                yield name, make.display(field) if noise == "sd" else field / CODE_MAX, reference
            elif noise == "sd":
                display = make.display_demosaicked(field, condition.demosaic)
                yield name, display, clean_dem[noise, condition.demosaic]
            else:
                display = make.mosaicked_display(field, condition.demosaic) / CODE_MAX
                yield name, display, clean_dem[noise, condition.demosaic]

    def figure_frames(self) -> dict[tuple[str, int], dict[str, Frame]]:
        """Return the middle frames, {(noise, level): {"reference" or demosaic: frame}}."""
        shown = {name: display for name, display, _ in self.frame(self.size.frames // 2)}
        found: dict[tuple[str, int], dict[str, Frame]] = {}
        for c in self.job.conditions:
            row = found.setdefault((c.noise, c.level), {"reference": shown[self.job.reference]})
            row[c.demosaic] = shown[c.stimulus(self.job.name)]
        return found

    def clips(self, jobs: int) -> list[Clip]:
        """Return the manifest's entries of all clips, from what the journal holds."""
        conditions = {c.stimulus(self.job.name): c for c in self.job.conditions}
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
        records = [self._record(name, frame) for frame in range(self.size.frames)]
        seen = [r["visible"] for r in records if r["visible"] is not None]
        lightness, colour = np.mean(seen, axis=0)
        return Clip(
            stimulus=name,
            content=self.job.name,
            role="training" if self.job.role == TRAINING else "test",
            reference=self.job.reference,
            noise=condition.noise,
            demosaic=condition.demosaic,
            level=condition.level,
            awgn_sigma=self.sigma[condition.level] if condition.noise == "awgn" else None,
            files=files,
            quality=Quality(
                psnr_db=tuple(r["psnr_db"] for r in records),
                psnr_float_db=tuple(r["psnr_float_db"] for r in records),
                psnr_demosaicked_db=tuple(r["psnr_demosaicked_db"] for r in records),
                visible_frames=self.visible,
                visible_noise=float(lightness + colour),
                visible_lightness=float(lightness),
                visible_colour=float(colour),
            ),
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

    def _record(self, name: str, frame: int) -> dict[str, Any]:
        record: dict[str, Any] = self.journal.frames[self.job.name, frame]["clips"][name]
        return record

    def _finished(self, frame: int) -> bool:
        """Tell whether a frame of all clips is on disk with the digests that the journal has."""
        line = self.journal.frames.get((self.job.name, frame))
        return line is not None and all(
            sha256(read_frame_bytes(self.folder, name, form, frame, self.size)) == digest
            for name, record in line["clips"].items()
            for form, digest in record["sha256"].items()
        )

    def _write(self, frame: int) -> None:
        records: dict[str, Any] = {}
        reference: Frame | None = None
        for name, display, clean_dem in self.frame(frame):
            record: dict[str, Any] = {
                "sha256": {
                    form: write_frame(self.folder, name, form, frame, display)
                    for form in self.test.spec.formats
                }
            }
            if clean_dem is None or reference is None:
                reference = display
                seen = self._seen(display) if frame in self.visible else None
            else:
                record |= self._quality(display, reference, clean_dem)
                record["visible"] = self._visible(display, seen)
            records[name] = record
        self.journal.add(self.job.name, frame, records)

    def _quality(self, display: Frame, reference: Frame, clean_dem: Frame) -> dict[str, Any]:
        test = delivered(display)
        return {
            "psnr_db": _finite(psnr_db(test, delivered(reference))),
            "psnr_float_db": _finite(psnr_float_db(display, reference)),
            "psnr_demosaicked_db": _finite(psnr_db(test, delivered(clean_dem))),
        }

    def _seen(self, display: Frame) -> Frame:
        return self.eye.seen(delivered(display).astype(np.float32) / CODE_MAX)

    def _visible(self, display: Frame, seen: Frame | None) -> list[float] | None:
        if seen is None:
            return None
        shown = delivered(display).astype(np.float32) / CODE_MAX
        difference = self.eye.difference(shown, seen)
        return [difference.lightness, difference.colour]


def _silent(done: int, total: int, what: str) -> None:
    """Tell nobody."""


def _from(tell: Progress, start: int, total: int, what: str) -> Callable[[int], None]:
    """Return what tells that so many frames after `start` are done."""
    return lambda done: tell(start + done, total, what)


def build_digest(test: Test) -> str:
    """Return the digest of all that decides the bytes: spec, camera, footage, versions."""
    footage = {
        name: [(str(path), path.stat().st_size, path.stat().st_mtime_ns) for path in paths]
        for name, paths in test.footage.items()
    }
    sigma = sorted((name, level, value) for (name, level), value in test.sigma.items())
    everything = [spec_values(test), footage, sigma, _versions()]
    return sha256(json.dumps(everything, sort_keys=True).encode())


def spec_values(test: Test) -> dict[str, Any]:
    """Return the spec as resolved: the camera model in full, files with their whole paths."""
    values: dict[str, Any] = test.spec.model_dump(mode="json", by_alias=True, exclude_none=True)
    values["camera"] = camera_values(test.camera)
    for content in values["content"]:
        for key in ("files", "stills"):
            if key in content:
                content[key] = [str(test.folder / path) for path in content[key]]
    return values


def _manifest(test: Test, clips: tuple[Clip, ...], sigmas: dict[str, dict[str, float]]) -> Manifest:
    spec = test.spec
    return Manifest(
        schema="dsis-manifest/1",  # type: ignore[call-arg] # the alias, as files have it
        title=spec.title,
        sequence=spec.sequence,
        viewing=spec.viewing,
        session=spec.session,
        clips=clips,
        remarks=tuple(r for content in test.contents() for r in remarks_on(content, test)),
        spec=spec_values(test),
        awgn_sigma={name: per for name, per in sigmas.items() if per},
        versions=_versions(),
    )


def _versions() -> dict[str, str]:
    packages = ("numpy", "scipy", "numba", "opencolorio", "OpenImageIO")
    return {
        "dsis": dsis.__version__,
        "ocio_config": STUDIO_CONFIG,
        **{name: version(name) for name in packages},
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


@contextmanager
def _locked(partial: Path) -> Iterator[None]:
    """Hold the unfinished folder for this process: a second build of it is refused."""
    partial.mkdir(parents=True, exist_ok=True)
    lock = FileLock(partial.with_name(partial.name + ".lock"))
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError.of(partial, "", "another process is at work on it") from None
    try:
        yield
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)
