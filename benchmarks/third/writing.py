"""A case's folder: frames, recording.toml and camera.toml. None holds the truth."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from third.camera import Camera
from third.camera import Path as ReadOutPath
from third.chain import simulate
from third.dealing import Dealt


def write(folder: Path, dealt: Dealt, chance: np.random.Generator) -> dict[str, float]:
    """Write a recording and its camera.toml; return what that has wrong.

    A slope or an intercept is wrong by the factor, a black level by the DN that are returned.
    """
    if folder.exists():
        shutil.rmtree(folder)
    (folder / "rec").mkdir(parents=True)
    camera = dealt.bench.camera
    unknown = any(effect.kind == "dual_gain" for effect in dealt.effects)
    paths = [camera.low] if unknown or camera.high is None else [camera.low, camera.high]
    paths, black, wrong = _believed(camera, paths, dealt.wrong, chance)
    _text(folder / "camera.toml", _camera_lines(camera, paths, black))
    ending = ".tif" if chance.random() < 0.4 else ".npy"
    for effect in dealt.effects:
        effect.make_ready()
    lines = ["[sensor]", f'name = "cam-{camera.columns}x{camera.rows}"', *_sensor(camera, black)]
    starred = chance.random() < 0.5
    for exposure, codes in simulate(camera, dealt.effects, chance):
        files = [f"{exposure.name}/{frame}{ending}" for frame in range(len(codes))]
        (folder / "rec" / exposure.name).mkdir()
        for file, frame in zip(files, codes, strict=True):
            _save(folder / "rec" / file, frame)
        lines += ["", "[[exposure]]", f'name = "{exposure.name}"', f'kind = "{exposure.kind}"']
        lines.append(f"exposure_time_s = {exposure.time_s:.9g}")
        if exposure.light is not None and camera.light_known:
            lines.append(f"light = {exposure.light:.9g}")
        said = f'"{exposure.name}/*{ending}"' if starred else json.dumps(files)
        lines.append(f"frames = {said}")
    _text(folder / "rec" / "recording.toml", lines)
    return wrong


def _believed(
    camera: Camera, paths: list[ReadOutPath], names: list[str], chance: np.random.Generator
) -> tuple[list[ReadOutPath], float, dict[str, float]]:
    """Return read-out paths and black level as camera.toml has them, and what is wrong there."""
    black, wrong = camera.black, {}
    for name in names:
        sign = chance.choice([-1, 1])
        if name == "black":
            noise = paths[0].intercept ** 0.5
            black += float(sign) * max(0.3, chance.uniform(0.2, 0.6) * noise)
            wrong["black_level"] = black - camera.black
        elif name == "slope":
            factor = float(1 + sign * chance.uniform(0.04, 0.2))
            paths = [ReadOutPath(path.slope * factor, path.intercept) for path in paths]
            wrong["noise.slope"] = factor
        else:
            factor = float(1 + sign * chance.uniform(0.1, 0.35))
            paths = [ReadOutPath(path.slope, path.intercept * factor) for path in paths]
            wrong["noise.intercept"] = factor
    return paths, black, wrong


def _sensor(camera: Camera, black: float) -> list[str]:
    return [
        f'cfa = "{camera.cfa}"',
        f"black_level = {black:.4f}",
        f"white_level = {camera.white}",
        f"bit_depth = {camera.bits}",
    ]


def _camera_lines(camera: Camera, paths: list[ReadOutPath], black: float) -> list[str]:
    lines = ['schema = "dsis-camera/1"', 'name = "lab camera"', *_sensor(camera, black), ""]
    lines += ["[noise]", f'shot = "{camera.shot}"']
    for number, path in enumerate(paths, 1):
        lines.append("[[noise.segment]]")
        if number < len(paths):
            lines.append(f"upper_dn = {camera.switch_dn:.3f}")
        lines += [f"slope = {path.slope:.8g}", f"intercept = {path.intercept:.8g}"]
    return lines


def _save(path: Path, frame: np.ndarray[Any, Any]) -> None:
    if path.suffix == ".tif":
        Image.fromarray(frame).save(path)
    else:
        np.save(path, frame)


def _text(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
