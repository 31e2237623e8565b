"""What is named of recordings whose rows move: with the words for all that does so."""

from analysis.mismatch import Finding, find_mismatch
from dsis.camera import Camera
from mismatch_recordings import TWO_LEVELS, recorded

WORDS = frozenset(
    {"row_banding", "row_noise", "pink_noise", "line_flicker", "black_level_drift", "crosstalk",
     "spatial_filtering", "readout_memory"}
)  # fmt: skip


def diagnosed(
    true: Camera,
    base: Camera,
    seed: int,
    words: frozenset[str] = WORDS,
    *,
    columns: int = 48,
) -> Finding:
    recording = recorded(true, seed, columns=columns, levels=TWO_LEVELS)
    return find_mismatch(base, recording, seed=1, vocabulary=words)
