"""Clips as players show them: raw rgb24, frame after frame, checked against the manifest.

A manifest's `player` file is that already. Clips of one's own may also be 8-bit image files
(`png8`, `frames`) or a lossless RGB video (`video`); those are converted once, before the session.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dsis.errors import DamagedError, DsisError, Fault, InputError
from dsis.manifest import MANIFEST, Clip, ClipFiles, Manifest
from dsis.session.convert import CONVERTERS, convert, converted

FORMAT = "player"


@dataclass(frozen=True)
class PlayerClip:
    """A clip whose bytes are those of the manifest.

    Attributes
    ----------
    stimulus
        Name of the clip.
    path
        File of raw frames, rgb24, row by row.
    frame_bytes
        Bytes of one frame.
    frame_sha256
        Hash of each frame: the page compares what arrived there.
    """

    stimulus: str
    path: Path
    frame_bytes: int
    frame_sha256: tuple[str, ...]

    def frame(self, number: int) -> bytes:
        """Return the bytes of a frame, counted from 0."""
        with self.path.open("rb") as file:
            file.seek(number * self.frame_bytes)
            return file.read(self.frame_bytes)


def check_playable(manifest: Manifest, folder: Path) -> None:
    """Raise `InputError` unless every clip can be shown and lies in the manifest's folder."""
    faults = []
    for i, clip in enumerate(manifest.clips):
        form = _format(clip)
        if form is None:
            fact = (
                f'is missing; people are shown this format: set formats = ["{FORMAT}"] in the spec '
                f"(or, for clips of your own, give one of: {', '.join(CONVERTERS)})"
            )
            faults.append(Fault(str(folder / MANIFEST), f"clips[{i}].files.{FORMAT}", fact))
            continue
        key = f"clips[{i}].files.{form}.path"
        faults += _path_faults(manifest, folder, clip.files[form], form, key)
    if faults:
        raise InputError(faults)


def prepare_clips(
    manifest: Manifest, folder: Path, say: Callable[[str], object] = lambda _: None
) -> None:
    """Convert what is no raw rgb24 yet into `session/clips`; what is there already is kept.

    Raises
    ------
    InputError
        A clip cannot be shown exactly as it is: another size, more than 8 bits, no RGB, lossy.
    """
    faults: list[Fault] = []
    for i, clip in enumerate(manifest.clips):
        form = _format(clip)
        if form is None or form == FORMAT:
            continue
        try:
            if convert(manifest, folder, clip, form):
                say(f"clip {i + 1} of {len(manifest.clips)} made ready: {clip.stimulus}")
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)


def checked_clip(manifest: Manifest, folder: Path, clip: Clip) -> PlayerClip:
    """Read a clip once and return it; raise `DamagedError` where it is not the manifest's.

    A manifest written by hand may have no hashes: then the file is what it is now.
    """
    form = _format(clip) or FORMAT
    if form == FORMAT:
        files, path = clip.files[FORMAT], folder / clip.files[FORMAT].path
    else:
        try:
            path, files = converted(folder, clip, form)
        except DsisError as error:
            raise DamagedError(str(error)) from None
    length = _frame_bytes(manifest)
    whole = hashlib.sha256()
    frames = []
    try:
        with path.open("rb") as file:
            while data := file.read(length):
                whole.update(data)
                frames.append(hashlib.sha256(data).hexdigest())
    except OSError as error:
        message = f"{path}: cannot be read: {error.strerror}"
        raise DamagedError(message) from None
    stated = files.frame_sha256 or tuple(frames)
    if len(frames) != manifest.sequence.frames or stated != tuple(frames):
        wrong = [i for i, (a, b) in enumerate(zip(stated, frames, strict=False)) if a != b]
        message = f"{path}: differs from the manifest in frames {wrong or len(frames)}"
        raise DamagedError(message)
    if files.sha256 is not None and files.sha256 != whole.hexdigest():
        message = f"{path}: differs from the manifest (SHA-256)"
        raise DamagedError(message)
    return PlayerClip(clip.stimulus, path, length, tuple(frames))


def _path_faults(
    manifest: Manifest, folder: Path, files: ClipFiles, form: str, key: str
) -> list[Fault]:
    """Return why a file cannot be shown; a link may not lead out of the folder either."""
    path = folder / files.path
    if not path.resolve().is_relative_to(folder.resolve()):
        fact = f"is {files.path!r}, which leads out of the manifest's folder"
        return [Fault(str(folder / MANIFEST), key, fact)]
    if form != FORMAT:
        return []
    wanted = _frame_bytes(manifest) * manifest.sequence.frames
    found = path.stat().st_size if path.is_file() else None
    if found == wanted:
        return []
    fact = "is missing" if found is None else f"has {found} bytes, must have {wanted}"
    return [Fault(str(path), "", fact)]


def _format(clip: Clip) -> str | None:
    """Return the format of a clip that is shown; None: there is none that can be."""
    return next((form for form in (FORMAT, *CONVERTERS) if form in clip.files), None)


def _frame_bytes(manifest: Manifest) -> int:
    return manifest.sequence.width * manifest.sequence.height * 3
