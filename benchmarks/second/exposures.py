"""The plan of a recording: flats of several levels in DN, darks, a scene; times in seconds."""

from typing import Any

import numpy as np

from second.geometry import Array, Case, log_uniform, pick
from second.vocabulary import LEVELS, LIGHT, SCENE, THERMAL

Exposure = dict[str, Any]


def plan(
    g: np.random.Generator, case: Case, hidden: set[str]
) -> tuple[list[Exposure], list[Exposure], list[Exposure]]:
    """Return flats, darks and scenes; set how levels were made and what of light is told."""
    full = case["white"] - case["black"]
    n = int(g.integers(6 if hidden & LEVELS else 4, 11))
    levels = _levels(g, case, n, full)
    mode = pick(g, ["light", "time"], [0.55, 0.45])
    if "shutter_gradient" in hidden:
        mode = "time"
    case["level_by"] = mode
    unit = log_uniform(g, 0.01, 1000)  # DN per unit of light
    told = g.random() < 0.6
    case["light_given"] = bool(told) or (mode == "light" and bool(hidden & LIGHT))
    longest = log_uniform(g, 0.004, 4.0)
    t = np.full(n, longest) if mode == "light" else longest * levels / levels.max()
    t = np.array([float(f"{a:.7g}") for a in t])
    if mode == "time":
        levels = t * (levels.max() / longest)
    flats, usual = [], int(g.integers(4, 15))
    for k in range(n):
        varies = g.random() < 0.6
        frames = int(np.clip(usual + g.integers(-3, 4), 4, 16)) if varies else usual
        level, seconds = float(levels[k]), float(t[k])
        light = float(levels[k] / unit)
        flats.append({"kind": "flat", "level": level, "time": seconds, "n": frames, "light": light})
    darks = _darks(g, t, mode, several=bool(hidden & THERMAL))
    scenes: list[Exposure] = []
    if hidden & SCENE or g.random() < 0.22:
        level = float(g.uniform(0.35, 0.8) * full)
        seconds = float(pick(g, list(t)))
        frames = int(g.integers(5, 13))
        scenes = [{"kind": "scene", "level": level, "time": seconds, "n": frames}]
    return flats, darks, scenes


def _levels(g: np.random.Generator, case: Case, n: int, full: float) -> Array:
    top, low = g.uniform(0.6, 0.85) * full, log_uniform(g, 0.008, 0.08) * full
    spacing = pick(g, ["lin", "geo", "jitter", "sqrt"])
    case["spacing"] = spacing
    u = np.linspace(0, 1, n)
    drawn = np.sort(np.r_[low, g.uniform(low * 1.3, top * 0.95, n - 2), top])
    levels: dict[str, Array] = {
        "lin": low + (top - low) * u,
        "geo": low * (top / low) ** u,
        "sqrt": (np.sqrt(low) + (np.sqrt(top) - np.sqrt(low)) * u) ** 2,
        "jitter": drawn,
    }
    return levels[spacing]


def _darks(g: np.random.Generator, t: Array, mode: str, *, several: bool) -> list[Exposure]:
    count, n = pick(g, [1, 2, 3], [0.45, 0.3, 0.25]), len(t)
    if several:
        count = max(count, 2)
    if mode == "time":
        places = {1: [n // 2], 2: [0, n - 1], 3: [0, n // 2, n - 1]}[count]
        times = [float(t[k]) for k in places]
        if count > 1 and g.random() < 0.3:
            times[-1] = float(f"{times[-1] * g.uniform(1.5, 6):.6g}")
    else:
        factors = np.cumprod(g.uniform(3, 9, count - 1))
        times = [float(t[0])] + [float(f"{t[0] * f:.6g}") for f in factors]
    return [{"kind": "dark", "time": a, "n": int(g.integers(6, 25))} for a in times]


def scene(g: np.random.Generator, *, spots: bool) -> dict[str, Any]:
    """Return a texture: gradients, soft edges, waves and, at times, spots of light."""
    made: dict[str, Any] = {"g0": 0, "gx": float(g.normal()), "gy": float(g.normal())}
    made["edges"] = [
        (
            float(g.normal()),
            float(g.uniform(0, 6.28)),
            [float(a) for a in g.uniform(0.15, 0.85, 2)],
            float(g.uniform(0.5, 3)),
        )
        for _ in range(int(g.integers(2, 7)))
    ]
    made["waves"] = [
        (
            float(g.uniform(0.05, 0.35)),
            float(g.uniform(-0.2, 0.2)),
            float(g.uniform(-0.2, 0.2)),
            float(g.uniform(0, 6.28)),
        )
        for _ in range(int(g.integers(2, 6)))
    ]
    made["spots"] = []
    if spots or g.random() < 0.4:
        made["spots"] = [
            (float(g.random()), float(g.random()), float(g.uniform(2, 8)))
            for _ in range(int(g.integers(2, 6)))
        ]
    return {**made, "lo": -2.0, "hi": 3.0}
