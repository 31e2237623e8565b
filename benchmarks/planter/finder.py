"""The diagnosis under test, run on files alone."""

import importlib
import json
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from analysis.mismatch import find_mismatch
from analysis.mismatch.jsonfile import finding_values
from dsis.camera import Camera, read_camera
from dsis.recording import Recording, read_recording

FINDER = "planter.finder:mismatch_values"


def mismatch_values(camera: Camera, recording: Recording, **options: Any) -> dict[str, Any]:
    """Return mismatch.json of `dsis mismatch`."""
    return finding_values(find_mismatch(camera, recording, **options))


def diagnose(
    folder: Path,
    *,
    finder: str = FINDER,
    seed: int = 0,
    vocabulary: Sequence[str] | None = None,
    camera: Path | None = None,
) -> dict[str, Any]:
    """Return what mismatch.json would hold, with "seconds"; with "error" where it was raised.

    Parameters
    ----------
    folder
        Holds recording.toml and camera.toml, and is all that the finder gets.
    finder
        `module:function` with the arguments of `find_mismatch`, giving mismatch.json.
    seed
        Of the finder.
    vocabulary
        Effects that may be named; None: all.
    camera
        Another camera.toml.
    """
    begun = time.monotonic()
    try:
        module, name = finder.split(":")
        find = getattr(importlib.import_module(module), name)
        found = find(
            read_camera(camera or folder / "camera.toml"),
            read_recording(folder),
            seed=seed,
            jobs=1,
            vocabulary=None if vocabulary is None else frozenset(vocabulary),
        )
        values = json.loads(json.dumps(found))
    except Exception as error:  # noqa: BLE001 # a crash is a result: counted, shown, never hidden
        values = {"verdict": "error", "error": f"{type(error).__name__}: {error}"}
        values["traceback"] = traceback.format_exc()
    return {**values, "seconds": round(time.monotonic() - begun, 2)}


def named(values: dict[str, Any]) -> list[str]:
    """Return the effects that a diagnosis names."""
    return sorted({entry["effect"] for entry in values.get("omitted_physics", ())})


def largest(values: dict[str, Any]) -> tuple[float, str]:
    """Return the largest |z| among mismatches and its statistic; (0, "") where there is none."""
    found = [(abs(m["z"]), m["statistic"]) for m in values.get("mismatches", ()) if m.get("z")]
    return max(found, default=(0.0, ""))
