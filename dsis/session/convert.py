"""Clips of one's own as raw rgb24: 8-bit image files, or a lossless RGB video through ffmpeg.

Nothing is rounded on the way: what is not 8-bit RGB (or grey), or may have lost something, is
refused. The raw file and what it was made of lie in `session/clips`; a source that has changed
since is converted again.
"""

import hashlib
import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from dsis.errors import InputError
from dsis.imagefile import codes, codes_info, find_files, read
from dsis.manifest import Clip, ClipFiles, Manifest

CLIPS = Path("session") / "clips"
CONVERTERS = ("png8", "frames", "video")
LOSSLESS = ("ffv1", "ffvhuff", "huffyuv", "magicyuv", "png", "rawvideo", "utvideo")
RGB8 = ("bgr0", "bgr24", "bgra", "gbrap", "gbrp", "gray", "rgb0", "rgb24", "rgba")


def convert(manifest: Manifest, folder: Path, clip: Clip, form: str) -> bool:
    """Make the raw file of a clip; return False where it is there and of the same source.

    Raises
    ------
    InputError
        The source is missing, not what the manifest says, or cannot be shown as it is.
    """
    sources = _sources(folder, clip.files[form], form, clip)
    raw, note = _places(folder, clip)
    state = [[path.name, path.stat().st_size, path.stat().st_mtime_ns] for path in sources]
    if raw.is_file() and note.is_file() and json.loads(note.read_text())["source"] == state:
        return False
    _check_hashes(sources, clip.files[form])
    raw.parent.mkdir(parents=True, exist_ok=True)
    frames = _video(sources[0], manifest) if form == "video" else _images(sources, manifest)
    unfinished = raw.with_suffix(".unfinished")
    hashes = []
    with unfinished.open("wb") as file:
        for data in frames:
            hashes.append(hashlib.sha256(data).hexdigest())
            file.write(data)
    if len(hashes) != manifest.sequence.frames:
        unfinished.unlink()
        fact = f"has {len(hashes)} frames, must have {manifest.sequence.frames}"
        raise InputError.of(folder / clip.files[form].path, "", fact)
    note.unlink(missing_ok=True)
    unfinished.replace(raw)
    note.write_text(json.dumps({"source": state, "frame_sha256": hashes}), encoding="utf-8")
    return True


def converted(folder: Path, clip: Clip, form: str) -> tuple[Path, ClipFiles]:
    """Return the raw file of a converted clip, and what its frames must be."""
    raw, note = _places(folder, clip)
    if not note.is_file():
        raise InputError.of(folder / clip.files[form].path, "", "has not been made ready")
    hashes = tuple(json.loads(note.read_text(encoding="utf-8"))["frame_sha256"])
    return raw, ClipFiles(path=str(raw), frame_sha256=hashes)


def _places(folder: Path, clip: Clip) -> tuple[Path, Path]:
    # A stimulus may have any name; a file may not.
    name = hashlib.sha256(clip.stimulus.encode()).hexdigest()[:24]
    return folder / CLIPS / f"{name}.rgb", folder / CLIPS / f"{name}.json"


def _sources(folder: Path, files: ClipFiles, form: str, clip: Clip) -> tuple[Path, ...]:
    found = find_files(folder, [files.path])
    outside = [p for p in found if not p.resolve().is_relative_to(folder.resolve())]
    if outside:
        raise InputError.of(outside[0], "", "leads out of the manifest's folder")
    if not found or (form == "video" and len(found) > 1):
        wanted = "one file" if form == "video" else "image files"
        fact = f"is {files.path!r}, names {len(found)} files, must name {wanted}"
        raise InputError.of(folder, f"{clip.stimulus}.files.{form}.path", fact)
    return found


def _check_hashes(sources: tuple[Path, ...], files: ClipFiles) -> None:
    """Compare with the manifest: every file, where it states that, and all in order."""
    whole = hashlib.sha256()
    for i, path in enumerate(sources):
        data = path.read_bytes()
        whole.update(data)
        if i < len(files.frame_sha256) and (
            hashlib.sha256(data).hexdigest() != files.frame_sha256[i]
        ):
            raise InputError.of(path, "", "differs from the manifest (SHA-256)")
    if files.sha256 is not None and whole.hexdigest() != files.sha256:
        raise InputError.of(sources[0], "", "differs from the manifest (SHA-256 of the clip)")


def _images(paths: tuple[Path, ...], manifest: Manifest) -> Iterator[bytes]:
    size = manifest.sequence
    for path in paths:
        info = codes_info(path)
        if info.pixel_type != "uint8" or path.suffix.lower() in (".jpg", ".jpeg"):
            kind = "lossy" if info.pixel_type == "uint8" else info.pixel_type
            fact = f"is {kind}, must be a lossless file of 8 bits: the page shows 8 bits"
            raise InputError.of(path, "", fact)
        if (info.rows, info.columns) != (size.height, size.width):
            fact = f"is {info.columns} x {info.rows}, must be {size.width} x {size.height}"
            raise InputError.of(path, "", fact)
        yield codes(read(path), 255).astype(np.uint8).tobytes()


def _video(path: Path, manifest: Manifest) -> Iterator[bytes]:
    ffmpeg, ffprobe = shutil.which("ffmpeg"), shutil.which("ffprobe")
    if ffmpeg is None or ffprobe is None:
        fact = "is a video, which needs ffmpeg and ffprobe; neither is found"
        raise InputError.of(path, "", fact)
    _check_stream(path, ffprobe, manifest)
    length = manifest.sequence.width * manifest.sequence.height * 3
    command = [ffmpeg, "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    with subprocess.Popen(  # noqa: S603  a program found above, a path of the user's own
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as decoder:
        if decoder.stdout is None or decoder.stderr is None:
            message = "pipes were asked for"
            raise AssertionError(message)
        while data := decoder.stdout.read(length):
            yield data
        complaint = decoder.stderr.read().decode(errors="replace").strip().splitlines()
    if decoder.returncode or complaint:
        fact = f"cannot be decoded: {complaint[0] if complaint else decoder.returncode}"
        raise InputError.of(path, "", fact)


def _check_stream(path: Path, ffprobe: str, manifest: Manifest) -> None:
    entries = "stream=codec_name,pix_fmt,width,height"
    command = [ffprobe, "-v", "error", "-select_streams", "v:0", "-show_entries", entries]
    done = subprocess.run(  # noqa: S603  a program found by name, a path of the user's own
        [*command, "-of", "json", str(path)], capture_output=True, text=True, check=False
    )
    streams = json.loads(done.stdout or "{}").get("streams", [])
    if not streams:
        reason = done.stderr.strip().splitlines() or ["it holds no pictures"]
        raise InputError.of(path, "", f"is no video that ffmpeg reads: {reason[0]}")
    stream, size = streams[0], manifest.sequence
    if stream["codec_name"] not in LOSSLESS:
        fact = f"is {stream['codec_name']}, must be lossless: {', '.join(LOSSLESS)}"
        raise InputError.of(path, "", fact)
    if stream["pix_fmt"] not in RGB8:
        fact = f"holds {stream['pix_fmt']}, must be 8-bit RGB: {', '.join(RGB8)}"
        raise InputError.of(path, "", fact)
    if (stream["width"], stream["height"]) != (size.width, size.height):
        fact = f"is {stream['width']} x {stream['height']}, must be {size.width} x {size.height}"
        raise InputError.of(path, "", fact)
