"""Plain words for statistics, effects, parameters and places: what a colleague reads."""

from analysis.mismatch.finding import Where
from dsis.effects import registry

STATISTICS = {
    "level": "mean level",
    "linearity": "mean level against light",
    "dark_level": "level of darks against exposure time",
    "pixel_variance": "noise variance of single pixels",
    "variance_line": "noise variance against signal",
    "row_variance": "noise common to a row",
    "column_variance": "noise common to a column",
    "frame_variance": "wander of whole frames",
    "frame_noise": "noise of single frames",
    "first_frames": "first frames of exposures",
    "skewness": "asymmetry of the noise",
    "kurtosis": "tails of the noise",
    "kurtosis_within_pixels": "tails of the noise of single pixels",
    "correlation_0_1": "correlation with the next pixel of the row",
    "correlation_1_0": "correlation with the next pixel of the column",
    "correlation_1_1": "correlation with the diagonal neighbour",
    "correlation_0_2": "correlation with the second pixel of the row",
    "correlation_2_0": "correlation with the second pixel of the column",
    "correlation_growth": "growth of the correlation with signal",
    "line_correlation": "correlation along a line",
    "carry_over": "carry-over from the code before",
    "alternation_variance": "power that alternates from pixel to pixel or line to line",
    "line_alternation": "power that alternates along lines, in each by itself",
    "patch_variance": "noise common to patches of pixels",
    "spectral_peak": "strongest line of the noise spectrum",
    "row_spectrum_peak": "strongest line of the spectrum of row means",
    "slow_row_variance": "slow waves of row means",
    "row_correlation": "correlation of row means",
    "slow_column_variance": "slow waves of column means",
    "column_correlation": "correlation of column means",
    "column_spectrum_peak": "strongest line of the spectrum of column means",
    "phase": "phase of the pattern from frame to frame",
    "frame_correlation": "correlation with the next frame",
    "scene_motion": "movement of the scene",
    "variance_spread": "spread of the noise over pixels",
    "variance_persistence": "pixels noisy at every exposure",
    "smooth_variance_spread": "noise that varies smoothly over the sensor",
    "row_variance_spread": "noise that differs from row to row",
    "column_variance_spread": "noise that differs from column to column",
    "noisy_pixels": "few pixels far noisier",
    "outlying_pixels": "few pixels far out",
    "jumping_pixels": "pixels that jump between two levels",
    "one_off_outliers": "single spikes",
    "code_spacing": "step between the codes that occur",
    "code_imbalance": "uneven use of codes",
    "fixed_pixel_variance": "fixed pattern of pixels",
    "fixed_row_variance": "fixed pattern of rows",
    "fixed_column_variance": "fixed pattern of columns",
    "fixed_smooth_variance": "smooth fixed pattern",
    "fixed_smooth_tilt": "tilt of the fixed pattern",
    "fixed_smooth_falloff": "fall of the fixed pattern towards the corners",
    "fixed_smooth_ring": "ring of the fixed pattern between centre and corner",
    "fixed_edge": "decay of the fixed pattern from an edge",
    "fixed_patch_variance": "fixed pattern of patches of pixels",
    "outlying_patch": "patch of pixels that stands out",
    "fixed_correlation_0_1": "fixed pattern alike in neighbours of a row",
    "fixed_correlation_1_0": "fixed pattern alike in neighbours of a column",
    "fixed_spectral_peak": "wave that stands still in the mean frame",
    "pattern_growth": "growth of the fixed pattern",
    "half_seam": "step between two halves",
    "parity": "alternation of even and odd lines",
    "channel_ratio": "ratio of the two greens",
}
EFFECTS = {
    "rts": "random telegraph signal",
    "dsnu": "DSNU",
    "prnu": "PRNU",
    "smooth_prnu": "PRNU that neighbours share",
    "row_fpn": "fixed row pattern",
    "column_fpn": "fixed column pattern",
    "row_prnu": "fixed gains of rows",
    "column_prnu": "fixed gains of columns",
    "line_settling": "lines that have not settled",
    "adc_dnl": "ADC non-linearity from code to code",
    "adc_memory": "memory of the ADC's residue",
    "dual_gain": "dual-gain read-out",
    "brighter_fatter": "brighter-fatter effect",
    "impulse": "impulses",
}
DUAL_GAIN = "A second read-out path, of its own gain and read noise, takes over above a signal."
UNITS = {  # ends of parameter names; the longest that fits
    "dn": "DN",
    "dn_per_s": "DN/s",
    "per_dn": "1/DN",
    "percent": "%",
    "percent_full_scale": "% of full scale",
    "lsb": "LSB",
    "pixels": "pixels",
    "rows": "rows",
    "cycles_per_frame": "cycles per frame",
    "frequency": "cycles/pixel",
    "frequency_x": "cycles/pixel",
    "frequency_y": "cycles/pixel",
    "per_megapixel_frame": "per megapixel and frame",
    "black_level": "DN",
    "noise.slope": "DN",
    "noise.intercept": "DN²",
}
_NAMED = 3  # exposures, frames or pixels listed in full


