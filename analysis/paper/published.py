"""The numbers that the paper prints: Seybold, Cakmak, Keimel and Stechele, CIC 22 (2014)."""

from typing import Final

import numpy as np

REFERENCE: Final = (
    'T. Seybold, Ö. Cakmak, C. Keimel, W. Stechele, "Noise characteristics of a single sensor '
    'camera in digital color image processing", Color and Imaging Conference 22 (2014)'
)

TABLE_1: Final = {
    "bilinear": np.array(
        [[1, 0.5693, 0.1243], [0.5715, 0.3214, 0.07181], [0.1284, 0.07425, 0.0191]]
    ),
    "dlmmse": np.array(
        [[1, 0.2239, -0.0066], [0.375, 0.06351, 0.03626], [-0.003771, 0.03715, 0.03545]]
    ),
    "lu_tan": np.array(
        [[1, 0.3173, 0.01578], [0.2947, 0.1007, 0.04422], [0.01689, 0.04548, 0.04233]]
    ),
}
MISPRINT: Final = ("dlmmse", 1, 0)
PRESUMED: Final = 0.2375

# Rows (noise, stage of denoising), columns (denoiser, demosaicked or not), dB.
TABLE_2: Final = {
    ("awgn", 3): {"noisy": (35.51, 35.35), "bls_gsm": (44.47, 38.81), "bm3d": (46.33, 38.17)},
    ("sd", 3): {"noisy": (31.51, 33.95), "bls_gsm": (36.45, 37.43), "bm3d": (43.11, 39.49)},
    ("sd", 2): {"noisy": (31.51, 33.95), "bls_gsm": (39.40, 36.61), "bm3d": (41.99, 38.34)},
}

# Loss of MOS by demosaicking, grades, by content and noise.
MOS_LOSS: Final = {("city", "awgn"): 3.0, ("city", "sd"): 0.5, ("landscape", "sd"): 2.3}
REMOVED_SHARE: Final = 0.046
OBSERVERS: Final = 18
"""Participants of the test."""
AWGN_SIGMA: Final = 255 / 10 ** (35.51 / 20)
"""Standard deviation in 8-bit codes that the printed 35.51 dB mean: 4.28."""
SD_PSNR_DB: Final = 31.51
