"""How effects of light, heat and charge are drawn; sizes have the contract's units."""

import numpy as np

from second.geometry import Effect, log_uniform, pick
from second.room import Draw, Drawn, Room, sets, signed


def _prnu(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"shape": pick(g, ["gauss", "exptail"], [0.7, 0.3])}
    return Drawn(effect, sets("sigma_percent"), 0.2, 4, 2)


def _shading(_room: Room, g: np.random.Generator) -> Drawn:
    law = pick(g, ["r2", "cos4", "r3"])
    central = g.random() < 0.5
    centre = [0.5, 0.5] if central else [float(a) for a in g.uniform(0.35, 0.65, 2)]
    return Drawn({"law": law, "centre": centre}, sets("falloff_percent"), 0.3, 30)


def _hot_pixels(room: Room, g: np.random.Generator) -> Drawn:
    share = log_uniform(g, 15, 200) / room.pixels
    effect = {"pixel_fraction": share, "law": pick(g, ["exp", "lognormal"])}
    return Drawn(effect, sets("mean_dn_per_s", room.heat), 3, 60)


def _amp_glow(room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "side": pick(g, ["left", "right", "top", "bottom", "tl", "tr", "bl", "br"]),
        "law": pick(g, ["exp", "1/r"]),
        "length": float(g.uniform(0.06, 0.3)),
    }
    return Drawn(effect, sets("dn_per_s", room.heat), 0.2, 50)


def _saturation(room: Room, g: np.random.Generator) -> Drawn:
    effect = {"law": pick(g, ["hard", "soft"]), "soft": float(g.uniform(0.008, 0.03))}
    brightest = room.top * max(room.case["response"].values())
    if g.random() < 0.3:  # the top of the ladder simply is full
        effect["full_well_dn"] = float(brightest * g.uniform(0.8, 0.97))
        return Drawn(effect)
    width, most = room.top_noise, 0.985 * room.full
    if effect["law"] == "soft":
        width = max(width, effect["soft"] * brightest)

    def setter(effect: Effect, size: float) -> None:
        effect["full_well_dn"] = float(min(brightest + width * (3.5 - size), most))

    return Drawn(effect, setter, 1.2, 6, 4)


def _flicker(room: Room, g: np.random.Generator) -> Drawn:
    effect = {"law": pick(g, ["white", "white", "ar1"]), "ar": float(g.uniform(0.1, 0.6))}
    return Drawn(effect, sets("sigma_percent", room.frame_percent), 2, 300, 2)


def _line_flicker(room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "cycles_per_frame": log_uniform(g, 0.7, 14),
        "phase_law": pick(g, ["free", "beat"]),
        "beat": float(g.uniform(0.1, 0.45)),
    }
    return Drawn(effect, sets("depth_percent", room.frame_percent), 3, 300, 2)


def _crosstalk(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"mode": pick(g, ["both", "both", "rows", "columns"])}
    return Drawn(effect, sets("fraction"), 0.004, 0.06)


def _brighter_fatter(room: Room, g: np.random.Generator) -> Drawn:
    ratio = log_uniform(g, 0.6, 1.7) if g.random() < 0.5 else 1.0
    return Drawn({"ratio": ratio}, sets("per_dn", 1 / room.top), 0.005, 0.08)


def _image_lag(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"start": pick(g, ["steady", "steady", "dark"])}
    return Drawn(effect, sets("fraction"), 0.01, 0.12)


def _channel_imbalance(_room: Room, g: np.random.Generator) -> Drawn:
    return Drawn({}, signed("gain_percent", g), 0.05, 5)


def _impulse(room: Room, g: np.random.Generator) -> Drawn:
    megapixels = sum(e["n"] for e in room.case["exposures"]) * room.pixels / 1e6
    effect = {
        "per_megapixel_frame": log_uniform(g, 10, 70) / megapixels,
        "floor_dn": float(7 * room.top_noise),
        "mean_dn": float(room.top_noise * log_uniform(g, 8, 60)),
        "tracks": bool(g.random() < 0.2),
    }
    return Drawn(effect)


DRAWS: dict[str, Draw] = {
    "poisson_shot_noise": lambda _room, _g: Drawn({}),
    "prnu": _prnu,
    "shading": _shading,
    "dark_current": lambda room, _g: Drawn({}, sets("dn_per_s", room.heat), 0.03, 20),
    "hot_pixels": _hot_pixels,
    "amp_glow": _amp_glow,
    "saturation": _saturation,
    "flicker": _flicker,
    "line_flicker": _line_flicker,
    "crosstalk": _crosstalk,
    "brighter_fatter": _brighter_fatter,
    "image_lag": _image_lag,
    "channel_imbalance": _channel_imbalance,
    "impulse": _impulse,
}