def parted(statistic: str) -> tuple[str, str]:
    """Return name and detail of a statistic such as `parity of rows`."""
    for mark in (" of ", " along "):
        if mark in statistic:
            name, detail = statistic.split(mark, 1)
            return name, mark.strip() + " " + detail
    return statistic, ""


def statistic_words(statistic: str) -> str:
    """Return what a statistic is; the name itself, spaced, where it has no words yet."""
    name, detail = parted(statistic)
    words = STATISTICS.get(name, name.replace("_", " "))
    return f"{words} ({detail})" if detail else words


def effect_words(kind: str) -> str:
    """Return the usual name of an effect."""
    return EFFECTS.get(kind, kind.replace("_", " "))


def effect_says(kind: str) -> str:
    """Return one sentence on what an effect does; empty for one that is not known."""
    if kind == "dual_gain":
        return DUAL_GAIN
    effect = registry().get(kind)
    if effect is None:
        return ""
    return (effect.__doc__ or "").strip().splitlines()[0].replace("`", "")


def unit(parameter: str) -> str:
    """Return the unit of a parameter, from its name; empty: a pure number."""
    bare = parameter.partition("[")[0]  # noise.slope[1]: of the second segment
    ends = [end for end in UNITS if bare == end or bare.endswith(("_" + end, "." + end))]
    return UNITS[max(ends, key=len)] if ends else ""


def place(where: Where) -> str:
    """Return where a mismatch is, in a few words."""
    w = where
    parts = [
        listed(w.exposures, "exposures"),
        "" if w.kind is None or w.exposures else f"{w.kind}s",
        w.channel if w.channel and w.channel != "MONO" else "",
        _range(w.signal_dn, "DN"),
        _range(w.exposure_time_s, "s"),
        _lines("row", w.rows),
        _lines("column", w.columns),
        "" if w.spatial_frequency is None else _frequency(w.spatial_frequency),
        "" if not w.frames else _counted("frame", [str(n) for n in w.frames]),
        "" if not w.pixels else _counted("pixel", [f"({r}, {c})" for r, c in w.pixels]),
    ]
    return "; ".join(part for part in parts if part) or "everywhere"


def listed(names: tuple[str, ...], what: str) -> str:
    """Return names, or the first and last and how many there are."""
    if len(names) <= _NAMED:
        return ", ".join(names)
    return f"{names[0]} … {names[-1]} ({len(names)} {what})"


def _range(ends: tuple[float, float] | None, of: str) -> str:
    if ends is None:
        return ""
    low, high = (f"{end:.3g}" if abs(end) < 1000 else f"{end:.0f}" for end in ends)
    return f"{low} {of}" if low == high else f"{low} … {high} {of}".replace("-", "\u2212")


def _lines(what: str, ends: tuple[int, int] | None) -> str:
    if ends is None:
        return ""
    first, last = ends
    return f"{what} {first}" if first == last else f"{what}s {first}\u2013{last}"


def _frequency(at: tuple[float, float]) -> str:
    x, y = (f"{value:.4g}".replace("-", "\u2212") for value in at)
    return f"({x}, {y}) cycles/pixel"


def _counted(what: str, shown: list[str]) -> str:
    more = len(shown) - _NAMED
    text = ", ".join(shown[:_NAMED]) + (f" and {more} more" if more > 0 else "")
    return f"{what}{'s' if len(shown) > 1 else ''} {text}"
