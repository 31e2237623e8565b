"""Which recording would tell two effects apart."""

_PAIRS = {
    frozenset({"black_level_drift", "flicker"}): "darks, and a second signal level",
    frozenset({"row_noise", "line_flicker"}): "darks: only row noise is there without light",
    frozenset({"row_noise", "pink_noise"}): "more frames: pink noise correlates successive rows",
    frozenset({"column_noise", "pink_noise"}): (
        "more frames: pink noise correlates successive columns"
    ),
    frozenset({"row_noise", "row_banding"}): "more frames: only bands are alike in successive rows",
    frozenset({"pink_noise", "row_banding"}): "more frames: pink noise is alike along rows too",
    frozenset(
        {"black_level_drift", "row_banding"}
    ): "frames of more rows: their means average bands",
    frozenset({"line_flicker", "row_banding"}): "darks: only bands of offsets are there then",
    frozenset({"crosstalk", "brighter_fatter"}): "more signal levels: only one grows with them",
    frozenset({"crosstalk", "spatial_filtering"}): "darks: only a filter correlates read noise",
    frozenset(
        {"readout_memory", "spatial_filtering"}
    ): "hot pixels or spikes: a filter smears them to both sides, memory to one",
    frozenset({"dsnu", "prnu"}): "darks and a bright flat of many frames",
    frozenset({"dsnu", "hot_pixels"}): "darks at two exposure times",
    frozenset({"hot_pixels", "rts"}): "darks at two exposure times",
    frozenset({"nonlinearity", "saturation"}): "more levels near the top of the range",
    frozenset({"nonlinearity", "dual_gain_mismatch"}): "more levels on both sides of the switch",
    frozenset({"nonlinearity", "brighter_fatter"}): "flats of known light: only one bends the mean",
    frozenset({"dual_gain", "nonlinearity"}): "more levels around the suspected switch",
    frozenset({"rts", "read_noise_spread"}): "a stack of 50 darks: jumping pixels show two levels",
    frozenset({"rts", "impulse"}): "more frames: spikes do not come back at the same pixels",
    frozenset({"read_noise_spread", "heavy_tailed_read_noise"}): "two dark stacks: pixels persist",
    frozenset({"periodic_noise", "bistable_pattern"}): "more frames: how the phases are spread",
    frozenset({"shading", "amp_glow"}): "darks at two exposure times",
    frozenset({"smooth_prnu", "shading"}): "flats with the camera turned before the light",
    frozenset({"smooth_prnu", "crosstalk"}): "more frames: only one correlates what is new in each",
    frozenset({"line_settling", "amp_glow"}): "darks at two exposure times",
    frozenset(
        {"tap_mismatch", "channel_imbalance"}
    ): "light of known colour: amplifiers of rows or columns change red and blue too",
    frozenset({"dark_current", "black_level_drift"}): "darks at several exposure times, shuffled",
}


def would_settle(first: str, second: str) -> str:
    """Return the recording that would decide between two effects."""
    return _PAIRS.get(
        frozenset({first, second}), "more frames, darks at two exposure times, and a further level"
    )
