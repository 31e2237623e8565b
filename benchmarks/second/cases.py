"""Cases on disk and their sealed key: what a process of its own does for one case."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from second.building import build
from second.dealing import Hand
from second.writing import words, write


def conceal(task: Mapping[str, Any]) -> dict[str, Any]:
    """Write the recording of one hand and return its entry of the key."""
    built = build(task["seed"], Hand(**task["hand"]))
    write(Path(task["folder"]), built)
    written = {e["kind"]: words(built.case, e) for e in built.model["effects"]}
    return json.loads(json.dumps({**built.key, "written": written}, default=_plain))


def hand_values(hand: Hand) -> dict[str, Any]:
    """Return a hand as plain values for another process."""
    return asdict(hand)


def seal(path: Path, key: Mapping[str, Mapping[str, Any]]) -> str:
    """Write the key and return its SHA-256."""
    text = "\n".join(json.dumps(key[name], sort_keys=True) for name in sorted(key)) + "\n"
    path.write_text(text, encoding="utf-8")
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: np.generic) -> Any:
    return value.item()
