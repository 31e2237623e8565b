"""Every frame of a stimuli folder against its manifest."""

import hashlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from dsis.errors import DamagedError
from dsis.manifest import Clip, Manifest, read_manifest
from dsis.spec import Sequence
from dsis.stimuli.clipfiles import frames_of

FAULTS_SHOWN = 20


def check_stimuli(
    folder: Path, *, jobs: int = 1, progress: Callable[[int, int, str], None] | None = None
) -> int:
    """Compare every frame on disk with the manifest and return how many frames agree.

    Raises
    ------
    DamagedError
        Frames are missing, differ or are too many: all are counted, the first ones named.
    InputError
        The folder holds no manifest.
    """
    manifest = read_manifest(folder)
    work = [(clip, form) for clip in manifest.clips for form in clip.files]
    faults: list[str] = []
    frames = 0
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        results = pool.map(lambda job: _check(folder, job[0], job[1], manifest.sequence), work)
        for n, ((clip, _), (agreeing, wrong)) in enumerate(zip(work, results, strict=True), 1):
            frames += agreeing
            faults += wrong
            if progress is not None:
                progress(n, len(work), clip.stimulus)
    if faults:
        more = f"\n... and {len(faults) - FAULTS_SHOWN} more" if len(faults) > FAULTS_SHOWN else ""
        raise DamagedError("\n".join(faults[:FAULTS_SHOWN]) + more)
    return frames


def summary(manifest: Manifest) -> str:
    """Return a table of all test clips: mean PSNR and visible noise energy."""
    header = ("stimulus", "PSNR dB", "vs demosaicked", "visible noise", "of it colour", "sigma")
    rows = [header]
    for clip in manifest.clips:
        if clip.role != "reference":
            q = clip.quality
            share = None
            if q.visible_noise and q.visible_colour is not None:
                share = 100 * q.visible_colour / q.visible_noise
            rows.append(
                (
                    clip.stimulus + (" (training)" if clip.role == "training" else ""),
                    _mean(q.psnr_db),
                    _mean(q.psnr_demosaicked_db),
                    "-" if q.visible_noise is None else f"{q.visible_noise:.2f}",
                    "-" if share is None else f"{share:.0f} %",
                    "-" if clip.awgn_sigma is None else f"{clip.awgn_sigma:.2f}",
                )
            )
    widths = [max(len(row[i]) for row in rows) for i in range(len(header))]
    lines = [
        row[0].ljust(widths[0])
        + "".join(f"  {cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True))
        for row in rows
    ]
    return "\n".join([*lines, *_effects(manifest), *_grouped(manifest.remarks)])


def _effects(manifest: Manifest) -> list[str]:
    """Return one line per clip on what physics beyond the base model does to it."""
    lines = []
    for clip in manifest.clips:
        q = clip.quality
        if q.visible_noise is not None and q.base_visible_noise:
            with_effects = _mean(tuple(q.psnr_db[frame] for frame in q.visible_frames))
            lines.append(
                f"effects on {clip.stimulus}: PSNR {_mean(q.base_psnr_db)} -> {with_effects} dB, "
                f"visible noise {q.base_visible_noise:.2f} -> {q.visible_noise:.2f}"
            )
    return lines


def _grouped(remarks: tuple[str, ...]) -> list[str]:
    """Return one line per remark, with all the contents that it is about."""
    contents: dict[str, list[str]] = {}
    for remark in remarks:
        name, _, says = remark.partition(": ")
        contents.setdefault(says, []).append(name)
    return [f"remark on {', '.join(names)}: {says}" for says, names in contents.items()]


def _mean(values: tuple[float | None, ...]) -> str:
    """Return the mean over frames in dB; a frame without any difference makes it infinite."""
    if not values:
        return "-"
    finite = [value for value in values if value is not None]
    return f"{sum(finite) / len(finite):.2f}" if len(finite) == len(values) else "inf"


def _check(folder: Path, clip: Clip, form: str, size: Sequence) -> tuple[int, list[str]]:
    """Return (frames that agree, faults) of one clip in one format."""
    files = clip.files[form]
    where = f"{folder / files.path}"
    whole, agreeing, faults, frame = hashlib.sha256(), 0, [], -1
    try:
        for frame, data in enumerate(frames_of(folder, clip, form, size)):
            whole.update(data)
            expected = files.frame_sha256[frame] if frame < len(files.frame_sha256) else None
            if files.frame_sha256 and hashlib.sha256(data).hexdigest() != expected:
                faults.append(f"{where}: frame {frame} is not the one of the manifest")
            else:
                agreeing += 1
    except OSError as error:
        return agreeing, [f"{where}: cannot be read: {error.strerror}"]
    if frame + 1 != size.frames:
        faults.append(f"{where}: {frame + 1} frames, must be {size.frames}")
    elif not faults and files.sha256 is not None and whole.hexdigest() != files.sha256:
        faults.append(f"{where}: is not the clip of the manifest")
    return agreeing, faults
