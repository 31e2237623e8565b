"""By which numbers each effect is seen best: they have most of the error rate.

Physics adds to mean squares, tails, peaks and correlations of neighbours: these are looked at from
one side. What may have either sign (a step, a ratio of gains, a memory) is looked at from both.
"""

from collections.abc import Mapping, Sequence

from analysis.mismatch.bank.codephase import DETAIL as CODE_PHASE
from analysis.mismatch.bank.coherent import ALTERNATING, PATCHES
from analysis.mismatch.bank.common import SIGNS
from analysis.mismatch.bank.edges import names as edge_names
from analysis.mismatch.bank.framenoise import NAME as FRAME_NOISE
from analysis.mismatch.bank.key import MOSAIC, Key
from analysis.mismatch.bank.movingbands import DETAIL as MOVING_BANDS
from analysis.mismatch.bank.parts import STANDING_OUT
from analysis.mismatch.bank.patches import OUTLYING_PATCH, SIZES
from analysis.mismatch.bank.periods import FEW_PIXELS
from analysis.mismatch.bank.persistent import BY_LINE, OUTSTANDING, SURFACE
from analysis.mismatch.bank.seams import WHOLE
from analysis.mismatch.bank.surfaces import LOW, RING
from analysis.mismatch.bank.together import TOGETHER

BOTH = "along rows and columns"
TIME = "with the exposure time"
ABOVE = "steeper above"
BENT = "bent with the signal"
STEPPED = "another gain above"
READ_NOISE = "of read noise"
PERSISTENT = "of read noise, in all exposures"
LAG = 0.1  # share of one of many lags along a line, in that of another sum
_TWO_SIDED = frozenset({"pixel_variance", "channel_ratio", "half_seam", "parity",
                        "fixed_edge", "line_correlation", "carry_over", "fixed_smooth_tilt",
                        "fixed_smooth_falloff", RING})  # fmt: skip
# Sums over exposures: statistic, how what it shows grows with the signal.
SHAPED: Mapping[str, tuple[str, ...]] = {
    "row_variance": ("constant", "with the signal squared"),
    "column_variance": ("constant",),
    "frame_variance": ("constant", "with the signal squared"),
    "alternation_variance": ("constant",),
    "skewness": ("of few electrons",),
    "kurtosis": (READ_NOISE,),
    "kurtosis_within_pixels": (READ_NOISE,),
    "variance_spread": (READ_NOISE, PERSISTENT),
    FRAME_NOISE: ("at all levels",),
    "one_off_outliers": ("at all levels",),
    "code_imbalance": ("at all levels",),
    "correlation_0_1": ("with the signal", "with the signal squared", "at all levels"),
    "correlation_1_0": ("with the signal",),
    "correlation_0_2": ("at all levels",),
    "frame_correlation": ("with the signal",),
    "channel_ratio": ("at all levels",),
    "level": (TIME, BENT),
}
_IN_COMMON = frozenset({"row_variance", "column_variance", "frame_variance"})
_STEPS, _AXES = ("half_seam", "parity"), ("rows", "columns")
# Sums over exposures already: statistic, map, detail.
_POOLED = frozenset(
    {
        *(("fixed_pixel_variance", name, "") for name in ("offset", "gain", "time")),
        ("fixed_row_variance", "offset", ""),
        ("fixed_column_variance", "offset", ""),
        *(("fixed_smooth_variance", name, LOW) for name in ("gain", "time")),
        *(("fixed_patch_variance", "gain", f"{size} pixels") for size in SIZES),
        (OUTLYING_PATCH, "gain", ""),
        *((name, "gain", axis) for name in _STEPS for axis in _AXES),
        *(("half_seam", "gain", f"{axis}, {WHOLE}") for axis in _AXES),
        *(
            ("fixed_edge", name, edge.partition(" of ")[2])
            for name in ("offset", "gain")
            for axis in _AXES
            for edge in edge_names(axis)
        ),
        *(("fixed_smooth_tilt", "time", axis) for axis in _AXES),
        *(("fixed_smooth_falloff", name, "") for name in ("gain", "time")),
        *(("outlying_pixels", "time", f"{limit:g}") for limit in STANDING_OUT),
        ("variance_persistence", "all", ""),
        *((name, "all", "") for name in (SURFACE, *BY_LINE)),
        *(("noisy_pixels", "all", str(limit)) for limit in OUTSTANDING),
        ("spectral_peak", "all", ""),
        ("spectral_peak", "all", FEW_PIXELS),
        *(("patch_variance", "all", f"{size} pixels") for size in PATCHES),
        ("row_spectrum_peak", "all", ""),
        ("row_spectrum_peak", "all", "light"),
        ("row_spectrum_peak", "all", MOVING_BANDS),
        ("code_imbalance", "all", CODE_PHASE),
        ("column_spectrum_peak", "all", "colour"),
        ("column_spectrum_peak", "all", ""),
        ("slow_row_variance", "all", ""),
        ("row_correlation", "all", "lag 1"),
        ("slow_column_variance", "all", ""),
    }
)
_SPECTRA = frozenset({"spectral_peak", "row_spectrum_peak", "column_spectrum_peak",
                      "patch_variance", "slow_row_variance", "row_correlation",
                      "slow_column_variance", "code_imbalance"})  # fmt: skip
