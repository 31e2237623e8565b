"""A case on disk: the recording, and the camera.toml that somebody believes in."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from planter.calibration import levels, precision
from planter.case import Case
from planter.chain import frame_codes

Frames = Callable[[Case, int, int], np.ndarray]
# Errors of camera.toml relative to those of the recording: it was calibrated with more frames.
CALIBRATION = 0.5


def plant(folder: Path, case: Case, frames: Frames = frame_codes) -> Path:
    """Write `folder`/recording.toml with its frames (.npy) and `folder`/camera.toml.

    Frames are unsigned 16-bit codes, made by `frames(case, exposure, frame)`. camera.toml has the
    effects of `case.known` only; its numbers are the true ones but for those in `case.wrong`.
    Returns the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    listed = []
    for number, plan in enumerate(case.exposures):
        (folder / plan.name).mkdir(exist_ok=True)
        names = [f"{plan.name}/{frame}.npy" for frame in range(plan.frames)]
        for frame, name in enumerate(names):
            np.save(folder / name, frames(case, number, frame))
        entry: dict[str, Any] = {"name": plan.name, "kind": plan.kind}
        entry["exposure_time_s"] = plan.exposure_time_s
        if plan.light is not None:
            entry["light"] = plan.light
        listed.append({**entry, "frames": names})
    sensor = {"name": "planted", "cfa": case.cfa, "black_level": float(case.black_level)}
    sensor |= {"white_level": case.white_level, "bit_depth": case.bit_depth}
    values = {"sensor": sensor, "exposure": listed}
    (folder / "recording.toml").write_text(tomli_w.dumps(values), encoding="utf-8")
    (folder / "camera.toml").write_text(tomli_w.dumps(camera_values(case)), encoding="utf-8")
    return folder


def camera_values(case: Case) -> dict[str, Any]:
    """Return camera.toml: the base model with the errors that `case.wrong` asks for.

    An error of k is k times the standard error of the difference between camera.toml and what
    the recording says; of an effect's size it is that share.
    """
    segments: list[dict[str, Any]] = []
    both = np.hypot(1, CALIBRATION)
    black = case.black_level
    for number, path in enumerate(case.segments):
        known = precision(case, number)
        off = case.wrong if number == 0 else {}
        slope = path.slope + off.get("noise.slope", 0.0) * both * known.slope_se
        intercept = path.intercept + off.get("noise.intercept", 0.0) * both * known.intercept_se
        black += off.get("black_level", 0.0) * known.black_se
        segment: dict[str, Any] = {"slope": float(slope), "intercept": float(intercept)}
        segment["slope_se"] = CALIBRATION * known.slope_se
        segment["intercept_se"] = CALIBRATION * known.intercept_se
        if path.upper_dn is not None:
            gaps = case.wrong.get("noise.switch_dn", 0.0)
            segment["upper_dn"] = moved_switch(case, path.upper_dn, gaps)
        segments.append(segment)
    return {
        "schema": "dsis-camera/1",
        "name": "planted",
        "cfa": case.cfa,
        "black_level": float(black),
        "white_level": case.white_level,
        "bit_depth": case.bit_depth,
        "noise": {"shot": case.shot, "segment": segments},
        **({"effect": [_believed(case, kind) for kind in case.known]} if case.known else {}),
    }


def _believed(case: Case, kind: str) -> dict[str, Any]:
    """Return an effect as camera.toml has it."""
    parameters = case.planted(kind) or {}
    off = {name: 1 + case.wrong.get(f"effect.{kind}.{name}", 0.0) for name in parameters}
    return {"kind": kind, **{name: value * off[name] for name, value in parameters.items()}}


def moved_switch(case: Case, switch_dn: float, gaps: float) -> float:
    """Return a switch moved by a number of gaps between recorded levels: seen only then."""
    if not gaps:
        return switch_dn
    seen = sorted({round(signal, 6) for signal, _ in levels(case) if signal > 0})
    edges = [seen[0] / 2, *seen, 2 * seen[-1]]
    place = int(np.searchsorted(edges, switch_dn) + gaps)
    place = min(max(place, 1), len(edges) - 1)
    return float(np.sqrt(edges[place - 1] * edges[place]))
