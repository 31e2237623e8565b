"""How an effect is drawn: its free parameters, and one strength that scales it.

`Recipe.parameters(case, drawn, x)` gives the planting at strength x; x = 1 is plainly there in a
small recording, x = 0 nothing. Strengths stay within what a camera could do (`most`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from planter.case import Case

Drawn = Mapping[str, Any]
Draw = Callable[[np.random.Generator, Case], dict[str, Any]]
Scale = Callable[[Case, Drawn, float], dict[str, Any]]


@dataclass(frozen=True)
class Recipe:
    """How one kind is planted.

    Attributes
    ----------
    draw
        The parameters that are not strength.
    scale
        The parameters that are.
    power
        The statistic grows as this power of the strength.
    most
        Largest strength.
    fits
        Cameras it can be planted into.
    """

    draw: Draw
    scale: Scale
    power: int = 2
    most: float = 20.0
    fits: Callable[[Case], bool] = lambda _: True

    def parameters(self, case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
        """Return all parameters at strength x."""
        kept = {k: v for k, v in drawn.items() if not k.startswith("_")}
        return {**kept, **self.scale(case, drawn, x)}


def read_dn(case: Case) -> float:
    """Return the read noise with the converter's rounding, DN."""
    return float(np.sqrt(case.segments[0].intercept + 1 / 12))


def top_dn(case: Case) -> float:
    """Return the brightest planned signal."""
    return max(plan.signal_dn for plan in case.exposures)


def longest_s(case: Case) -> float:
    """Return the longest exposure time."""
    return max(plan.exposure_time_s for plan in case.exposures)


