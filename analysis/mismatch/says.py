"""One plain sentence for each statistic."""

from analysis.mismatch.bank.key import Key
from analysis.mismatch.finding import Where
from analysis.mismatch.scenes import SCENE

_WORDS = {
    "level": "the mean level is off what the light (or the other darks) ask for",
    "channel_ratio": "the two greens differ in level",
    "pixel_variance": "the pixel noise is off the straight line of variance against signal",
    "row_variance": "whole rows move together from frame to frame",
    "column_variance": "whole columns move together from frame to frame",
    "frame_variance": "the mean of whole frames wanders",
    "frame_noise": "frames of one exposure are not equally noisy",
    "skewness": "the noise is skewed",
    "kurtosis": "the noise has tails that a Gaussian has not",
    "kurtosis_within_pixels": "single pixels have tails that a Gaussian has not",
    "variance_spread": "pixels differ in how noisy they are",
    "variance_persistence": "the same pixels are noisy in every exposure",
    "smooth_variance_spread": "parts of the sensor differ in how noisy they are, in every exposure",
    "row_variance_spread": "rows differ in how noisy they are, in every exposure",
    "column_variance_spread": "columns differ in how noisy they are, in every exposure",
    "noisy_pixels": "a few pixels are far noisier than the others, in every exposure",
    "one_off_outliers": "single pixels are far noisier than the others",
    "outlying_pixels": "a few pixels stand far out of the fixed pattern",
    "correlation_0_1": "the noise of neighbours along a row is correlated",
    "correlation_1_0": "the noise of neighbours along a column is correlated",
    "correlation_1_1": "the noise of diagonal neighbours is correlated",
    "correlation_0_2": "the noise two pixels apart along a row is correlated",
    "correlation_2_0": "the noise two pixels apart along a column is correlated",
    "carry_over": "a sample follows the code of the one read before it, in periods",
    "line_correlation": "the noise is correlated over some distance along a line",
    "alternation_variance": "the noise alternates from pixel to pixel, or from line to line",
    "line_alternation": "along each line the noise alternates, by an amount of its own",
    "patch_variance": "patches of pixels move together from frame to frame",
    "spectral_peak": "the noise has a periodic component",
    "row_spectrum_peak": "row means have a periodic component",
    "slow_row_variance": "row means have slow waves",
    "row_correlation": "the means of rows that lie near each other are alike",
    "slow_column_variance": "column means have slow waves",
    "column_correlation": "the means of columns that lie near each other are alike",
    "column_spectrum_peak": "column means have a periodic component",
    "frame_correlation": "the noise of a frame is correlated with that of the next",
    "scene_motion": "the scene moves between frames by less than a pixel",
    "code_spacing": "not every code occurs: codes come in steps",
    "code_imbalance": "codes are not equally frequent",
    "fixed_pixel_variance": "every pixel has a fixed deviation of its own",
    "fixed_row_variance": "the mean frames differ from row to row",
    "fixed_column_variance": "the mean frames differ from column to column",
    "fixed_smooth_variance": "the mean frame has a smooth fixed surface",
    "fixed_smooth_tilt": "the mean frame leans to one side",
    "fixed_smooth_falloff": "the mean frame falls or rises towards its corners",
    "fixed_smooth_ring": "the mean frame is lighter or darker between its centre and its corners",
    "fixed_edge": "the mean frame decays from an edge",
    "fixed_patch_variance": "pixels that lie together have fixed deviations in common",
    "outlying_patch": "a patch of pixels stands out of the fixed pattern",
    "fixed_correlation_0_1": "fixed deviations of neighbours along a row are alike",
    "fixed_correlation_1_0": "fixed deviations of neighbours along a column are alike",
    "fixed_spectral_peak": "a wave stands still in the mean frame",
    "half_seam": "the two halves of the sensor meet in a step",
    "parity": "even and odd lines differ",
}
_ALL = "all"  # channels together: says nothing to who reads
_SCOPES = {
    "offset": ", alike at all signals",
    "offset alone": ", alike at all signals",
    "gain alone": ", in proportion to the signal",
    "gain": ", in proportion to the signal",
    "time": ", growing with exposure time",
}


def sentence(statistic: str, key: Key, z: float, where: Where) -> str:
    """Return what a mismatch says: what, how, where, how clearly."""
    what = _WORDS.get(statistic, statistic)
    how = _SCOPES.get(key.scope, "")
    detail = "" if key.detail == _ALL else key.detail
    if key.scope == "contrast" and detail not in ("", "at all levels"):
        how = f" ({detail})"
    if statistic == "line_correlation":
        *_, axis, lag = detail.split(" ")  # of all channels together, "all" comes first
        colour = "" if key.channel == "MONO" else " of one colour"
        if not float(lag).is_integer():  # from one colour to another
            lag, colour = f"{2 * float(lag):.0f}", ""
        pixels = "pixel" if lag == "1" else "pixels"
        how = f" ({lag} {pixels}{colour} apart along {axis})"
    elif statistic == "scene_motion":
        how = f" (along {detail})"
    elif detail and key.scope not in ("contrast", "exposure", SCENE):
        how += f" ({detail})"
    if detail and key.scope == SCENE and where.signal_dn is not None:
        how += " (between {:.3g} and {:.3g} DN)".format(*where.signal_dn)
    places = ", ".join(where.exposures[:4]) + (" ..." if len(where.exposures) > 4 else "")
    if how in _SCOPES.values() and how and len(where.exposures) == 1:
        places = f"clearest in {places}"  # it is said of maps that all exposures tell
    channel = f" in channel {where.channel}" if where.channel not in (None, "MONO") else ""
    sign = "more" if z > 0 else "less"
    text = f"{what}{how}: {sign} than the model at {abs(z):.3g} standard errors"
    return f"{text}{channel} ({places})."[:1].upper() + f"{text}{channel} ({places})."[1:]
