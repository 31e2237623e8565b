"""Evidence in single codes: which are used, how often, and spikes."""

import numpy as np
from scipy.signal import savgol_filter

from planter.evidence.look import Evidence, Look

WINDOW, ORDER = 11, 4  # codes of the smooth envelope
LEAST_COUNT = 20


def unevenness(look: Look) -> Evidence:
    """Return the chi-square of code counts against their smooth envelope."""
    codes = np.concatenate([frames.astype(np.int64).ravel() for frames in look.stacks])
    root = np.sqrt(np.bincount(codes, minlength=look.case.white_level + 1))
    smooth = savgol_filter(root, WINDOW, ORDER)
    used = smooth**2 > LEAST_COUNT
    return Evidence(np.array([4 * np.sum((root - smooth)[used] ** 2)]))


def coarseness(look: Look, step: int) -> float:
    """Return how many binomial errors more codes than chance are whole multiples of `step`."""
    codes = np.concatenate([frames.astype(np.int64).ravel() for frames in look.stacks])
    share, chance = np.mean(codes % step == 0), 1 / step
    return float((share - chance) / np.sqrt(chance * (1 - chance) / codes.size))


def spikes(look: Look) -> float:
    """Return the root of the number of samples beyond 6 deviations: Poisson's z of their rate."""
    count = 0
    for e in look.exposures():
        for place in look.case.channels().values():
            z = look.residuals[e][:, place[0], place[1]]
            deviation = 1.4826 * np.median(np.abs(z))
            count += int(np.sum(z > 6 * max(deviation, 0.5)))
    return float(np.sqrt(count))
