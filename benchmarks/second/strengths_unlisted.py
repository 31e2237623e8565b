"""How each effect on no list is drawn, and what size to begin with."""

import numpy as np

from second.geometry import pick
from second.patterns import hot_map
from second.room import Draw, Drawn, Room, sets


def _column_gain_drift(room: Room, _g: np.random.Generator) -> Drawn:
    first = room.top_noise / room.top / np.sqrt(room.case["h"])
    return Drawn({}, sets("slope"), first, 0.1, 2)


def _half_frames(room: Room, _g: np.random.Generator) -> Drawn:
    return Drawn({}, sets("step_dn", room.frame_noise), 2, 300)


def _cluster_defect(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "cy": float(g.uniform(0.15, 0.85)),
        "cx": float(g.uniform(0.15, 0.85)),
        "radius": float(g.uniform(2, 7)),
    }
    return Drawn(effect, sets("loss"), 0.02, 0.9)


def _dust_shadows(_room: Room, g: np.random.Generator) -> Drawn:
    specks = [
        [
            float(g.random()),
            float(g.random()),
            float(g.uniform(2, 12)),
            float(g.uniform(0.3, 1)),
        ]
        for _ in range(int(g.integers(3, 10)))
    ]
    return Drawn({"specks": specks}, sets("depth"), 0.005, 0.3)


def _display_moire(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "fx": float(g.uniform(0.01, 0.2)),
        "fy": float(g.uniform(-0.2, 0.2)),
        "phase": float(g.uniform(0, 6.28)),
        "bend": float(g.uniform(0, 2)),
    }
    return Drawn(effect, sets("depth"), 0.0005, 0.2)


def _temperature_ramp(room: Room, _g: np.random.Generator) -> Drawn:
    scale = room.frame_noise / room.longest
    return Drawn({}, sets("swing_dn_per_s", scale), 6, 3000)


def _blooming_trail(room: Room, g: np.random.Generator) -> Drawn:
    h, w = room.case["h"], room.case["w"]
    rates = hot_map(room.case, room.case["known_hot"])
    hottest = np.argsort(rates.ravel())[::-1][: int(g.integers(4, 12))]
    spots = [
        [
            float((i // w + 0.5) / h),
            float((i % w + 0.5) / w),
            float(rates.ravel()[i] / rates.max()),
        ]
        for i in hottest
    ]
    effect = {"spots": spots, "length": float(g.uniform(5, 40))}
    return Drawn(effect, sets("dn_per_s", room.heat), 0.3, 100)


def _vibration(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"cycles": float(g.uniform(1.5, 9))}
    return Drawn(effect, sets("amplitude_px"), 0.005, 0.7, 2)


def _companding(room: Room, g: np.random.Generator) -> Drawn:
    step = float(g.uniform(0.5, 1.1)) * room.top_noise  # of the root's code near the top, in DN
    origin = float(room.case["black"] * 0.9)
    scale = float(2 * np.sqrt(room.top + origin) / step) / 2
    return Drawn({"origin": origin, "scale": scale})


def _horizontal_smear(room: Room, _g: np.random.Generator) -> Drawn:
    brightest = max(e["level"] for e in room.case["exposures"] if e["kind"] == "scene")
    return Drawn({"threshold": float(0.55 * brightest)}, sets("fraction"), 0.003, 0.2)


def _speckle_light(room: Room, _g: np.random.Generator) -> Drawn:
    return Drawn({}, sets("contrast"), 0.2 * room.mid_noise / room.mid, 0.1, 2)


def _block_offsets(room: Room, g: np.random.Generator) -> Drawn:
    return Drawn({"block": pick(g, [4, 8, 16])}, sets("sigma", room.read_noise), 0.08, 2, 2)


def _column_telegraph(room: Room, g: np.random.Generator) -> Drawn:
    columns = [float(a) for a in g.random(int(g.integers(2, 8)))]
    return Drawn({"columns": columns}, sets("step_dn", room.read_noise), 0.2, 20, 2)


def _line_start(room: Room, g: np.random.Generator) -> Drawn:
    effect = {"length": float(g.uniform(0.02, 0.2))}
    return Drawn(effect, sets("amplitude", room.read_noise), 0.05, 10)


DRAWS: dict[str, Draw] = {
    "column_gain_drift": _column_gain_drift,
    "read_noise_vignetting": lambda _room, _g: Drawn({}, sets("rise"), 0.1, 1.0),
    "half_frame_alternation": _half_frames,
    "cluster_defect": _cluster_defect,
    "dust_shadows": _dust_shadows,
    "display_moire": _display_moire,
    "double_frames": lambda _room, _g: Drawn({}, sets("correlation"), 0.02, 0.9),
    "dark_temperature_ramp": _temperature_ramp,
    "blooming_trail": _blooming_trail,
    "scene_jitter": lambda _room, _g: Drawn({}, sets("rms_px"), 0.003, 0.5, 2),
    "companding": _companding,
    "horizontal_smear": _horizontal_smear,
    "vibration": _vibration,
    "speckle_light": _speckle_light,
    "block_offset_noise": _block_offsets,
    "shutter_gradient": lambda room, _g: Drawn({}, sets("delay_s", room.shortest), 0.005, 0.3),
    "column_telegraph": _column_telegraph,
    "line_start_settling": _line_start,
}
