"""The scalar measures: names and units, shared by effects, tests and diagnosis."""

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
