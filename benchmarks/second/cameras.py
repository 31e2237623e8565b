"""A camera and the plan of its recording, drawn until it can show what is hidden in it."""

from collections.abc import Collection

import numpy as np

from second.exposures import plan, scene
from second.geometry import Array, Case, coords, log_uniform, pick, planes

ATTEMPTS = 400
PIXELS = 3.6e6  # most pixels of all frames together
LADDER = 6  # flats that a second segment needs
SKEW_Z = (15, 65)  # what Poisson's skew should stand at


def draw_case(seed: int, number: int, hidden: Collection[str]) -> Case:
    """Return a camera with its planned exposures, in which all that is hidden can be seen."""
    best: tuple[float, Case] | None = None
    for attempt in range(ATTEMPTS):
        g = np.random.default_rng([seed, 2, number, attempt])
        case = _tried(g, set(hidden))
        if case is None:
            continue
        case["seed"] = int(g.integers(2**31))
        if "poisson_shot_noise" not in hidden:
            return case
        z = _skew_z(case)
        if SKEW_Z[0] <= z <= SKEW_Z[1]:
            return case
        far = abs(np.log(z / 20))
        if best is None or far < best[0]:
            best = (far, case)
    if best is None:
        raise LookupError(*sorted(hidden))
    return best[1]


def _skew_z(case: Case) -> float:
    """Return the z at which Poisson's skew will stand, over all planes and exposures."""
    total = 0.0
    for e in case["exposures"]:
        for name in planes(case):
            shade = 0.3 if e["kind"] == "scene" else 1
            x = max(e.get("level", 0) * case["response"][name], 0) * shade
            s = case["segments"][0]
            pixels = e["n"] * case["h"] * case["w"] / len(planes(case))
            variance = s["slope"] * x + s["intercept"]
            total += pixels / 6 * (s["slope"] ** 2 * x) ** 2 / variance**3
    return float(np.sqrt(total))


def _tried(g: np.random.Generator, hidden: set[str]) -> Case | None:
    case = _sensor(g, hidden)
    if case is None:
        return None
    flats, darks, scenes = plan(g, case, hidden)
    case["scene"] = scene(g, spots="horizontal_smear" in hidden)
    order = pick(g, ["dark first", "dark last", "mixed"])
    case["exposures"] = {
        "dark first": darks + flats + scenes,
        "dark last": flats + scenes + darks,
        "mixed": darks[:1] + flats + darks[1:] + scenes,
    }[order]
    if sum(e["n"] for e in case["exposures"]) * case["h"] * case["w"] > PIXELS:
        return None
    _stretch(case)
    return case if _law(g, case, flats, hidden) else None


def _sensor(g: np.random.Generator, hidden: set[str]) -> Case | None:
    """Draw size, colours, converter, black level and gains; None where they do not go together."""
    case: Case = {}
    bayer = g.random() < 0.55 or "channel_imbalance" in hidden
    case["cfa"] = pick(g, ["RGGB", "BGGR", "GRBG", "GBRG"]) if bayer else "MONO"
    case["h"], case["w"] = int(g.integers(80, 201)), int(g.integers(100, 261))
    if bayer:
        case["h"] -= case["h"] % 2
        case["w"] -= case["w"] % 2
    case["bits"] = pick(g, [10, 12, 14, 16], [0.42, 0.3, 0.16, 0.12])
    codes = 2 ** case["bits"]
    electrons = log_uniform(g, 0.1, 10)
    if not 2000 <= electrons * codes <= 80000:
        return None
    below = g.random() >= 0.75
    case["white"] = int(codes - 1 - g.integers(1, max(2, codes // 60))) if below else codes - 1
    read_noise_e = log_uniform(g, 1, 15)
    noise = read_noise_e / electrons
    if noise < (0.6 if g.random() < 0.92 else 0.42) or noise > codes / 60:
        return None
    low, high = max(16, 7 * noise), min(2048, codes / 8)
    if low >= high:
        return None
    case["black"] = log_uniform(g, low, high)
    case["electrons_per_dn"], case["read_noise_e"] = electrons, read_noise_e
    poisson = g.random() < 0.22 and "poisson_shot_noise" not in hidden
    case["shot"] = "poisson" if poisson else "gaussian"
    case["response"] = {"M": 1.0}
    if bayer:
        r, b = g.uniform(0.4, 0.95), g.uniform(0.35, 0.9)
        case["response"] = {"R": r, "Gr": 1.0, "Gb": 1.0, "B": b}
        if g.random() < 0.2:  # tungsten: red leads
            case["response"] = {"R": 1.0, "Gr": 0.8, "Gb": 0.8, "B": 0.8 * b}
    return case


def _stretch(case: Case) -> None:
    """Set the range over which the scene is spread."""
    yy, xx = coords(case)
    s, h, w = case["scene"], case["h"], case["w"]
    raw: Array = s["g0"] + s["gx"] * xx / w + s["gy"] * yy / h
    for a, angle, centre, soft in s["edges"]:
        d = (xx - centre[0] * w) * np.cos(angle) + (yy - centre[1] * h) * np.sin(angle)
        raw = raw + a / (1 + np.exp(-np.clip(d / soft, -40, 40)))
    s["lo"], s["hi"] = float(raw.min() - 0.35), float(raw.max() + 0.35)


def _law(g: np.random.Generator, case: Case, flats: list[dict], hidden: set[str]) -> bool:
    """Draw the law of noise; say whether the levels leave a gap where one is needed."""
    slope, noise = 1 / case["electrons_per_dn"], case["read_noise_e"] / case["electrons_per_dn"]
    first = {"slope": slope, "intercept": noise * noise}
    case["segments"] = [first]
    shares = set(case["response"].values())
    x = np.sort(np.unique([round(e["level"] * r, 9) for e in flats for r in shares]))
    one = {"dual_gain", "poisson_shot_noise"} & hidden
    two = "dual_gain_mismatch" in hidden or (g.random() < 0.22 and not one and len(flats) >= LADDER)
    gaps = [
        k
        for k in range(len(x) - 1)
        if 0.25 * len(x) <= k + 1 <= 0.75 * len(x) and x[k + 1] - x[k] > 0.03 * x[k]
    ]
    if (two or "dual_gain" in hidden) and not gaps:
        return False
    if gaps:
        k = pick(g, gaps)
        case["gap"] = float(x[k] + (x[k + 1] - x[k]) * g.uniform(0.3, 0.7))
    return _second_segment(g, case, first) if two else True


def _second_segment(g: np.random.Generator, case: Case, first: dict[str, float]) -> bool:
    slope, intercept, switch = first["slope"], first["intercept"], case["gap"]
    step = log_uniform(g, 0.04, 0.8)
    variance = slope * switch + intercept
    if g.random() < 0.5:
        slope2, intercept2 = slope, intercept + step * variance
    else:
        slope2 = slope * (1 + step * g.uniform(0.2, 0.7))
        intercept2 = (1 + step) * variance - slope2 * switch
    if intercept2 <= 0:
        return False
    case["segments"] = [
        {"upper_dn": switch, "slope": slope, "intercept": intercept},
        {"slope": float(slope2), "intercept": float(intercept2)},
    ]
    return True
