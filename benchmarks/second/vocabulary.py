"""What may be hidden, what cannot stand together, and how each effect was read.

- adc_dnl: one converter, transitions moved once for all: at random, repeating every 2^m codes
  (sub-ranging) or by wrong weights of bits.
- amp_glow: exponential or 1 / (1 + d / L); dn_per_s is the value at its edge or corner.
- bistable_pattern: checkerboard or stripes, square or sine; amplitude is half the peak to peak.
- black_level_drift: white, autoregressive through the recording in file order, or a ramp that a
  clamp arms again.
- brighter_fatter: at times stronger along one axis; per_dn is the geometric mean of both.
- crosstalk: pairs exchange charge after shot noise, along both axes or one.
- dual_gain: camera.toml has one segment of two; dual_gain_mismatch: the mean steps or kinks.
- hot_pixels: an exact share, rates exponential or lognormal of the given mean.
- image_lag: recursive; before the first frame lies a steady state, or darkness.
- impulse: a floor of 7 sigma of the brightest flat and an exponential; some have a second pixel.
- line_flicker, periodic_noise: amplitude is half the peak to peak; free or beating phase.
- nonlinearity: quadratic, cubic, gamma or knee; largest deviation from the chord to 85 %.
- pink_noise: exponents 0.9 to 1.1, line blanking, at times along columns.
- prnu, dsnu, row_fpn, column_fpn: Gaussian, or with tails; the size is the standard deviation.
- quantisation: step and phase. saturation: hard, or a soft roll-off.
- readout_memory: a share of the sample some pixels earlier replaces that of this one, signal too.
- rts: asymmetric rates, exponential heights, at times of either sign; the low state is the base.
- shading: r^2, r^3 or as cos^4; 0 at a centre that may be shifted, the fall-off in the farthest
  corner.
- spatial_filtering: `fraction` is the total weight moved, to 4, 8 or 2 neighbours of one colour.
- tap_mismatch: the seam anywhere from 30 to 70 %; even and odd lines of a mono sensor only.
"""

PARAMETERS: dict[str, tuple[str, ...]] = {
    "dual_gain": ("switch_dn",),
    "dual_gain_mismatch": ("gain_error_percent",),
    "poisson_shot_noise": (),
    "heavy_tailed_read_noise": ("tail_df",),
    "read_noise_spread": ("log_sigma",),
    "rts": ("pixel_fraction", "amplitude_dn"),
    "row_noise": ("sigma_dn",),
    "column_noise": ("sigma_dn",),
    "row_fpn": ("sigma_dn",),
    "column_fpn": ("sigma_dn",),
    "dsnu": ("sigma_dn",),
    "prnu": ("sigma_percent",),
    "shading": ("falloff_percent",),
    "dark_current": ("dn_per_s",),
    "hot_pixels": ("pixel_fraction", "mean_dn_per_s"),
    "amp_glow": ("dn_per_s",),
    "nonlinearity": ("percent_full_scale",),
    "saturation": ("full_well_dn",),
    "quantisation": ("step_dn",),
    "adc_dnl": ("rms_lsb",),
    "black_level_drift": ("sigma_dn",),
    "flicker": ("sigma_percent",),
    "line_flicker": ("depth_percent", "cycles_per_frame"),
    "crosstalk": ("fraction",),
    "brighter_fatter": ("per_dn",),
    "image_lag": ("fraction",),
    "spatial_filtering": ("fraction",),
    "pink_noise": ("sigma_dn",),
    "periodic_noise": ("amplitude_dn", "frequency"),
    "bistable_pattern": ("amplitude_dn", "frequency"),
    "readout_memory": ("fraction", "lag_pixels"),
    "tap_mismatch": ("gain_percent",),
    "channel_imbalance": ("gain_percent",),
    "impulse": ("per_megapixel_frame",),
}
LISTED = tuple(PARAMETERS)
UNLISTED = (
    "column_gain_drift",
    "read_noise_vignetting",
    "half_frame_alternation",
    "cluster_defect",
    "dust_shadows",
    "display_moire",
    "double_frames",
    "dark_temperature_ramp",
    "blooming_trail",
    "scene_jitter",
    "companding",
    "horizontal_smear",
    "vibration",
    "speckle_light",
    "block_offset_noise",
    "shutter_gradient",
    "column_telegraph",
    "line_start_settling",
)

LIGHT = frozenset({"nonlinearity", "dual_gain_mismatch", "saturation"})
THERMAL = frozenset(
    {"dark_current", "hot_pixels", "amp_glow", "dark_temperature_ramp", "blooming_trail"}
)
SCENE = frozenset({"scene_jitter", "vibration", "horizontal_smear"})
LEVELS = LIGHT | {"dual_gain", "brighter_fatter", "speckle_light"}
CLASHES = (
    {"dual_gain", "dual_gain_mismatch"},
    {"dual_gain", "nonlinearity"},
    {"dual_gain_mismatch", "nonlinearity"},
    {"saturation", "nonlinearity"},
    {"saturation", "dual_gain_mismatch"},
    {"saturation", "dual_gain"},
    {"quantisation", "adc_dnl"},
    {"spatial_filtering", "crosstalk"},
    {"spatial_filtering", "brighter_fatter"},
    {"spatial_filtering", "readout_memory"},
    {"companding", "quantisation"},
    {"companding", "adc_dnl"},
    {"companding", "spatial_filtering"},
    {"speckle_light", "brighter_fatter"},
    {"speckle_light", "dual_gain"},
    {"double_frames", "image_lag"},
    {"half_frame_alternation", "bistable_pattern"},
    {"dark_temperature_ramp", "dark_current"},
    {"blooming_trail", "hot_pixels"},
    {"shutter_gradient", "shading"},
    {"dark_temperature_ramp", "black_level_drift"},
)
# Effects that camera.toml may list: there, and not hidden.
KNOWN = (
    "dsnu",
    "prnu",
    "row_noise",
    "column_noise",
    "row_fpn",
    "column_fpn",
    "flicker",
    "shading",
    "black_level_drift",
    "read_noise_spread",
    "line_flicker",
    "crosstalk",
    "dark_current",
)
# An effect on no list that needs a known one to grow from.
NEEDED = {"dark_temperature_ramp": "dark_current", "blooming_trail": "hot_pixels"}


def clash(kinds: list[str]) -> bool:
    """Tell whether effects cannot be told apart in one recording, or one is there twice."""
    there = set(kinds)
    return len(there) < len(kinds) or any(pair <= there for pair in CLASHES)
