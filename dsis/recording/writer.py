"""Writes a recording: uint16 TIFF frames and `recording.toml`, whole or not at all."""

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.metadata import version
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dsis.imagefile import write_codes
from dsis.outdir import UNFINISHED, listed, result_folder
from dsis.recording.model import ExposurePlan, Recording, Sensor
from dsis.recording.reader import read_recording
from dsis.recording.tomlfile import RECORDING, write_listing

PROVENANCE = "provenance.json"
"""Marks a recording that dsis wrote: only such a one may be replaced by another."""

Progress = Callable[[int, int, str], None]
_FRAME = re.compile(r"\d{4,}\.tif|\.\d{4,}\.unfinished\.tif")
_PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]*")


def write_recording(
    out: Path,
    sensor: Sensor,
    exposures: Sequence[ExposurePlan],
    frames: Iterable[NDArray[np.uint16]],
    *,
    origin: str = "",
    progress: Progress | None = None,
) -> Recording:
    """Write a recording and return it as it reads back.

    Parameters
    ----------
    out
        Folder for the result. Work goes on in `OUT.partial`; an earlier recording that dsis wrote
        is replaced; anything else is refused, also an earlier one that holds more than that.
    sensor
        Its sensor.
    exposures
        Its exposures, with unique names.
    frames
        Codes, uint16 (row, column), right-aligned: all frames of the first exposure, then those of
        the next. Consumed one by one.
    origin
        How the frames came about, for whoever finds the folder.
    progress
        Called with (frames done, frames in all, exposure).
    """
    out = out.absolute()
    if not exposures or len({plan.name for plan in exposures}) < len(exposures):
        message = "a recording needs exposures, each with a name of its own"
        raise ValueError(message)
    with result_folder(out, PROVENANCE, keep=_not_ours) as partial:
        folders = _folders([plan.name for plan in exposures])
        _write_frames(partial, sensor, exposures, frames, folders, progress)
        globs = {plan.name: (plan, f"{folders[plan.name]}/*.tif") for plan in exposures}
        mark = {"written_by": f"dsis {version('dsis')}", "origin": origin}
        (partial / PROVENANCE).write_text(json.dumps(mark, indent=2) + "\n", encoding="utf-8")
        write_listing(partial / RECORDING, sensor, globs)
        read_recording(partial)  # what cannot be read must not take the place of an earlier one
    return read_recording(out)


def origin_of(recording: Recording) -> str:
    """Return how a recording's frames came about, as `write_recording` was told; "": not known."""
    try:
        mark = json.loads((recording.folder / PROVENANCE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    told = mark.get("origin", "") if isinstance(mark, dict) else ""
    return told if isinstance(told, str) else ""


def _write_frames(
    folder: Path,
    sensor: Sensor,
    exposures: Sequence[ExposurePlan],
    frames: Iterable[NDArray[np.uint16]],
    folders: Mapping[str, str],
    progress: Callable[[int, int, str], None] | None,
) -> None:
    total, done = sum(plan.frames for plan in exposures), 0
    stream = iter(frames)
    for plan in exposures:
        for number, codes in enumerate(_exactly(plan, stream)):
            if codes.max() > sensor.white_level:
                message = f"{plan.name}: code {codes.max()} is above {sensor.white_level:g}"
                raise ValueError(message)
            # Leading zeros: any program lists the frames in their order.
            write_codes(folder / folders[plan.name] / f"{number:04d}.tif", codes[:, :, np.newaxis])
            done += 1
            if progress is not None:
                progress(done, total, plan.name)
    if next(stream, None) is not None:
        message = f"more frames than the {total} that the exposures announce"
        raise ValueError(message)


def _exactly(
    plan: ExposurePlan, stream: Iterator[NDArray[np.uint16]]
) -> Iterator[NDArray[np.uint16]]:
    """Yield as many frames as the exposure announces; raise `ValueError` where there are fewer."""
    count = 0
    for codes in islice(stream, plan.frames):
        if codes.dtype != np.uint16 or codes.ndim != 2:
            message = f"{plan.name}: frames must be uint16 (row, column), not {codes.dtype}"
            raise ValueError(message)
        count += 1
        yield codes
    if count < plan.frames or not count:
        message = f"{plan.name}: {count} frames came, {plan.frames} (at least 1) were announced"
        raise ValueError(message)


def _folders(names: Sequence[str]) -> dict[str, str]:
    """Return the folder of each exposure: its name where every file system takes all of them."""
    plain = all(_PLAIN.fullmatch(name) for name in names)
    if plain and len({name.lower() for name in names}) == len(names):
        return {name: name for name in names}
    return {name: f"exposure-{number:03d}" for number, name in enumerate(names)}


def _not_ours(folder: Path) -> str | None:
    """Return what in an earlier recording, or an unfinished one, is no part of it."""
    exposures = _exposure_folders(folder)
    other = []
    for path in sorted(folder.iterdir()):
        if path.is_dir() and (exposures is None or path.name in exposures):
            names = (p.name for p in sorted(path.iterdir()))
            other += [f"{path.name}/{name}" for name in names if not _FRAME.fullmatch(name)]
        elif path.name not in {PROVENANCE, RECORDING, UNFINISHED}:
            other.append(path.name)
    return listed(other)


def _exposure_folders(folder: Path) -> frozenset[str] | None:
    """Return the folders that a recording's `recording.toml` names; None: it is unfinished."""
    if (folder / UNFINISHED).is_file():
        return None
    try:
        entries = tomllib.loads((folder / RECORDING).read_text(encoding="utf-8"))["exposure"]
        return frozenset(Path(entry["frames"]).parent.as_posix() for entry in entries)
    except (OSError, ValueError, KeyError, TypeError):  # changed by hand: no more ours
        return frozenset()
