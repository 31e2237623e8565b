"""Everything that may be hidden; the order is the one from which hands are dealt."""

from third.amplifiers import DualGain, DualGainMismatch, LineSettling, TapMismatch
from third.charge import (
    BrighterFatter,
    Crosstalk,
    ImageLag,
    Impulse,
    Nonlinearity,
    PoissonShotNoise,
    Saturation,
)
from third.converter import AdcDnl, Quantisation
from third.effect import Effect
from third.fixed_patterns import ColumnFpn, ColumnPrnu, Dsnu, Prnu, RowFpn, RowPrnu
from third.flicker import BlackLevelDrift, Flicker, LineFlicker
from third.light import AmpGlow, ChannelImbalance, DarkCurrent, HotPixels, Shading, SmoothPrnu
from third.lines import ColumnNoise, PinkNoise, RowBanding, RowNoise
from third.memory import AdcMemory, ReadoutMemory, SpatialFiltering
from third.tails import HeavyTailedReadNoise, ReadNoiseSpread, Rts
from third.unlisted_light import (
    FieldFlicker,
    GhostRing,
    LeakStripe,
    MovingFringe,
    Scratch,
    ShiftedFlatField,
)
from third.unlisted_readout import (
    BlockCompression,
    EmiBurst,
    RepeatedFrame,
    StuckBit,
    TemporalFilter,
    WarmingReadNoise,
)
from third.waves import BistablePattern, PeriodicNoise

_LISTED: tuple[type[Effect], ...] = (
    *(Prnu, Dsnu, RowFpn, ColumnFpn, RowPrnu, ColumnPrnu, RowNoise, ColumnNoise, RowBanding),
    *(PinkNoise, BlackLevelDrift, Flicker, LineFlicker, PeriodicNoise, BistablePattern, Shading),
    *(SmoothPrnu, ChannelImbalance, AmpGlow, DarkCurrent, HotPixels, PoissonShotNoise, Impulse),
    *(Crosstalk, BrighterFatter, Saturation, ImageLag, Nonlinearity, TapMismatch, LineSettling),
    *(DualGain, DualGainMismatch, HeavyTailedReadNoise, ReadNoiseSpread, Rts, ReadoutMemory),
    *(AdcMemory, SpatialFiltering, AdcDnl, Quantisation),
)
_UNLISTED: tuple[type[Effect], ...] = (
    *(LeakStripe, GhostRing, Scratch, WarmingReadNoise, EmiBurst, MovingFringe, RepeatedFrame),
    *(BlockCompression, ShiftedFlatField, StuckBit, FieldFlicker, TemporalFilter),
)
LISTED = {effect.kind: effect for effect in _LISTED}
UNLISTED = {effect.kind: effect for effect in _UNLISTED}
CLASHES = (
    {"flicker", "image_lag"},
    {"black_level_drift", "image_lag"},
)
CLASHING_GROUPS = (
    {"seg", "mean"},  # a bend of the mean, and a second gain that nobody knows
    {"skew", "tails"},
)


def clash(kind: str, there: list[str]) -> bool:
    """Tell whether an effect cannot be told apart from one that is there."""
    groups = [LISTED[other].group for other in there]
    own = LISTED[kind].group
    return (
        own in groups
        or any({kind, other} in CLASHES for other in there)
        or any({own, group} in CLASHING_GROUPS for group in groups)
    )
