"""The sealed key: what every concealed case holds, hashed before anybody looks."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from planter.case import Case, Effect
from planter.chain import KINDS
from planter.deck import OWN_STRENGTH, Deal, camera_for
from planter.disk import plant
from planter.fitted import fit_into
from planter.onreal import RealFrames
from planter.recipes import RECIPES
from planter.strength import Planting, Unidentifiable, calibrate, strength

CROP = (160, 208)
LATE = ("dual_gain_mismatch",)  # planted after what changes the camera


def conceal(task: Mapping[str, Any]) -> dict[str, Any]:
    """Write the recording of one deal and return its entry of the key.

    The entry holds the case in full, and per effect the z where it finally stands beside the
    others; 0 where the recording cannot show it.
    """
    dealt, folder = Deal(**task["deal"]), Path(task["folder"])
    real = RealFrames.read(Path(task["ccd"]), *CROP) if dealt.real else None
    seed = task["seed"]
    if real:
        case = real.twin(seed * 1000 + dealt.number)
    else:
        case = camera_for(dealt, seed, task.get("layout", "small"))
    if dealt.own is not None:
        case = replace(_planted(case, dealt.own, OWN_STRENGTH).case, known=(dealt.own,))
    plantings: list[Planting] = []
    pairs = sorted(zip(dealt.kinds, dealt.strengths, strict=True), key=_order)
    for kind, z in pairs:
        found = _planted(case, kind, z)
        case = found.case
        plantings.append(found)
    standing = {p.kind: _standing(case, p) for p in plantings}
    if real:
        plant(folder, case, real.frame_codes)
        # Whoever diagnoses it has a camera.toml of the recording as it was.
        fit_into(folder, reference(Path(task["work"]), real))
    else:
        plant(folder, case)
    return {
        "case": json.loads(case.to_json()),
        "z": standing,
        "wanted": dict(pairs),
        "out": dealt.out,
        "decoy": dealt.decoy,
        "real": dealt.real,
    }


def _order(pair: tuple[str, float]) -> tuple[int, str]:
    """Put first what changes the camera, last what needs it changed."""
    kind = pair[0]
    return (0 if kind in {"poisson_shot_noise", "dual_gain"} else 2 if kind in LATE else 1, kind)


def _planted(case: Case, kind: str, z: float) -> Planting:
    drawn = RECIPES[kind].draw(np.random.default_rng([case.seed, 5]), case)
    try:
        return calibrate(case, kind, z, drawn)
    except Unidentifiable:
        parameters = RECIPES[kind].parameters(case, drawn, 1.0)
        return Planting(case.having(Effect(kind, parameters)), kind, 0.0, 1.0, drawn)


def _standing(case: Case, planting: Planting) -> float:
    """Return the z of an effect with all others there, 0 where it cannot be seen."""
    if planting.z == 0:
        return 0.0
    try:
        return strength(case, planting.kind, planting.drawn, planting.x).z
    except Unidentifiable:
        return 0.0


def reference(work: Path, real: RealFrames) -> Path:
    """Return the folder of the real crop without any effect, written once."""
    folder = work / "real-reference"
    if not (folder / "camera.toml").exists():
        plant(folder, real.twin(0), real.frame_codes)
        fit_into(folder, folder)
    return folder


def vocabulary(entry: Mapping[str, Any]) -> list[str] | None:
    """Return the effects that may be named in a case; None: all."""
    return sorted(KINDS - {entry["out"]}) if entry["out"] else None


def seal(path: Path, key: Mapping[str, Mapping[str, Any]]) -> str:
    """Write the key and return its SHA-256."""
    text = "\n".join(json.dumps(key[name], sort_keys=True) for name in sorted(key)) + "\n"
    path.write_text(text, encoding="utf-8")
    return hashlib.sha256(text.encode()).hexdigest()


def deal_values(dealt: Deal) -> dict[str, Any]:
    """Return a deal as plain values for another process."""
    return asdict(dealt)