def _none(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del rng, case
    return {}


def _one_of(name: str, *values: Any) -> Draw:
    return lambda rng, _: {name: values[int(rng.integers(len(values)))]}


def _nothing(case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
    del case, drawn, x
    return {}


def _reads(name: str, share: float) -> Scale:
    """Return a strength in units of the read noise."""
    return lambda case, _, x: {name: share * read_dn(case) * x}


def _sigma(share: float) -> Scale:
    return _reads("sigma_dn", share)


def _rate(name: str, share: float) -> Scale:
    """Return a strength in units of the read noise in the longest exposure."""
    return lambda case, _, x: {name: share * read_dn(case) / longest_s(case) * x}


def _per_top(name: str, share: float) -> Scale:
    """Return a strength in units of the brightest signal's inverse."""
    return lambda case, _, x: {name: share / top_dn(case) * x}


def _plain(name: str, unit: float) -> Scale:
    return lambda _, __, x: {name: unit * x}


def _signed(name: str, unit: float) -> Scale:
    return lambda _, drawn, x: {name: unit * x * drawn["_sign"]}


def _sign(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    return {"_sign": int(rng.choice([-1, 1]))}


def _switch(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw a switch in a gap of the flats' green levels, two or more levels on each side."""
    signals = sorted(p.signal_dn for p in case.exposures if p.kind == "flat")
    gap = int(rng.integers(1, len(signals) - 2))
    return {
        "switch_dn": float(np.sqrt(signals[gap] * signals[gap + 1])),
        "_read": rng.uniform(0, 8),
    }


def _second_path(case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
    base = case.segments[0]
    return {"slope": base.slope * (1 + x), "intercept": base.intercept * (1 + drawn["_read"] * x)}


def _line_flicker(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    drawn: dict[str, Any] = {"cycles_per_frame": round(float(rng.uniform(1.5, 9)), 3)}
    if rng.random() < 0.5:
        drawn["advance_cycles"] = round(float(rng.uniform(0.1, 0.9)), 3)
    return {**drawn, "harmonic": float(rng.choice([0.0, 0.05]))}


def _glow(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    places = ("top_left", "top_right", "bottom_left", "bottom_right", "top", "bottom", "left")
    return {"place": str(rng.choice(places)), "extent": round(float(rng.uniform(0.15, 0.4)), 3)}


def _rts(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    return {
        "pixel_fraction": round(float(np.exp(rng.uniform(np.log(0.003), np.log(0.03)))), 5),
        "duty": round(float(rng.uniform(0.4, 0.6)), 3),
        "switching": round(float(rng.uniform(0.1, 0.4)), 3),
    }


def _hot(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    return {"pixel_fraction": round(float(np.exp(rng.uniform(np.log(0.002), np.log(0.01)))), 5)}


def _memory(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    lags = [2, 3, 4, 8]
    return {
        "lag_pixels": int(rng.choice(lags)),
        "along": str(rng.choice(["rows", "columns"])),
        "_sign": int(rng.choice([-1, 1])),
    }


def _residue(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw a period of which the noise of the brightest level covers a quarter or more."""
    noise = np.sqrt(case.true_segments[-1].slope * top_dn(case))
    periods = [p for p in (16, 32, 64, 128, 256) if p < 4 * noise] or [16]
    period = int(rng.choice(periods))
    return {
        "period_codes": period,
        "at_code": round(float(rng.uniform(0, period)), 2),
        "along": str(rng.choice(["rows", "rows", "columns"])),
        "_sign": int(rng.choice([-1, 1])),
    }


def _frequency(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    del case
    u, w = rng.uniform(0.06, 0.44), rng.uniform(0.06, 0.44)
    return {"frequency": (round(float(u), 4), round(float(w * rng.choice([-1, 1])), 4))}


def _bistable(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw a checkerboard or stripes; on a mosaic of the planes' pixels: period 4."""
    f = 0.5 if case.cfa == "MONO" else 0.25
    choices = [(f, f), (f, 0.0), (0.0, f)]
    return {"frequency": choices[int(rng.integers(3))]}


def _taps(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    # On a mosaic odd and even columns are colours: their gains cannot be told from the light's.
    regions = ["left_right", "top_bottom"]
    if case.cfa == "MONO":
        regions += ["even_odd_columns", "even_odd_rows"]
    return {"regions": str(rng.choice(regions)), **_sign(rng, case)}


def _settling(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw an edge, a length, and whether it is the gain or the offset that is late."""
    edge = str(rng.choice(["left", "right", "top", "bottom"]))
    length = round(float(rng.uniform(2, 10)), 2)
    return {
        "edge": edge,
        "length_pixels": length,
        "_gain": bool(rng.random() < 0.5),
        **_sign(rng, case),
    }


def _unsettled(case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
    size = x * drawn["_sign"]
    if drawn["_gain"]:
        return {"gain_percent": min(0.2 * size, 90.0), "offset_dn": 0.0}
    return {"gain_percent": 0.0, "offset_dn": 0.1 * read_dn(case) * size}


def _blots(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw how far gains are alike, in pixels of a plane."""
    pitch = 1 if case.cfa == "MONO" else 2
    return {"length_pixels": round(pitch * float(np.exp(rng.uniform(np.log(1.5), np.log(5)))), 2)}


def _bands(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    """Draw over how many rows offsets are alike."""
    del case
    return {"length_rows": round(float(np.exp(rng.uniform(np.log(1.5), np.log(8)))), 2)}


def _well(case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
    """Return a full well that comes nearer to the brightest flat's mean as x grows."""
    del drawn
    top = top_dn(case)
    deviation = np.sqrt(case.true_segments[-1].slope * top)
    return {"full_well_dn": float(top + deviation * (4 - 4 * min(x, 2)))}


def _tail(case: Case, drawn: Drawn, x: float) -> dict[str, Any]:
    """Return the degrees of freedom whose excess kurtosis is x, 6 / (df - 4)."""
    del case, drawn
    return {"tail_df": 4 + 6 / x}


def _impulse(rng: np.random.Generator, case: Case) -> dict[str, Any]:
    noise = np.sqrt(case.true_segments[-1].slope * top_dn(case))
    return {"mean_dn": float(rng.uniform(15, 40) * noise)}


def _is_bayer(case: Case) -> bool:
    return case.cfa != "MONO"


def _one_segment(case: Case) -> bool:
    return len(case.segments) == 1


def _two_segments(case: Case) -> bool:
    return len(case.true_segments) > 1


def _gaussian(case: Case) -> bool:
    return case.shot == "gaussian"


def _noisy(case: Case) -> bool:
    """Tell whether read noise spans several codes."""
    return read_dn(case) > 1


RECIPES: dict[str, Recipe] = {
    "dual_gain": Recipe(_switch, _second_path, power=1, most=3, fits=_one_segment),
    "dual_gain_mismatch": Recipe(
        _sign, _signed("gain_error_percent", 1.0), power=1, most=10, fits=_two_segments
    ),
    "poisson_shot_noise": Recipe(_none, _nothing, power=1, fits=_gaussian),
    "heavy_tailed_read_noise": Recipe(_none, _tail, power=1, most=3, fits=_noisy),
    "read_noise_spread": Recipe(_none, _plain("log_sigma", 0.3), most=4, fits=_noisy),
    "rts": Recipe(_rts, _reads("amplitude_dn", 4)),
    "row_noise": Recipe(_none, _sigma(0.2)),
    "row_banding": Recipe(_bands, _sigma(0.2)),
    "column_noise": Recipe(_none, _sigma(0.2)),
    "row_fpn": Recipe(_none, _sigma(0.1)),
    "column_fpn": Recipe(_none, _sigma(0.1)),
    "dsnu": Recipe(_none, _sigma(0.3)),
    "prnu": Recipe(_none, _plain("sigma_percent", 0.5), most=10),
    "smooth_prnu": Recipe(_blots, _plain("sigma_percent", 0.2), most=20),
    "row_prnu": Recipe(_none, _plain("sigma_percent", 0.1), most=20),
    "column_prnu": Recipe(_none, _plain("sigma_percent", 0.1), most=20),
    "shading": Recipe(
        _one_of("law", "quadratic", "cos4"),
        _plain("falloff_percent", 1.0),
        power=1,
        most=40,
    ),
    "dark_current": Recipe(_none, _rate("dn_per_s", 1), power=1),
    "hot_pixels": Recipe(_hot, _rate("mean_dn_per_s", 6)),
    "amp_glow": Recipe(_glow, _rate("dn_per_s", 1), power=1),
    "nonlinearity": Recipe(_sign, _signed("percent_full_scale", 0.5), power=1, most=10),
    "saturation": Recipe(_none, _well, power=1, most=2),
    "quantisation": Recipe(_one_of("step_dn", 2, 3, 4, 8), _nothing),
    "adc_dnl": Recipe(
        _one_of("law", "edges", "widths"), _plain("rms_lsb", 0.2), most=3, fits=_noisy
    ),
    "black_level_drift": Recipe(_one_of("persistence", 0.0, 0.0, 0.5), _sigma(0.1)),
    "flicker": Recipe(_none, _plain("sigma_percent", 0.3)),
    "line_flicker": Recipe(_line_flicker, _plain("depth_percent", 0.3)),
    "crosstalk": Recipe(
        _one_of("along", "both", "both", "rows", "columns"),
        _plain("fraction", 0.01),
        power=1,
        most=8,
    ),
    "brighter_fatter": Recipe(_none, _per_top("per_dn", 0.01), power=1, most=6),
    "image_lag": Recipe(_none, _plain("fraction", 0.01), power=1, most=20),
    "spatial_filtering": Recipe(_none, _plain("fraction", 0.01), power=1, most=10),
    "pink_noise": Recipe(_none, _sigma(0.3)),
    "periodic_noise": Recipe(_frequency, _reads("amplitude_dn", 0.2)),
    "bistable_pattern": Recipe(_bistable, _reads("amplitude_dn", 0.2)),
    "adc_memory": Recipe(
        _residue,
        lambda case, drawn, x: {"step_dn": 0.1 * read_dn(case) * x * drawn["_sign"]},
        power=1,
        most=30,
        fits=_noisy,
    ),
    "readout_memory": Recipe(_memory, _signed("fraction", 0.02), power=1, most=15),
    "tap_mismatch": Recipe(_taps, _signed("gain_percent", 0.2), power=1, most=50),
    "line_settling": Recipe(_settling, _unsettled, power=1, most=50),
    "channel_imbalance": Recipe(
        _sign, _signed("gain_percent", 0.5), power=1, most=20, fits=_is_bayer
    ),
    "impulse": Recipe(_impulse, _plain("per_megapixel_frame", 100.0), power=1, most=50),
}
