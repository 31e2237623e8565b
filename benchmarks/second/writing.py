"""A case's folder: frames, recording.toml and camera.toml. None holds the truth."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio  # noqa: N813 - the name that its own examples use

from second.building import Built
from second.geometry import Array, Case, Effect, coords, pick
from second.patterns import shading_template
from second.vocabulary import PARAMETERS

MADE = "2000:01:01 00:00:00"  # else a file would tell when it was written: no two runs alike
NAMES = ["bench A", "unit 17", "sn-2041", "proto", "imx-like", "ccd head", "line cam eval"]


def write(folder: Path, built: Built) -> None:
    """Write a recording and the camera.toml that goes with it."""
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    case, g = built.case, built.chance
    kind = pick(g, ["tif", "png", "npy"])
    style = int(g.integers(3))
    name = pick(g, NAMES)
    lines = [
        "[sensor]",
        f"name = {_toml(name)}",
        f'cfa = "{case["cfa"]}"',
        f"black_level = {_toml(case['nominal_black'])}",
        f"white_level = {case['white']}",
        f"bit_depth = {case['bits']}",
    ]
    count = {"dark": 0, "flat": 0, "scene": 0}
    for exposure, codes in zip(case["exposures"], built.frames, strict=True):
        number = count[exposure["kind"]]
        count[exposure["kind"]] += 1
        own, pattern = _names(exposure["kind"], number, style, kind)
        files = [pattern.format(t) for t in range(len(codes))]
        for file, frame in zip(files, codes, strict=True):
            _save(folder / file, frame)
        lines += ["", "[[exposure]]", f'name = "{own}"', f'kind = "{exposure["kind"]}"']
        lines.append(f"exposure_time_s = {_toml(exposure['time'])}")
        if exposure["kind"] == "flat" and case["light_given"]:
            lines.append(f"light = {_toml(float(format(exposure['light'], '.10g')))}")
        starred = pattern.replace("{:03d}", "*").replace("{}", "*")
        lines.append("frames = " + _toml(starred if g.random() < 0.5 else files))
    _text(folder / "recording.toml", lines)
    _text(folder / "camera.toml", _camera(built, name))


def _names(kind: str, number: int, style: int, ending: str) -> tuple[str, str]:
    """Return an exposure's name and its files' pattern in one of three styles."""
    name = (f"{kind}-{number:02d}", f"{kind[0].upper()}{number + 1}", f"{kind}_{number}")[style]
    return name, (f"{name}/{{}}.", f"raw/{name}_snap{{}}.", f"{name}/im_{{:03d}}.")[style] + ending


def _camera(built: Built, name: str) -> list[str]:
    case, model, g = built.case, built.model, built.chance
    lines = [
        'schema = "dsis-camera/1"',
        f"name = {_toml(name)}",
        f'cfa = "{case["cfa"]}"',
        f"black_level = {_toml(model['black_level'])}",
        f"white_level = {case['white']}",
        f"bit_depth = {case['bits']}",
    ]
    if case["cfa"] != "MONO" and g.random() < 0.5:
        r = case["response"]
        balance = [round(r["Gr"] / r["R"], 4), 1.0, round(r["Gr"] / r["B"], 4)]
        lines.append(f"white_balance = {_toml(balance)}")
    lines += ["", "[noise]", f'shot = "{case["shot"]}"']
    for segment in model["segments"]:
        lines += ["[[noise.segment]]", *(f"{k} = {_toml(v)}" for k, v in segment.items())]
    for effect in model["effects"]:
        lines += ["", "[[effect]]", f'kind = "{effect["kind"]}"']
        lines += [f"{k} = {_toml(v)}" for k, v in words(case, effect).items()]
    return lines


def words(case: Case, effect: Effect) -> dict[str, Any]:
    """Return an effect in the names and words of the project's vocabulary.

    What it has no word for - tails of a fixed pattern, another law of fall-off, a lamp that
    remembers - is left to the nearest that it has.
    """
    said = {name: effect[name] for name in PARAMETERS[effect["kind"]]}
    return {**said, **WORDS.get(effect["kind"], lambda _case, _effect: {})(case, effect)}


def _shading(case: Case, effect: Effect) -> dict[str, float]:
    """Return a fall-off from the sensor's centre and tilts: exact for r^2 about any centre."""
    if effect["law"] == "r2" and effect["centre"] == [0.5, 0.5]:
        return {}
    y, x = coords(case)
    v = 2 * y / (case["h"] - 1) - 1
    u = 2 * x / (case["w"] - 1) - 1
    r2 = (v * v * (case["h"] - 1) ** 2 + u * u * (case["w"] - 1) ** 2).ravel()
    light = 1 - effect["falloff_percent"] / 100 * shading_template(case, effect)
    basis = np.stack([np.ones_like(r2), -r2 / r2.max(), v.ravel(), u.ravel()], 1)
    level, fall, down, right = np.linalg.lstsq(basis, light.ravel(), rcond=None)[0]
    return {
        "falloff_percent": float(100 * fall / level),
        "tilt_down_percent": float(100 * down / level),
        "tilt_right_percent": float(100 * right / level),
    }


def _persistence(_case: Case, effect: Effect) -> dict[str, float]:
    return {"persistence": effect["ar"]} if effect["law"] == "ar1" else {}


def _along(_case: Case, effect: Effect) -> dict[str, str]:
    return {"along": effect["mode"]}


def _memory(_case: Case, effect: Effect) -> dict[str, str]:
    return {"along": f"{effect['axis']}s"}


WORDS: dict[str, Callable[[Case, Effect], dict[str, Any]]] = {
    "black_level_drift": _persistence,
    "crosstalk": _along,
    "readout_memory": _memory,
    "shading": _shading,
}


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(part) for part in value) + "]"
    if isinstance(value, int | np.integer):
        return str(int(value))
    return repr(float(value))


def _save(path: Path, frame: Array) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, frame)
        return
    out = oiio.ImageOutput.create(str(path))
    spec = oiio.ImageSpec(frame.shape[1], frame.shape[0], 1, "uint16")
    if path.suffix == ".tif":
        spec.attribute("compression", "zip")
        spec.attribute("DateTime", MADE)
    if not out.open(str(path), spec):
        raise OSError(out.geterror())
    if not out.write_image(np.ascontiguousarray(frame[:, :, None])):
        raise OSError(out.geterror())
    out.close()


def _text(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