_SHARED = frozenset({"fixed_row_variance", "fixed_column_variance", "fixed_smooth_variance",
                     "fixed_smooth_tilt", "fixed_smooth_falloff", RING, "fixed_edge",
                     "fixed_patch_variance", OUTLYING_PATCH, "half_seam",
                     "outlying_pixels"})  # fmt: skip


def together_too(scope: str, detail: str) -> str:
    """Return the detail of a sum over channels."""
    return f"{scope} {detail}".strip()


def homes(keys: Sequence[Key], channels: Sequence[str]) -> list[float]:
    """Return the weight of each number as some effect's home; 0: of none."""
    mosaic = len(channels) > 1
    # Spectra of all channels together, where they were measured; the sum of the channels' else.
    joint = any(key.statistic in _SPECTRA and not key.channel for key in keys if key.scope == "all")
    summed = "all" if joint or not mosaic else "contrast"
    wanted = _pooled({key.scope for key in keys}, mosaic=mosaic, joint=joint)
    wanted |= _shaped(mosaic=mosaic)
    steps = max(sum(_stepped(key) for key in keys), 1)
    found = []
    for key in keys:
        own = (key.statistic, key.scope, key.channel, key.detail)
        weight = float(own in wanted)
        if key.statistic == "line_correlation" and mosaic == (key.channel == ""):
            weight = LAG * (key.scope == summed)
        if key.statistic == "fixed_edge":
            weight *= LAG
        if key.statistic == "fixed_patch_variance":
            weight /= len(SIZES)
        if key.statistic == "patch_variance":
            weight /= len(PATCHES)
        if key.statistic == "carry_over":
            weight = LAG
        if key.statistic == "pixel_variance" and key.detail.startswith(ABOVE):
            weight = 1.0
        if _stepped(key):
            weight = 1 / steps
        found.append(weight)
    return found


def one_sided(key: Key) -> bool:
    """Return whether the effects that a number is home of can only raise it."""
    return key.statistic not in _TWO_SIDED and not (_stepped(key) or key.detail == BENT)


def _stepped(key: Key) -> bool:
    """Return whether a number is a step of the response between two levels."""
    return key.statistic == "level" and key.detail.startswith(STEPPED)


def _shaped(*, mosaic: bool) -> set[tuple[str, str, str, str]]:
    """Return statistic, scope, channel and detail of the sums over exposures that are homes."""
    found = {(name, shape) for name, shapes in SHAPED.items() for shape in shapes}
    found -= {("correlation_0_2", shape) for shape in SHAPED["correlation_0_2"]}
    for name in ("correlation_0_1", "correlation_0_2"):
        found |= {(name, f"{shape} {BOTH}") for shape in SHAPED[name]}
    found -= {("correlation_0_1", shape) for shape in SHAPED["correlation_0_1"][1:]}
    if mosaic:  # what colours share says more than each of them
        found -= {(name, shape) for name in _IN_COMMON for shape in SHAPED[name]}
        found |= {(name, f"constant {MOSAIC}") for name in _IN_COMMON}
        found |= {("alternation_variance", f"constant {MOSAIC}, {name}") for name in SIGNS}
        of_light = "with the signal squared"
        found |= {
            ("row_variance", f"{of_light} {MOSAIC}"),
            ("frame_variance", f"{of_light} {MOSAIC}, light"),
        }
    return {(name, "contrast", "", detail) for name, detail in found}


def _pooled(scopes: set[str], *, mosaic: bool, joint: bool) -> set[tuple[str, str, str, str]]:
    """Return statistic, scope, channel and detail of the sums that are homes."""
    found = set()
    for statistic, name, detail in _POOLED:
        scope = f"{name} alone" if f"{name} alone" in scopes else name
        if not mosaic:
            found.add((statistic, scope, "MONO", detail))
        elif joint and statistic in _SPECTRA:
            found.add((statistic, scope, "", detail))
        elif statistic in _SHARED:
            joined = f"{detail}, {TOGETHER}" if detail else TOGETHER
            found.add((statistic, scope, "", joined))
        else:
            found.add((statistic, "contrast", "", together_too(scope, detail)))
    if not mosaic:
        found |= {("alternation_variance", "all", "MONO", name) for name in SIGNS}
        found |= {(ALTERNATING, "all", "MONO", axis) for axis in _AXES}
    return found
