"""How effects of read-out and converter are drawn; sizes have the contract's units."""

import numpy as np

from second.geometry import Effect, log_uniform, pick
from second.room import Draw, Drawn, Room, sets, signed


def _dual_gain(room: Room, g: np.random.Generator) -> Drawn:
    base, switch = room.case["segments"][0], room.case["gap"]
    how = pick(g, ["read", "both"])
    variance = base["slope"] * switch + base["intercept"]
    share = g.uniform(0.3, 0.9) * (how == "both")  # of the step that the slope has

    def setter(effect: Effect, size: float) -> None:
        effect["slope2"] = base["slope"] * (1 + size * share)
        intercept = (1 + size) * variance - effect["slope2"] * switch
        effect["intercept2"] = max(intercept, 0.2 * base["intercept"])

    return Drawn({"switch_dn": switch, "how": how}, setter, 0.05, 3.0)


def _dual_gain_mismatch(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"law": pick(g, ["step", "kink"])}
    return Drawn(effect, signed("gain_error_percent", g), 0.05, 8)


def _heavy_tails(_room: Room, _g: np.random.Generator) -> Drawn:
    def setter(effect: Effect, size: float) -> None:
        effect["tail_df"] = 4 + 6 / size

    return Drawn({}, setter, 0.1, 4.0)


def _rts(room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "pixel_fraction": log_uniform(g, 40, 400) / room.pixels,
        "signs": bool(g.random() < 0.3),
    }
    return Drawn(effect, sets("amplitude_dn", room.read_noise), 4, 15, 2)


def _line_noise(room: Room, _g: np.random.Generator) -> Drawn:
    return Drawn({}, sets("sigma_dn", room.read_noise), 0.05, 2, 2)


def _line_fpn(room: Room, g: np.random.Generator) -> Drawn:
    effect = {"shape": pick(g, ["gauss", "laplace"], [0.7, 0.3])}
    return Drawn(effect, sets("sigma_dn", room.read_noise), 0.03, 3, 2)


def _dsnu(room: Room, g: np.random.Generator) -> Drawn:
    effect = {"shape": pick(g, ["gauss", "exptail"])}
    return Drawn(effect, sets("sigma_dn", room.read_noise), 0.08, 3, 2)


def _nonlinearity(_room: Room, g: np.random.Generator) -> Drawn:
    law, sign = pick(g, ["quadratic", "cubic", "gamma", "knee"]), pick(g, [-1, 1])
    effect = {"law": law, "sign": 1 if law == "knee" else sign}
    return Drawn(effect, sets("percent_full_scale"), 0.02, 3)


def _quantisation(room: Room, g: np.random.Generator) -> Drawn:
    steps = [k for k in (2, 3, 4, 5, 6, 8) if k == 2 or k / room.read_noise < 5]
    step = int(pick(g, steps))
    return Drawn({"step_dn": step, "phase": int(g.integers(step))})


def _adc_dnl(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"law": pick(g, ["random", "sar", "interleaved"]), "bits": int(g.integers(1, 6))}
    return Drawn(effect, sets("rms_lsb"), 0.03, 0.8, 2)


def _black_level_drift(room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "law": pick(g, ["white", "ar1", "ar1", "sawtooth"]),
        "ar": float(g.uniform(0.2, 0.8)),
        "period": int(g.integers(5, 13)),
    }
    return Drawn(effect, sets("sigma_dn", room.frame_noise), 2, 200, 2)


def _spatial_filtering(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"mode": pick(g, ["plus4", "box8", "horizontal"])}
    return Drawn(effect, sets("fraction"), 0.015, 0.5)


def _pink_noise(room: Room, g: np.random.Generator) -> Drawn:
    effect = {
        "exponent": float(g.uniform(0.9, 1.1)),
        "blank": int(g.integers(0, 40)),
        "order": "columns" if g.random() < 0.15 else "rows",
    }
    return Drawn(effect, sets("sigma_dn", room.read_noise), 0.1, 2, 2)


def _periodic_noise(room: Room, g: np.random.Generator) -> Drawn:
    frequency = [float(g.uniform(-0.5, 0.5)), float(g.uniform(0.02, 0.5))]
    if g.random() < 0.25:
        frequency[int(g.integers(2))] = 0.0
        if abs(sum(frequency)) < 0.05:
            frequency = [float(g.uniform(0.08, 0.45)), 0.0]
    effect = {
        "frequency": frequency,
        "phase_law": pick(g, ["free", "free", "beat"]),
        "beat": float(g.uniform(0.1, 0.45)),
    }
    return Drawn(effect, sets("amplitude_dn", room.frame_noise), 4, 1000, 2)


def _bistable_pattern(room: Room, g: np.random.Generator) -> Drawn:
    waves = ((0.5, 0.5), (0.5, 0.0), (0.0, 0.5), (0.25, 0.0), (0.0, 0.25), (0.25, 0.25))
    frequency = list(pick(g, [*waves, (0.125, 0.5)]))
    wave = pick(g, ["square", "sine"])
    phase = 0.0 if set(frequency) <= {0.0, 0.5} else 0.3
    effect = {"frequency": frequency, "wave": wave, "phase": phase}
    return Drawn(effect, sets("amplitude_dn", room.frame_noise), 3, 1000, 2)


def _readout_memory(_room: Room, g: np.random.Generator) -> Drawn:
    effect = {"lag_pixels": int(g.integers(1, 5)), "axis": pick(g, ["row", "row", "column"])}
    return Drawn(effect, signed("fraction", g), 0.01, 0.15)


def _tap_mismatch(room: Room, g: np.random.Generator) -> Drawn:
    mono = room.case["cfa"] == "MONO"
    layout = pick(g, ["left_right", "top_bottom", *(["columns", "rows"] if mono else [])])
    seam = 0.5 if g.random() < 0.7 else float(g.uniform(0.3, 0.7))
    return Drawn({"layout": layout, "seam": seam}, signed("gain_percent", g), 0.05, 6)


DRAWS: dict[str, Draw] = {
    "dual_gain": _dual_gain,
    "dual_gain_mismatch": _dual_gain_mismatch,
    "heavy_tailed_read_noise": _heavy_tails,
    "read_noise_spread": lambda _room, _g: Drawn({}, sets("log_sigma"), 0.1, 0.7, 2),
    "rts": _rts,
    "row_noise": _line_noise,
    "column_noise": _line_noise,
    "row_fpn": _line_fpn,
    "column_fpn": _line_fpn,
    "dsnu": _dsnu,
    "nonlinearity": _nonlinearity,
    "quantisation": _quantisation,
    "adc_dnl": _adc_dnl,
    "black_level_drift": _black_level_drift,
    "spatial_filtering": _spatial_filtering,
    "pink_noise": _pink_noise,
    "periodic_noise": _periodic_noise,
    "bistable_pattern": _bistable_pattern,
    "readout_memory": _readout_memory,
    "tap_mismatch": _tap_mismatch,
}
