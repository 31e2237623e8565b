"""A deck on disk and its sealed key: what a process of its own does for all cases."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from third.camera import Camera
from third.dealing import Dealt, deck
from third.writing import write


def conceal(task: Mapping[str, Any]) -> dict[str, Any]:
    """Write all recordings of a deck and return its key, by the names of their folders."""
    key, work = {}, Path(task["folder"])
    for number, (dealt, chance) in enumerate(deck(task["seed"], task["cases"])):
        name = f"case-{number:03d}"
        wrong = write(work / name, dealt, chance)
        key[name] = {"case": name, **entry(dealt, wrong)}
    return {"cases": key}


def entry(dealt: Dealt, wrong: Mapping[str, float]) -> dict[str, Any]:
    """Return a hand's entry of the key."""
    planted = [
        {
            "effect": effect.kind,
            "z": round(effect.z, 1),
            "law": "neighbouring" if effect.neighbouring else "exact",
            "also_right": list(effect.also_right),
            "listed": effect.listed,
            "parameters": json.loads(json.dumps(effect.parameters(), default=float)),
        }
        for effect in dealt.effects
    ]
    return {
        "kind": dealt.kind,
        "wrong_numbers": dict(wrong),
        "planted": planted,
        "camera": _camera_values(dealt.bench.camera),
    }


def seal(path: Path, key: Mapping[str, Mapping[str, Any]]) -> str:
    """Write the key and return its SHA-256."""
    text = "\n".join(json.dumps(key[name], sort_keys=True) for name in sorted(key)) + "\n"
    path.write_text(text, encoding="utf-8")
    return hashlib.sha256(text.encode()).hexdigest()


def _camera_values(camera: Camera) -> dict[str, Any]:
    return {
        "size": [camera.rows, camera.columns],
        "cfa": camera.cfa,
        "bits": camera.bits,
        "slope": camera.low.slope,
        "intercept": camera.low.intercept,
        "black": camera.black,
        "shot": camera.shot,
        "segments": 1 if camera.high is None else 2,
        "switch": camera.switch_dn,
        "levels": camera.count("flat"),
        "spacing": camera.spacing,
        "driver": "time" if camera.timed else "illumination",
        "light_known": camera.light_known,
        "scene": bool(camera.count("scene")),
        "darks": camera.count("dark"),
        "frames": [exposure.frames for exposure in camera.exposures],
    }
