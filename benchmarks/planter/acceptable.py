"""Which mismatches point at an effect: names of statistics, and where they must lie.

A statistic is accepted where its name contains one of the words. `where` is checked against what
was planted: exposures, channel, spatial frequency.
"""

from collections.abc import Callable, Mapping
from typing import Any

from planter.case import Case

Where = Mapping[str, Any]
Place = Callable[[Case, Where], bool]

_CORRELATION = ("correlation", "covariance", "autocorrelation", "power_spectrum")
_POPULATION = ("variance_spread", "variance_persistence", "outlying", "kurtosis", "persistence")
_TIME = ("dark_level", "time", "growth", "level")
_RESPONSE = ("linearity", "level", "variance_line", "photon_transfer", "skew")

STATISTICS: dict[str, tuple[str, ...]] = {
    "dual_gain": ("variance_line", "pixel_variance", "photon_transfer", "switch"),
    "dual_gain_mismatch": ("linearity", "level", "switch", "kink"),
    "poisson_shot_noise": ("skew",),
    "heavy_tailed_read_noise": ("kurtosis", "tail"),
    "read_noise_spread": ("variance_spread", "variance_persistence", "persistence"),
    "rts": (*_POPULATION, "frame_correlation", "blink", "pixel_lag"),
    "row_noise": ("row_variance", "row_spectrum", "line_correlation"),
    "row_banding": ("row_correlation", "slow_row", "row_variance", "row_spectrum", "line_corr"),
    "column_noise": ("column_variance", "column_spectrum", "line_correlation"),
    "row_fpn": ("fixed_row", "row_pattern"),
    "column_fpn": ("fixed_column", "column_pattern"),
    "row_prnu": ("fixed_row", "row_pattern"),
    "column_prnu": ("fixed_column", "column_pattern"),
    "dsnu": ("fixed_pixel", "pattern", "fixed_variance"),
    "prnu": ("fixed_pixel", "pattern", "fixed_variance"),
    "smooth_prnu": ("fixed_patch", "fixed_correlation", "fixed_smooth"),
    "shading": ("fixed_smooth", "smooth"),
    "dark_current": _TIME,
    "hot_pixels": ("fixed_pixel", "outlying", "pattern", "hot"),
    "amp_glow": ("fixed_smooth", "smooth", "pattern_growth", "fixed_", "dark_level"),
    "nonlinearity": (*_RESPONSE, "pixel_variance"),  # of unknown light variances alone show a bend
    "saturation": (*_RESPONSE, "pixel_variance", "kurtosis", "code"),
    "quantisation": ("code",),
    "adc_dnl": ("code",),
    "black_level_drift": ("frame_variance", "frame_mean", "drift"),
    "flicker": ("frame_variance", "frame_mean"),
    "line_flicker": ("row_spectrum", "row_variance", "band"),
    "crosstalk": _CORRELATION,
    "brighter_fatter": (*_CORRELATION, "variance_line"),
    "image_lag": ("frame_correlation",),
    "spatial_filtering": _CORRELATION,
    "pink_noise": ("line_correlation", "row_", *_CORRELATION, "frame_variance", "spectr"),
    "periodic_noise": ("spectral_peak", "spectrum", "peak"),
    "bistable_pattern": ("spectral_peak", "spectrum", "peak", "phase", "alternation"),
    "readout_memory": (*_CORRELATION, "lag"),
    "adc_memory": ("carry_over", *_CORRELATION),
    "tap_mismatch": ("half_seam", "parity", "seam", "tap"),
    "line_settling": ("fixed_edge", "fixed_row", "fixed_column", "fixed_smooth", "smooth"),
    "channel_imbalance": ("channel_ratio", "green", "imbalance"),
    "impulse": ("one_off", "impulse", "outlier", "spike", "skew", "kurtosis"),
}


def _listed(case: Case, where: Where) -> list[str]:
    """Return the exposures that `where` names; all of its kind where it names none."""
    if where.get("exposures"):
        return list(where["exposures"])
    kind = where.get("kind")
    return [p.name for p in case.exposures if kind in (None, p.kind)]


def _any(case: Case, where: Where) -> bool:
    del case, where
    return True


