"""The key against the finding: what was named rightly, wrongly, not at all, and how well."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from planter.acceptable import located, numbers, points_at
from planter.case import Case
from planter.finder import named
from planter.parameters import switch_gap, truth_of

COMPARED: dict[str, tuple[str, ...]] = {
    "dual_gain": ("switch_dn",),
    "dual_gain_mismatch": ("gain_error_percent",),
    "heavy_tailed_read_noise": ("tail_df",),
    "read_noise_spread": ("log_sigma",),
    "rts": ("pixel_fraction", "amplitude_dn"),
    "prnu": ("sigma_percent",),
    "smooth_prnu": ("sigma_percent", "length_pixels"),
    "row_banding": ("sigma_dn", "length_rows"),
    "row_prnu": ("sigma_percent",),
    "column_prnu": ("sigma_percent",),
    "shading": ("falloff_percent",),
    "dark_current": ("dn_per_s",),
    "hot_pixels": ("pixel_fraction", "mean_dn_per_s"),
    "amp_glow": ("dn_per_s", "extent"),
    "nonlinearity": ("percent_full_scale",),
    "saturation": ("full_well_dn",),
    "quantisation": ("step_dn",),
    "adc_dnl": ("rms_lsb",),
    "flicker": ("sigma_percent",),
    "line_flicker": ("depth_percent", "cycles_per_frame"),
    "crosstalk": ("fraction",),
    "brighter_fatter": ("per_dn",),
    "image_lag": ("fraction",),
    "spatial_filtering": ("fraction",),
    "periodic_noise": ("amplitude_dn", "frequency"),
    "bistable_pattern": ("amplitude_dn", "frequency"),
    "readout_memory": ("fraction", "lag_pixels"),
    "adc_memory": ("step_dn", "period_codes", "at_code"),
    "tap_mismatch": ("gain_percent",),
    "line_settling": ("offset_dn", "gain_percent", "length_pixels"),
    "channel_imbalance": ("gain_percent",),
    "impulse": ("per_megapixel_frame",),
    **dict.fromkeys(
        (
            "row_noise",
            "column_noise",
            "row_fpn",
            "column_fpn",
            "dsnu",
            "black_level_drift",
            "pink_noise",
        ),
        ("sigma_dn",),
    ),
}
# Which side is called positive is a convention.
UNSIGNED = frozenset({"tap_mismatch", "channel_imbalance", "nonlinearity"})
CYCLIC = {"at_code": "period_codes"}
EXACT = 1e-6  # relative: a number that is known without error
OUTCOMES = ("right", "abstained", "misnamed", "missed", "crashed")


def judge(
    entry: Mapping[str, Any], values: Mapping[str, Any], known: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the judgement of one case.

    Parameters
    ----------
    entry
        Of the key.
    values
        What mismatch.json holds.
    known
        Effects that real frames have by themselves: found without any planting.
    """
    case, planted = Case.from_json(json.dumps(entry["case"])), set(entry["z"])
    names = set(named(dict(values)))
    # What is out of the vocabulary may not be named, though it is there.
    wrong = sorted(names - (planted - {entry.get("out")}) - set(known))
    return {
        "wrong": wrong,
        "named": sorted(names),
        "outcome": {kind: _outcome(kind, names, wrong, values) for kind in sorted(planted)},
        "located": {
            kind: located(case, kind, list(values.get("mismatches", ())))[1]
            for kind in sorted(planted)
        },
        "left_unexplained": {
            kind: any(points_at(case, kind, m)[0] for m in values.get("unexplained", ()))
            for kind in sorted(planted)
        },
        "errors_se": _errors(case, names & planted, values),
        "wrong_found": _wrong_numbers(case, values),
    }


def _outcome(kind: str, names: set[str], wrong: Sequence[str], values: Mapping[str, Any]) -> str:
    if "error" in values:
        return "crashed"
    if kind in names:
        return "right"
    tied = [*values.get("undecided", ())]
    for entry in values.get("omitted_physics", ()):
        tied += entry.get("alternatives", ())
    other = {alternative["effect"] for alternative in tied}
    if wrong:
        return "misnamed"
    return "abstained" if kind in other or values.get("unexplained") else "missed"


def _errors(case: Case, kinds: set[str], values: Mapping[str, Any]) -> dict[str, float]:
    """Return (value - planted) / standard error by "effect.parameter"."""
    errors = {}
    for entry in values.get("omitted_physics", ()):
        kind = entry["effect"]
        for name in COMPARED.get(kind, ()) if kind in kinds else ():
            found = entry.get("parameters", {}).get(name)
            if found is not None:
                errors[f"{kind}.{name}"] = _error(case, kind, name, found)
    return errors


def _error(case: Case, kind: str, name: str, found: Mapping[str, Any]) -> float:
    value, spread = numbers(found["value"]), numbers(found.get("standard_error"))
    truth = numbers((case.planted(kind) or {})[name])
    if kind == "dual_gain":  # known up to the gap between levels
        low, high = switch_gap(case)
        truth = [min(max(value[0], low), high)]
    if kind in UNSIGNED:
        value, truth = [abs(v) for v in value], [abs(t) for t in truth]
    if name in CYCLIC:  # the same in every period
        period = (case.planted(kind) or {})[CYCLIC[name]]
        half = period / 2
        apart = [(v - t + half) % period - half for v, t in zip(value, truth, strict=True)]
        value = [t + d for t, d in zip(truth, apart, strict=True)]
    spread = spread * len(value) if len(spread) == 1 else spread or [0.0] * len(value)
    signs = (1, -1) if name == "frequency" else (1,)
    return min((_largest(value, [sign * t for t in truth], spread) for sign in signs), key=abs)


def _largest(value: list[float], truth: list[float], spread: list[float]) -> float:
    """Return the largest error among components, in standard errors."""
    errors = []
    for v, t, se in zip(value, truth, spread, strict=True):
        exact = abs(v - t) <= EXACT * max(abs(t), 1)
        errors.append(0.0 if exact else (v - t) / se if se > 0 else float("inf"))
    return max(errors, key=abs)


def _wrong_numbers(case: Case, values: Mapping[str, Any]) -> dict[str, bool]:
    listed = {
        truth[0]
        for entry in values.get("parameter_errors", ())
        if (truth := truth_of(case, entry)) is not None
    }
    return {name: name in listed for name in case.wrong}
