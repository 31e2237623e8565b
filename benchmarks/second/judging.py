"""The key against a finding: names, places, wrong numbers, parameters."""

from collections.abc import Callable, Mapping
from typing import Any

from second.places import points_at
from second.vocabulary import PARAMETERS

COVERED = 1.96  # standard errors of a 95 % interval
EXACT = 1e-6  # relative: a number that is known without error
Truth = Callable[[dict[str, Any]], dict[str, Any]]  # of a realisation; empty: read otherwise


def _when(*names: str, **holds: Any) -> Truth:
    """Return parameters of these names where the realisation is what the project means too."""

    def truth(made: dict[str, Any]) -> dict[str, Any]:
        same = all(made.get(name) in values for name, values in holds.items())
        return {name: made[name] for name in names} if same else {}

    return truth


def _bend(made: dict[str, Any]) -> dict[str, Any]:
    same = made["law"] == "quadratic"
    return {"percent_full_scale": made["sign"] * made["percent_full_scale"]} if same else {}


def _kernel(made: dict[str, Any]) -> dict[str, Any]:
    return {"fraction": made["fraction"] / 4} if made["mode"] == "plus4" else {}


def _sign_of_pattern(made: dict[str, Any]) -> dict[str, Any]:
    same = set(made["frequency"]) <= {0.0, 0.5}  # elsewhere square waves and phases differ
    return {k: made[k] for k in ("amplitude_dn", "frequency")} if same else {}


def _taps(made: dict[str, Any]) -> dict[str, Any]:
    same = made["layout"] in ("columns", "rows") or made["seam"] == 0.5
    return {"gain_percent": made["gain_percent"]} if same else {}


# Where simulator and project read the contract alike, so that numbers can be compared. Of rts,
# pink_noise and impulse no law is the same; of readout_memory the lag alone; dual_gain's switch
# is known up to a gap between levels. Of image_lag what has stayed stays again here, and there not:
# where frames are alike by 0.12, the one's fraction is 0.12, the other's 0.108.
COMPARABLE: dict[str, Truth] = {
    "dual_gain_mismatch": _when("gain_error_percent"),
    "heavy_tailed_read_noise": _when("tail_df"),
    "read_noise_spread": _when("log_sigma"),
    "row_noise": _when("sigma_dn"),
    "column_noise": _when("sigma_dn"),
    "row_fpn": _when("sigma_dn", shape=["gauss"]),
    "column_fpn": _when("sigma_dn", shape=["gauss"]),
    "dsnu": _when("sigma_dn", shape=["gauss"]),
    "prnu": _when("sigma_percent", shape=["gauss"]),
    "shading": _when("falloff_percent", law=["r2"], centre=[[0.5, 0.5]]),
    "dark_current": _when("dn_per_s"),
    "hot_pixels": _when("pixel_fraction", "mean_dn_per_s", law=["exp"]),
    "amp_glow": _when("dn_per_s", law=["exp"]),
    "nonlinearity": _bend,
    "saturation": _when("full_well_dn", law=["hard"]),
    "quantisation": _when("step_dn"),
    "adc_dnl": _when("rms_lsb", law=["random"]),
    "black_level_drift": _when("sigma_dn", law=["white", "ar1"]),
    "flicker": _when("sigma_percent", law=["white"]),
    "line_flicker": _when("depth_percent", "cycles_per_frame"),
    "crosstalk": _when("fraction"),
    "brighter_fatter": _when("per_dn", ratio=[1.0]),
    "spatial_filtering": _kernel,
    "periodic_noise": _when("amplitude_dn", "frequency"),
    "bistable_pattern": _sign_of_pattern,
    "readout_memory": _when("lag_pixels"),
    "tap_mismatch": _taps,
    "channel_imbalance": _when("gain_percent"),
}

# What the project learned later, by the same law: no longer outside its list.
NOW_LISTED: dict[str, tuple[str, Callable[[dict[str, Any], int], dict[str, Any]]]] = {
    "line_start_settling": (
        "line_settling",
        lambda made, width: {
            "offset_dn": made["amplitude"],
            "length_pixels": made["length"] * width,
        },
    ),
}


def judge(
    entry: Mapping[str, Any], values: Mapping[str, Any], kinds: Mapping[str, str]
) -> dict[str, Any]:
    """Return the judgement of one case.

    Parameters
    ----------
    entry
        Of the key.
    values
        What mismatch.json holds.
    kinds
        The kind of each exposure, by its name in recording.toml.
    """
    names = {found["effect"] for found in values.get("omitted_physics", ())}
    later = {kind: NOW_LISTED[kind][0] for kind in entry["unlisted"] if kind in NOW_LISTED}
    effects = [*entry["effects"], *later.values()]
    return {
        "case": entry["case"],
        "z": {later.get(row["effect"], row["effect"]): row["z"] for row in entry["hidden"]},
        "named": sorted(names),
        "wrong": sorted(names - set(effects)),
        "missed": [kind for kind in effects if kind not in names],
        "outside": {
            kind: _left(kind, values, kinds) for kind in entry["unlisted"] if kind not in later
        },
        "off": {o["parameter"]: _quoted(o, values) for o in entry["off"]},
        "known": sorted(entry["written"]),
        "errors_se": _errors(entry, values),
        "expected": entry["verdict"],
        "verdict": values["verdict"],
        "error": values.get("error"),
        "seconds": values["seconds"],
    }


def _left(kind: str, values: Mapping[str, Any], kinds: Mapping[str, str]) -> bool:
    return any(points_at(kind, found, kinds) for found in values.get("unexplained", ()))


def _quoted(off: Mapping[str, Any], values: Mapping[str, Any]) -> bool:
    """Tell whether a wrong number is among the parameter errors, by what camera.toml says."""
    said = off["model"]
    plain = off["parameter"].rsplit(".", 1)[-1]
    return any(
        plain in found["parameter"] and abs(found["model"] - said) <= EXACT * abs(said)
        for found in values.get("parameter_errors", ())
    )


def _errors(entry: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, float]:
    """Return (found - true) / standard error by "effect.parameter" where both can be compared."""
    truths = {}
    for row in entry["hidden"]:
        kind, made = row["effect"], row["realisation"]
        if kind in NOW_LISTED:
            kind, read = NOW_LISTED[kind]
            truths[kind] = read(made, entry["camera"]["w"])
        elif kind in PARAMETERS and kind in COMPARABLE:
            truths[kind] = COMPARABLE[kind](made)
    errors = {}
    for found in values.get("omitted_physics", ()):
        kind = found["effect"]
        for name, true in truths.get(kind, {}).items():
            if number := found.get("parameters", {}).get(name):
                errors[f"{kind}.{name}"] = _error(number, true)
    return errors


def _error(number: Mapping[str, Any], true: Any) -> float:
    """Return the largest error of a number's components; a wave's sign as a whole is free."""
    if not isinstance(true, list):
        return _apart(number["value"], true, number.get("standard_error"))
    spread = number.get("standard_error")
    spread = spread if isinstance(spread, list) else [spread] * len(true)
    both = (
        max(
            (_apart(v, sign * t, s) for v, t, s in zip(number["value"], true, spread, strict=True)),
            key=abs,
        )
        for sign in (1, -1)
    )
    return min(both, key=abs)


def _apart(value: float, true: float, error: float | None) -> float:
    if abs(value - true) <= EXACT * max(abs(true), 1):
        return 0.0
    return (value - true) / error if error else float("inf")
