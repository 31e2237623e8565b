"""Figures of the fitted camera model: gain, read noise, full well, dynamic range."""

import numpy as np

from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.segments import SegmentFit


def model_figures(fit: SegmentFit, full_well_dn: float, bound: str) -> tuple[Quantity, ...]:
    """Return the model's figures: gain and read noise of the first segment, full well of the last.

    `bound` says what `full_well_dn` is: a saturation seen, or a lower limit.

    Where a switch changes the slope alone, electrons before it and after it differ by that ratio.
    """
    first = fit.lines[0]
    slope, slope_se = first.slope_dn, first.slope_se_dn
    read2, read2_se = first.intercept_dn2, first.intercept_se_dn2
    if not slope > 0:
        return ()
    gain = Quantity("gain", "DN/e-", slope, slope_se, "slope of the lowest segment")
    inverse = Quantity("1/gain", "e-/DN", 1 / slope, slope_se / slope**2, "its inverse")
    top = fit.lines[-1]
    full = full_well_dn / top.slope_dn if top.slope_dn > 0 else None
    full_se = None if full is None else full * top.slope_se_dn / top.slope_dn
    well = Quantity("full_well", "e-", full, full_se, bound)
    if not read2 > 0:
        none = "the intercept is not positive"
        return (gain, inverse, Quantity("read_noise", "e-", None, None, none), well)
    read = float(np.sqrt(read2))
    read_se = read2_se / (2 * read)
    covariance = first.covariance[0][1]
    electrons = read / slope
    relative = (read_se / read) ** 2 + (slope_se / slope) ** 2 - covariance / (read2 * slope)
    electrons_se = electrons * float(np.sqrt(max(relative, 0.0)))
    found = [
        gain,
        inverse,
        Quantity("read_noise", "DN", read, read_se, "sqrt(intercept), rounding taken off"),
        Quantity("read_noise", "e-", electrons, electrons_se, "sqrt(intercept) / slope"),
        well,
    ]
    if full is not None:
        ratio = full / electrons
        error = float(np.hypot((full_se or 0.0) / full, electrons_se / electrons))
        means = "full well over read noise"
        found += [
            Quantity("dynamic_range", "dB", float(20 * np.log10(ratio)), 8.686 * error, means),
            Quantity("dynamic_range", "stops", float(np.log2(ratio)), 1.443 * error, means),
        ]
    return tuple(found)