def _lit(case: Case, where: Where) -> bool:
    lit = {p.name for p in case.exposures if p.signal_dn > 0}
    return bool(lit & set(_listed(case, where)))


def _brightest(case: Case, where: Where) -> bool:
    top = max(case.exposures, key=lambda p: p.signal_dn * (p.kind == "flat"))
    return top.name in _listed(case, where)


def _longest(case: Case, where: Where) -> bool:
    longest = max(p.exposure_time_s for p in case.exposures)
    names = {p.name for p in case.exposures if p.exposure_time_s == longest}
    return bool(names & set(_listed(case, where)))


def _green(case: Case, where: Where) -> bool:
    del case
    channel = where.get("channel")
    return channel is None or str(channel).startswith("G")


def numbers(value: Any) -> list[float]:
    """Return all numbers in nested lists, tuples and mappings, in order."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return []
    if isinstance(value, int | float):
        return [float(value)]
    parts = value.values() if isinstance(value, Mapping) else value
    return [number for part in parts for number in numbers(part)]


def _at_frequency(kind: str) -> Place:
    """Accept a frequency within two bins of the planted one, in pixels of the mosaic or a plane."""

    def check(case: Case, where: Where) -> bool:
        given = numbers(where.get("spatial_frequency"))
        if not given:
            return False
        p = case.planted(kind) or {}
        if kind == "line_flicker":
            planted: tuple[float, ...] = (p["cycles_per_frame"] / case.rows,)
            given = [max(given, key=abs)]
        else:
            planted = tuple(p["frequency"])
        tolerance = 2 / min(case.rows, case.columns)
        pitches = (1,) if case.cfa == "MONO" else (1, 2)
        return any(_same_wave(given, planted, tolerance * pitch, pitch) for pitch in pitches)

    return check


def _same_wave(
    given: list[float], planted: tuple[float, ...], tolerance: float, pitch: int
) -> bool:
    """Tell whether two waves are one, whole cycles per sample and the sign of both aside."""
    if len(given) != len(planted):
        return False
    for sign in (1, -1):
        apart = [g - sign * pitch * f for g, f in zip(given, planted, strict=True)]
        if all(abs(d - round(d)) <= tolerance for d in apart):
            return True
    return False


def _at_edge(case: Case, where: Where) -> bool:
    """Accept what lies at the planted edge."""
    p = case.planted("line_settling") or {}
    across = p["edge"] in ("left", "right")
    lines, size = where.get("columns" if across else "rows"), case.columns if across else case.rows
    if not lines:
        return False
    return lines[0] == 0 if p["edge"] in ("left", "top") else lines[1] == size - 1


PLACES: dict[str, Place] = {
    **dict.fromkeys(
        (
            "dual_gain",
            "dual_gain_mismatch",
            "poisson_shot_noise",
            "prnu",
            "smooth_prnu",
            "row_prnu",
            "column_prnu",
            "shading",
            "nonlinearity",
            "flicker",
            "crosstalk",
            "brighter_fatter",
            "image_lag",
            "tap_mismatch",
        ),
        _lit,
    ),
    **dict.fromkeys(("dark_current", "hot_pixels", "amp_glow"), _longest),
    "line_settling": _at_edge,
    "saturation": _brightest,
    "channel_imbalance": _green,
    "line_flicker": _lit,
    "periodic_noise": _at_frequency("periodic_noise"),
    "bistable_pattern": _at_frequency("bistable_pattern"),
}


def points_at(case: Case, kind: str, mismatch: Mapping[str, Any]) -> tuple[bool, bool]:
    """Return whether a mismatch's statistic suits an effect, and whether its place does too."""
    suits = any(word in mismatch["statistic"] for word in STATISTICS[kind])
    where = mismatch.get("where") or {}
    return suits, suits and PLACES.get(kind, _any)(case, where)


def located(case: Case, kind: str, mismatches: list[dict[str, Any]]) -> tuple[bool, bool]:
    """Return whether any mismatch has the right statistic, and whether any is in its place."""
    found = [points_at(case, kind, mismatch) for mismatch in mismatches]
    return any(suits for suits, _ in found), any(placed for _, placed in found)
