"""Where physics on no list shows: words in names of statistics, and kinds of exposures."""

from collections.abc import Mapping
from typing import Any

_SCENE = ("scene",)
_LIT = ("flat", "scene")
_ANY = ("dark", "flat", "scene")
_PATCH = ("fixed_", "outlying", "pattern")
_VARYING = ("pixel_variance", "variance_spread", "variance_persistence", "noisy", "kurtosis")

SHOWS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "column_gain_drift": (("column_", "line_correlation", "correlation_1_0"), _LIT),
    "read_noise_vignetting": (_VARYING, _ANY),
    "half_frame_alternation": (
        ("row_", "alternation", "frame_", "half_seam", "correlation_1_0"),
        _ANY,
    ),
    "cluster_defect": (_PATCH, _LIT),
    "dust_shadows": (_PATCH, _LIT),
    "display_moire": ((*_PATCH, "spectral_peak"), ("flat",)),
    "double_frames": (("frame_correlation",), _ANY),
    "dark_temperature_ramp": (("frame_", "level", "first_frames"), _ANY),
    "blooming_trail": ((*_PATCH, "growth", "level"), _ANY),
    "scene_jitter": (("scene_motion", "_variance", "correlation", *_VARYING), _SCENE),
    "companding": (("code", "pixel_variance", "kurtosis", "variance_line"), _ANY),
    "horizontal_smear": ((*_PATCH, "level"), _SCENE),
    "vibration": (("scene_motion", "_variance", "correlation", "spectrum", *_VARYING), _SCENE),
    "speckle_light": (("correlation", "skew", "pixel_variance", "variance_line"), _LIT),
    "block_offset_noise": (
        ("correlation", "row_", "column_", "spectral_peak", "patch_variance"),
        _ANY,
    ),
    "shutter_gradient": (("fixed_smooth", "fixed_row", "half_seam"), ("flat",)),
    "column_telegraph": (("column_", "line_correlation", "correlation_1_0"), _ANY),
    "line_start_settling": (("fixed_", "half_seam"), _ANY),
}


def points_at(kind: str, mismatch: Mapping[str, Any], kinds: Mapping[str, str]) -> bool:
    """Tell whether a mismatch lies where an effect on no list shows.

    Parameters
    ----------
    kind
        The effect.
    mismatch
        With "statistic" and "where", as mismatch.json has it.
    kinds
        The kind of each exposure, by name; where the mismatch names none, its own kind or any.
    """
    names, places = SHOWS[kind]
    where = mismatch.get("where") or {}
    lies = {kinds[name] for name in where.get("exposures") or () if name in kinds}
    lies = lies or ({where["kind"]} if where.get("kind") else set(_ANY))
    return any(name in mismatch["statistic"] for name in names) and bool(lies & set(places))
