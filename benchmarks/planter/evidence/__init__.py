"""The planter's own statistics: for every effect one that isolates it, in plain numpy.

`evidence(kind, parameters, look)` gives numbers whose sum, weighted as suits the effect, is its
statistic; `counted` kinds have a closed form instead.
"""

from collections.abc import Callable, Mapping
from typing import Any

from planter.evidence import codes, levels, maps, temporal
from planter.evidence.look import Evidence, Look
from planter.light import fall_off, glow
from planter.readout import second_tap, settled
from planter.view import View

Parameters = Mapping[str, Any]


def _view(look: Look) -> View:
    return View(look.case, 0, 0)


def _colour_step(look: Look) -> int:
    return 1 if look.case.cfa == "MONO" else 2


def _memory(look: Look, p: Parameters) -> Evidence:
    lag = p["lag_pixels"]
    return temporal.lags(look, (0, lag) if p.get("along", "rows") == "rows" else (lag, 0))


def _filter(look: Look, p: Parameters) -> Evidence:
    del p
    step = _colour_step(look)
    return temporal.lags(look, (0, step), (step, 0))


_NEIGHBOURS = ((0, 1), (1, 0))

EVIDENCE: dict[str, Callable[[Look, Parameters], Evidence]] = {
    "dual_gain": lambda look, _: levels.variances(look),
    "dual_gain_mismatch": lambda look, _: levels.response(look),
    "poisson_shot_noise": lambda look, _: temporal.moments(look, 3),
    "heavy_tailed_read_noise": lambda look, _: temporal.moments(look, 4),
    "read_noise_spread": lambda look, _: maps.noise_spread(look),
    "rts": lambda look, _: maps.noise_outliers(look),
    "row_noise": lambda look, _: temporal.rows(look),
    "row_banding": lambda look, _: temporal.neighbouring_rows(look),
    "column_noise": lambda look, _: temporal.columns(look),
    "row_fpn": lambda look, _: maps.lines(look, 1),
    "column_fpn": lambda look, _: maps.lines(look, 0),
    "row_prnu": lambda look, _: maps.lines(look, 1, "gain", "offset"),
    "column_prnu": lambda look, _: maps.lines(look, 0, "gain", "offset"),
    "dsnu": lambda look, _: maps.pixels(look, "offset", "gain"),
    "prnu": lambda look, _: maps.pixels(look, "gain", "offset"),
    "smooth_prnu": lambda look, p: maps.blurred(look, p["length_pixels"] / 2, "gain", "offset"),
    "shading": lambda look, p: maps.along(
        look, fall_off(_view(look), p.get("law", "quadratic")), "gain", "offset"
    ),
    "dark_current": lambda look, _: levels.means_against_time(look),
    "hot_pixels": lambda look, _: maps.outliers(look, "time", "offset", "gain"),
    "amp_glow": lambda look, p: maps.along(look, glow(_view(look), p), "time", "offset", "gain"),
    "nonlinearity": lambda look, _: levels.response(look),
    "saturation": lambda look, _: levels.cut(look),
    "adc_dnl": lambda look, _: codes.unevenness(look),
    "black_level_drift": lambda look, _: temporal.frames(look),
    "flicker": lambda look, _: temporal.frames(look),
    "line_flicker": temporal.bands,
    "crosstalk": lambda look, _: temporal.lags(look, *_NEIGHBOURS),
    "brighter_fatter": lambda look, _: temporal.lags(look, *_NEIGHBOURS),
    "image_lag": lambda look, _: temporal.next_frame(look),
    "spatial_filtering": _filter,
    "pink_noise": lambda look, _: temporal.read_out_spectrum(look),
    "periodic_noise": temporal.wave,
    "bistable_pattern": temporal.wave,
    "readout_memory": _memory,
    "adc_memory": temporal.carried,
    "tap_mismatch": lambda look, p: maps.along(
        look, second_tap(_view(look), p.get("regions", "left_right")), "gain", "offset"
    ),
    "line_settling": lambda look, p: maps.along(
        look,
        settled(_view(look), p),
        *(("gain", "offset") if p["gain_percent"] else ("offset", "gain")),
    ),
    "channel_imbalance": lambda look, _: levels.green_difference(look),
}

COUNTED: dict[str, Callable[[Look, Parameters], float]] = {
    "impulse": lambda look, _: codes.spikes(look),
    "quantisation": lambda look, p: codes.coarseness(look, int(p["step_dn"])),
}

__all__ = ["COUNTED", "EVIDENCE", "Evidence", "Look", "Parameters"]
