"""Places, colours, scenes and the named streams of chance."""

import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

Case = dict[str, Any]
Effect = dict[str, Any]
Array = NDArray[Any]
Plane = tuple[slice, slice]


def stream(case: Case, *labels: object) -> np.random.Generator:
    """Return the generator of this name: no draw of one name moves another's."""
    names = [zlib.crc32(str(label).encode()) for label in labels]
    return np.random.default_rng([case["seed"], *names])


def log_uniform(g: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(g.uniform(np.log(low), np.log(high))))


def pick(g: np.random.Generator, choices: Any, chances: list[float] | None = None) -> Any:
    return choices[int(g.choice(len(choices), p=chances))]


def coords(case: Case) -> tuple[Array, Array]:
    """Return row and column of every pixel."""
    h, w = case["h"], case["w"]
    return np.arange(h)[:, None] + np.zeros((1, w)), np.arange(w)[None, :] + np.zeros((h, 1))


def planes(case: Case) -> dict[str, Plane]:
    """Return the sites of each colour of the mosaic, both greens apart."""
    if case["cfa"] == "MONO":
        return {"M": (slice(None), slice(None))}
    out = {}
    for k, colour in enumerate(case["cfa"]):
        y, x = divmod(k, 2)
        name = colour
        if colour == "G":
            name = "Gr" if "R" in case["cfa"][2 * y : 2 * y + 2] else "Gb"
        out[name] = (slice(y, None, 2), slice(x, None, 2))
    return out


def response(case: Case) -> Array:
    """Return each pixel's share of the light, by colour."""
    r = np.ones((case["h"], case["w"]))
    for name, plane in planes(case).items():
        r[plane] = case["response"][name]
    return r


def scene_at(case: Case, y: Array, x: Array) -> Array:
    """Return the scene's texture at continuous positions, 0 to 1 of its peak."""
    p = case["scene"]
    h, w = case["h"], case["w"]
    u, v = x / w, y / h
    s = p["g0"] + p["gx"] * u + p["gy"] * v
    for a, angle, centre, soft in p["edges"]:
        d = (x - centre[0] * w) * np.cos(angle) + (y - centre[1] * h) * np.sin(angle)
        s = s + a / (1 + np.exp(-np.clip(d / soft, -40, 40)))
    for a, fx, fy, phase in p["waves"]:
        s = s + a * np.sin(2 * np.pi * (fx * x + fy * y) + phase)
    s = np.clip((s - p["lo"]) / (p["hi"] - p["lo"]), 0.02, 0.9)
    for cx, cy, r in p["spots"]:
        s = np.maximum(s, np.exp(-((((x - cx * w) ** 2 + (y - cy * h) ** 2) / r**2) ** 2)))
    return s


def radial(case: Case, cy: float = 0.5, cx: float = 0.5) -> Array:
    """Return the squared distance from a centre, 1 in the farthest corner."""
    y, x = coords(case)
    h, w = case["h"], case["w"]
    r2 = (y - cy * (h - 1)) ** 2 + (x - cx * (w - 1)) ** 2
    return r2 / r2.max()


def segment_of(segments: list[dict[str, float]], x: Array) -> tuple[Array, Array]:
    """Return slope in DN and intercept in DN^2 of the read-out segment that a signal selects."""
    slope = np.full(np.shape(x), segments[-1]["slope"])
    intercept = np.full(np.shape(x), segments[-1]["intercept"])
    for s in reversed(segments[:-1]):
        low = x < s["upper_dn"]
        slope = np.where(low, s["slope"], slope)
        intercept = np.where(low, s["intercept"], intercept)
    return slope, intercept
