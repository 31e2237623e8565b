"""Rendered panoramas, kept in the user's cache folder.

Each is a float32 `.npy` with a `.json` beside it that holds its SHA-256. The name tells scene,
seed, size, sampling and the version of the code, so that other code never finds it. A wider
panorama serves a narrower request, for its first columns are the same. Files appear under their
names when they are whole; what is damaged is rendered again, and said. One process renders, others
wait. Where one is written, those of the same scene that other code made are removed, and that is
said: the user's caches do not grow with every version.
"""

import hashlib
import json
import logging
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from dsis.scenes.renderer import code_version
from dsis.scenes.strip import Strip

Light = NDArray[np.float32]

PLACE = "DSIS_CACHE"
_SCHEMA = "dsis-panorama/1"
_log = logging.getLogger(__name__)


def cache_folder() -> Path:
    """Return the folder of kept panoramas: `scenes` in `DSIS_CACHE`, else in the user's caches.

    That is `XDG_CACHE_HOME` or `~/.cache` (XDG base directories: a relative path does not count),
    `~/Library/Caches` on macOS, `LOCALAPPDATA` on Windows; there `dsis/scenes`.
    """
    given = os.environ.get(PLACE)
    if given:
        return Path(given).expanduser() / "scenes"
    home = Path.home()
    if sys.platform == "darwin":
        base = home / "Library" / "Caches"
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    else:
        xdg = Path(os.environ.get("XDG_CACHE_HOME", ""))
        base = xdg if xdg.is_absolute() else home / ".cache"
    return base / "dsis" / "scenes"


def kept(strip: Strip) -> Light | None:
    """Return a strip from the cache, read-only; None where no undamaged one is wide enough."""
    for _, path in sorted(_wide_enough(strip)):
        image = _undamaged(path)
        if image is not None:
            return image[:, : strip.columns]
    return None


def is_kept(strip: Strip) -> bool:
    """Tell whether the cache holds a strip, damaged or not."""
    return any(True for _ in _wide_enough(strip))


def kept_or_rendered(strip: Strip, render: Callable[[], Light]) -> Light:
    """Return a strip from the cache; else what `render` gives, which is kept. Read-only.

    A cache that cannot be written costs time and nothing else: the strip is rendered, and said.
    """
    image = kept(strip)
    if image is not None:
        return image
    try:
        with _held(strip):
            image = kept(strip)  # another process may have rendered it meanwhile
            if image is None:
                image = render()
                _keep(strip, image)
                _remove_outdated(strip.scene)
    except OSError as error:
        _log.warning("%s: panoramas are not kept there (%s)", cache_folder(), error.strerror)
        image = render() if image is None else image
    image.flags.writeable = False
    return image


def _stem(strip: Strip, columns: int | str) -> str:
    what = f"{strip.scene}-{strip.seed}-{strip.rows}x{columns}"
    return f"{what}-s{strip.samples}a{strip.ambient}-{code_version(strip.scene)}"


def _wide_enough(strip: Strip) -> Iterator[tuple[int, Path]]:
    """Yield (columns, path) of what the cache holds of a strip, at least as wide as asked for."""
    pattern = re.compile(re.escape(_stem(strip, "W")).replace("W", r"(\d+)") + r"\.json")
    for path in cache_folder().glob(_stem(strip, "*") + ".json"):
        found = pattern.fullmatch(path.name)
        if found and int(found[1]) >= strip.columns:
            yield int(found[1]), path


def _undamaged(record: Path) -> Light | None:
    """Return the panorama that a `.json` describes; None, and a warning, where it is another."""
    path = record.with_suffix(".npy")
    try:
        expected = json.loads(record.read_bytes())["sha256"]
        held = path.read_bytes()
    except (OSError, ValueError, KeyError, TypeError):
        expected, held = None, b""
    if hashlib.sha256(held).hexdigest() == expected:
        return _array(held)
    _log.warning("%s is damaged and is rendered again", path)
    with suppress(OSError):  # a cache that others own may be read-only
        record.unlink()
    return None


def _array(npy: bytes) -> Light:
    """Return the array of a `.npy` file without copying it; read-only, as bytes are."""
    file = BytesIO(npy)
    np.lib.format.read_magic(file)
    shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    return np.frombuffer(npy, dtype, offset=file.tell()).reshape(shape)


def _keep(strip: Strip, image: Light) -> None:
    """Write a panorama and its record, the record last: without it nobody looks at the other."""
    file = BytesIO()
    np.lib.format.write_array(file, np.ascontiguousarray(image), version=(1, 0))
    record = {"schema": _SCHEMA, **asdict(strip), "code": code_version(strip.scene)}
    record |= {"primaries": "Rec.709, D65", "sha256": hashlib.sha256(file.getbuffer()).hexdigest()}
    stem = cache_folder() / _stem(strip, strip.columns)
    for path, held in (
        (stem.with_name(stem.name + ".npy"), file.getbuffer()),
        (stem.with_name(stem.name + ".json"), json.dumps(record, indent=1).encode() + b"\n"),
    ):
        with _whole(path) as unfinished:
            unfinished.write_bytes(held)


def _remove_outdated(scene: str) -> None:
    """Remove a scene's panoramas of other code, but for those that a process is rendering now."""
    name = re.compile(rf"({scene}-\d+-\d+x)\d+(-s\d+a\d+-([0-9a-f]{{16}}))\.(?:json|npy)")
    folder, gone, size = cache_folder(), 0, 0
    for path in sorted(folder.iterdir()):  # the record first: without it nobody looks for the rest
        found = name.fullmatch(path.name)
        if not found or found[3] == code_version(scene):
            continue
        with suppress(OSError, Timeout), _lock(f"{found[1]}any{found[2]}", timeout_s=0):
            held = path.stat().st_size
            path.unlink()
            gone, size = gone + (path.suffix == ".npy"), size + held
    if gone:
        what = f"removed {gone} of {scene} that another version of dsis rendered"
        _log.warning("%s: %s, %.0f MB", folder, what, size / 1e6)


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Yield a name to write to; it becomes `path` when the block ends well, else it is removed."""
    unfinished = path.with_name(f".{path.name}.unfinished")  # the lock keeps others from it
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def _held(strip: Strip) -> Iterator[None]:
    """Hold the right to render a scene of a seed and height; waits for whoever has it."""
    folder = cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with _lock(_stem(strip, "any")):
        yield


def _lock(stem: str, timeout_s: float = -1) -> FileLock:
    return FileLock(cache_folder() / f".{stem}.lock", timeout_s)
