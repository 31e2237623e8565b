"""The scalar measures: names and units, shared by effects, tests and diagnosis.

What one measure can say depends on others:

* Below about 0.5 DN of pixel noise rounding makes variances depend on where the mean lies between
  two codes: the nulls of variance_spread, skewness, kurtosis, frame_correlation and of the fixed
  variances do not hold there. code_imbalance is unknown below 2 code steps of noise.
* Correlated neighbours make row and column means scatter more: row_variance gains the sum of the
  correlations along the row over its length (times the pixel variance), column_variance likewise,
  and spectral_peak rises with the low end of the spectrum.
* On a mosaic each channel is measured in its own plane: what alternates from pixel to pixel of the
  mosaic is common to a channel's pixels, and shows in its frame or line means.
* With two frames skewness and frame_correlation are unknown.
"""

CORRELATION_LAGS = {
    "correlation_0_1": (0, 1),
    "correlation_1_0": (1, 0),
    "correlation_1_1": (1, 1),
    "correlation_0_2": (0, 2),
    "correlation_2_0": (2, 0),
}
FIXED_CORRELATION_LAGS = {
    "fixed_correlation_0_1": (0, 1),
    "fixed_correlation_1_0": (1, 0),
}

MEASURES = {
    "level": "DN",
    "pixel_variance": "DN^2",
    "row_variance": "DN^2",
    "column_variance": "DN^2",
    "frame_variance": "DN^2",
    "skewness": "1",
    "kurtosis": "1",
    **dict.fromkeys(CORRELATION_LAGS, "1"),
    "spectral_peak": "1",
    "row_spectrum_peak": "1",
    "frame_correlation": "1",
    "variance_spread": "1",
    "code_spacing": "DN",
    "code_imbalance": "1",
    "fixed_pixel_variance": "DN^2",
    "fixed_row_variance": "DN^2",
    "fixed_column_variance": "DN^2",
    "fixed_smooth_variance": "DN^2",
    **dict.fromkeys(FIXED_CORRELATION_LAGS, "1"),
}
