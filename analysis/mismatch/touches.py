"""Which numbers of the bank an effect may change: those that follow from its measures.

And which sums over frames such numbers need: of simulated frames no others are made.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.coherent import ALTERNATING
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.surfaces import RING
from dsis.camera import Camera
from dsis.effects import Effect

_LINES = frozenset({"row_variance", "column_variance", "frame_variance"})
_FIXED = frozenset(
    {
        "fixed_pixel_variance",
        "fixed_row_variance",
        "fixed_column_variance",
        "fixed_smooth_variance",
    }
)
_CORRELATIONS = frozenset(
    {"correlation_0_1", "correlation_1_0", "correlation_1_1", "correlation_0_2", "correlation_2_0"}
)
_SIDED = frozenset(
    {"half_seam", "parity", "fixed_edge", "fixed_smooth_tilt", "fixed_smooth_falloff", RING}
)
# A mean over frames keeps 1/T of the lines' and frames' own noise.
_FOLLOWS = {
    "kurtosis_within_pixels": frozenset({"kurtosis"}),
    "one_off_outliers": frozenset({"variance_spread", "kurtosis"}),
    "variance_persistence": frozenset({"variance_spread"}),
    "row_variance_spread": frozenset({"fixed_row_variance"}),  # shot noise follows gains
    "column_variance_spread": frozenset({"fixed_column_variance"}),
    "noisy_pixels": frozenset({"variance_spread"}),
    "smooth_variance_spread": frozenset({"fixed_smooth_variance"}),  # where light falls off
    "outlying_pixels": frozenset({"fixed_pixel_variance"}),
    "line_correlation": _CORRELATIONS | _LINES,
    "carry_over": _CORRELATIONS,
    "alternation_variance": frozenset({"spectral_peak"}) | _LINES | _CORRELATIONS,
    "column_spectrum_peak": frozenset({"column_variance"}),
    "row_spectrum_peak": frozenset({"row_spectrum_peak", "row_variance"}),
    "slow_row_variance": frozenset({"row_spectrum_peak", "row_variance"}),
    "row_correlation": frozenset({"row_spectrum_peak", "row_variance"}) | _CORRELATIONS,
    "slow_column_variance": frozenset({"column_variance"}),
    "column_correlation": frozenset({"column_variance"}) | _CORRELATIONS,
    "scene_motion": _CORRELATIONS | _LINES | {"row_spectrum_peak", "spectral_peak"},
    "half_seam": _FIXED | _LINES,
    "fixed_edge": _FIXED | _LINES,
    "fixed_smooth_tilt": _FIXED | _LINES,
    "fixed_smooth_falloff": _FIXED | _LINES,
    RING: _FIXED | _LINES,
    "parity": _FIXED | _LINES,
    "channel_ratio": frozenset({"level"}),
    "level": frozenset({"level", "frame_variance"}),
    "fixed_row_variance": frozenset({"fixed_row_variance", "row_variance"}),
    "fixed_column_variance": frozenset({"fixed_column_variance", "column_variance"}),
    "fixed_smooth_variance": frozenset({"fixed_smooth_variance"}) | _LINES,
    "fixed_correlation_0_1": frozenset({"fixed_correlation_0_1"}) | _CORRELATIONS,
    "fixed_correlation_1_0": frozenset({"fixed_correlation_1_0"}) | _CORRELATIONS,
    # Where light falls off, bands of it have slow waves.
    "patch_variance": frozenset({"spectral_peak", "row_spectrum_peak"}) | _CORRELATIONS,
    ALTERNATING: frozenset({"spectral_peak"}) | _CORRELATIONS,
    "fixed_patch_variance": frozenset({"fixed_correlation_0_1", "fixed_correlation_1_0"})
    | _CORRELATIONS,
    # Few electrons of several DN each leave codes out.
    "code_imbalance": frozenset({"code_imbalance", "skewness"}),
    "code_spacing": frozenset({"code_spacing", "skewness"}),
    # No effect leaves a wave in the mean of frames but by chance: what moves is allowed for.
    "fixed_spectral_peak": frozenset(),
    # The largest of many patches says less of a field, a glow or a surface than their mean squares.
    "outlying_patch": frozenset(),
    # What an effect makes frames differ by is in the model's own spread once it is named.
    "frame_noise": frozenset(),
}

SPECTRA, NEIGHBOURS, CARRY_OVER = "spectra", "neighbours", "carry_over"
_NEED: Mapping[str, frozenset[str]] = {
    SPECTRA: frozenset(
        {
            "spectral_peak",
            "line_correlation",
            "alternation_variance",
            "patch_variance",
            ALTERNATING,
            "fixed_spectral_peak",
        }
    ),
    NEIGHBOURS: _CORRELATIONS | {"fixed_correlation_0_1", "fixed_correlation_1_0"},
    CARRY_OVER: frozenset({"carry_over"}),
}
ALL_SUMS = frozenset(_NEED)
"""Sums over frames that take long: power of waves, products of neighbours, samples by the code
before. All other sums but those of `RECORDED` are always made."""

SPIKES = "spikes"
RECORDED = ALL_SUMS | {SPIKES}
"""Those, and variances with single spikes left out: of simulations these are needed only where the
base numbers are fitted to them."""


def differing(one: Camera, other: Camera) -> list[Effect]:
    """Return the effects that one of two cameras has and the other has not."""
    mine, theirs = Counter(one.effect), Counter(other.effect)
    return list(((mine - theirs) + (theirs - mine)).keys())


def sums_for(effects: Sequence[Effect]) -> frozenset[str]:
    """Return which of `ALL_SUMS` the numbers need that some of the effects may change."""
    return frozenset(name for name, needing in _NEED.items() if _changed(needing, effects))


def touched(keys: Sequence[Key], effects: Sequence[Effect]) -> NDArray[np.bool_]:
    """Return which numbers some of the effects may change.

    What is drawn at random for every line or pixel has no side: it leans one way on one sensor and
    the other way on the next. Few simulated sensors would say which, and be wrong.
    """
    may = _changed({key.statistic for key in keys}, effects)
    return np.array([key.statistic in may for key in keys], bool)


def _changed(names: Iterable[str], effects: Sequence[Effect]) -> set[str]:
    """Return which statistics some of the effects may change."""
    may: set[str] = set()
    for effect in effects:
        own = {name for name in names if effect.changes & _FOLLOWS.get(name, frozenset({name}))}
        may |= own - _SIDED if effect.drawn else own
    return may
