"""EMVA 1288's figures of merit of one channel, by the standard's own definitions.

Release 3.1: gain and responsivity are unweighted lines through the origin up to 70 % of saturation,
saturation is the level of the largest temporal variance, non-uniformities come without a spatial
high-pass. They describe what was measured; the camera model is fitted apart from them
(`segments`), with weights, black level and all levels. Errors are those of sampling, or of what the
levels scatter beyond it (`sampled`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.photon_transfer.black import dark_design, dark_line
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.response import Response, column, response_of
from analysis.photon_transfer.rounding import SHEPPARD_DN2
from analysis.photon_transfer.sampled import Estimate, first_coefficient
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.recording.hygiene import CLIPPED_SHARE

LINEARITY_RANGE = (0.05, 0.95)  # of saturation: linearity error
LEAST_STACK = 4  # frames from which a fixed pattern is worth stating


def figures_of_merit(levels: Sequence[LevelStatistics], step_dn: int = 1) -> tuple[Quantity, ...]:
    """Return EMVA 1288's figures of one channel; empty where darks or flats are missing.

    Parameters
    ----------
    levels
        All exposures of one channel, clipped ones included; those with copied frames are not used.
    step_dn
        Step between codes: rounding adds its square over 12.
    """
    known = [s for s in levels if s.frames > 1 and not s.copies]
    darks = [s for s in known if s.kind == "dark"]
    flats = sorted((s for s in known if s.kind == "flat"), key=lambda s: s.level_dn)
    if not darks or not flats:
        return ()
    response = response_of(flats, darks)
    slope = response.gain()
    gain, gain_se = slope.value, slope.standard_error
    if not gain > 0:
        return ()
    dark, dark_means = _dark_noise(darks)
    electrons = _dark_electrons(dark, slope, response, darks)
    sigma = float(np.sqrt(max(dark.value, 0.0)))
    sigma_se = dark.standard_error / (2 * sigma) if sigma else np.nan
    found = [
        Quantity("K", "DN/e-", gain, gain_se, "line through the origin, to 70 % of saturation"),
        Quantity("1/K", "e-/DN", 1 / gain, gain_se / gain**2, "inverse of K"),
        Quantity("sigma_y.dark", "DN", sigma, sigma_se, dark_means),
        Quantity(
            "sigma_d",
            "e-",
            *electrons.of(SHEPPARD_DN2 * step_dn**2),
            "sqrt(sigma_y.dark^2 - 1/12) / K",
        ),
    ]
    found += _sensitivity(response, slope, electrons)
    found += _linearity(response)
    found += _non_uniformity(flats, darks, response, slope)
    found += _dark_current(darks, slope)
    return tuple(_with_known_error(quantity) for quantity in found)


def _with_known_error(quantity: Quantity) -> Quantity:
    """Return a figure whose error is None where noise of nought tells none."""
    error = quantity.standard_error
    return (
        quantity if error is None or np.isfinite(error) else replace(quantity, standard_error=None)
    )


def _dark_noise(darks: Sequence[LevelStatistics]) -> tuple[Estimate, str]:
    times = column(darks, "exposure_time_s")
    design = dark_design(times, times)
    scale = np.maximum(np.abs(design).max(0), 1e-30)
    noise = np.diag(column(darks, "variance_se_dn2") ** 2)
    found = first_coefficient(design / scale, column(darks, "variance_dn2"), noise)
    if design.shape[1] > 1:
        return found, "dark variance at zero exposure time, square root"
    return found, "square root of the mean dark variance"


@dataclass(frozen=True)
class _DarkElectrons:
    """Dark noise, DN^2, and the gain: what their errors do to their ratio."""

    dark: Estimate
    gain: Estimate
    covariance: float

    def of(self, taken_off_dn2: float) -> tuple[float, float]:
        """Return sqrt(dark variance less a number) / gain, e-, and its error."""
        square = self.dark.value - taken_off_dn2
        if not square > 0:
            return 0.0, np.nan
        value = float(np.sqrt(square)) / self.gain.value
        relative = (self.dark.standard_error / square / 2) ** 2
        relative += (self.gain.standard_error / self.gain.value) ** 2
        relative -= self.covariance / (square * self.gain.value)
        return value, value * float(np.sqrt(max(relative, 0.0)))


def _dark_electrons(
    dark: Estimate, gain: Estimate, response: Response, darks: Sequence[LevelStatistics]
) -> _DarkElectrons:
    """Return both: a dark that comes out noisy lowers the variance above it, and so the gain."""
    by_dark = -gain.shares @ response.dark_shares[response.sensitive]
    squares = column(darks, "variance_se_dn2") ** 2
    return _DarkElectrons(dark, gain, float((dark.shares * by_dark * squares).sum()))


def _sensitivity(response: Response, gain: Estimate, electrons: _DarkElectrons) -> list[Quantity]:
    top = response.saturation
    dark, dark_se = electrons.of(0.0)
    least = dark + 0.5
    full = float(response.level_dn[top]) / gain.value
    relative = gain.standard_error / gain.value
    found = []
    if response.light is not None and response.light_unit == "light":
        slope = response.responsivity(response.light)
        efficiency = slope.value / gain.value
        relative = float(np.hypot(relative, slope.standard_error / slope.value))
        full = efficiency * float(response.light[top])
        found = [
            Quantity(
                "R",
                "DN/light",
                slope.value,
                slope.standard_error,
                "responsivity, to 70 % of saturation",
            ),
            Quantity(
                "QE",
                "e-/light",
                efficiency,
                efficiency * relative,
                "R / K: quantum efficiency where light is photons per pixel",
            ),
            Quantity(
                "mu_p.min", "light", least / efficiency, None, "(sigma_y.dark / K + 1/2) / QE"
            ),
            Quantity("mu_p.sat", "light", float(response.light[top]), None, "light at saturation"),
        ]
    means = "full well: at the largest variance"
    if not response.turned_over:
        means += "; lower limit: no unclipped level lies beyond it"
    snr = float(np.sqrt(full))
    ratio = full / least
    return [
        *found,
        Quantity("mu_e.min", "e-", least, dark_se, "absolute sensitivity threshold"),
        Quantity("mu_e.sat", "e-", full, full * relative, means),
        Quantity("SNR_max", "1", snr, snr * relative / 2, "sqrt(mu_e.sat)"),
        Quantity("SNR_max_dB", "dB", 20 * np.log10(snr), 4.343 * relative, "20 log10 SNR_max"),
        Quantity("DR", "1", ratio, None, "mu_e.sat / mu_e.min"),
        Quantity("DR_dB", "dB", 20 * np.log10(ratio), None, "20 log10 DR"),
        Quantity("DR_stops", "stops", np.log2(ratio), None, "log2 DR"),
    ]


def _linearity(response: Response) -> list[Quantity]:
    """Return the deviations from the line of least relative squares, 5 to 95 % of saturation."""
    low, high = (share * response.level_dn[response.saturation] for share in LINEARITY_RANGE)
    inside = (response.level_dn >= low) & (response.level_dn <= high)
    if response.light is None or inside.sum() < 3:
        return []
    x, y = response.light[inside], response.level_dn[inside]
    design = np.stack([x / y, 1 / y], 1)
    scale = np.linalg.norm(design, axis=0)
    line = np.linalg.lstsq(design / scale, np.ones_like(y), rcond=None)[0] / scale
    fitted = line[0] * x + line[1]
    deviation = 100 * (y - fitted) / fitted
    by = "light" if response.light_unit == "light" else "exposure time (light taken as steady)"
    return [
        Quantity("LE_min", "%", float(deviation.min()), None, f"smallest deviation, against {by}"),
        Quantity("LE_max", "%", float(deviation.max()), None, f"largest deviation, against {by}"),
        Quantity(
            "LE",
            "%",
            float(np.abs(deviation).mean()),
            None,
            "mean absolute deviation, 5 to 95 % of saturation (release 3.1)",
        ),
        Quantity(
            "LE_half_range",
            "%",
            float(deviation.max() - deviation.min()) / 2,
            None,
            "half of LE_max - LE_min (release 3.0)",
        ),
    ]


def _non_uniformity(
    flats: Sequence[LevelStatistics],
    darks: Sequence[LevelStatistics],
    response: Response,
    gain: Estimate,
) -> list[Quantity]:
    """DSNU from the longest dark stack, PRNU from the longest flat stack nearest half full."""
    found = []
    half = 0.5 * float(response.level_dn[response.saturation])
    above = dict(zip((f.exposure for f in flats), response.level_dn, strict=True))
    unclipped = [f for f in flats if max(f.clipped_low, f.clipped_high) <= CLIPPED_SHARE]
    flat = max(unclipped, key=lambda f: (f.frames, -abs(above[f.exposure] - half)), default=None)
    time_s = flat.exposure_time_s if flat else 0.0
    dark = max(darks, key=lambda d: (d.frames, -abs(d.exposure_time_s - time_s)))
    if dark.frames >= LEAST_STACK:
        in_dn = _root(dark.fixed_dn2, dark.fixed_se_dn2)
        means = f"fixed pattern of {dark.exposure}, {dark.frames} frames"
        found += [
            Quantity("DSNU1288", "e-", *_in_electrons(*in_dn, gain), means),
            Quantity("DSNU1288", "DN", *in_dn, means),
        ]
    if flat and min(flat.frames, dark.frames) >= LEAST_STACK:
        value, error = _root(
            flat.fixed_dn2 - dark.fixed_dn2, float(np.hypot(flat.fixed_se_dn2, dark.fixed_se_dn2))
        )
        level = flat.level_dn - dark.level_dn
        found.append(
            Quantity(
                "PRNU1288",
                "%",
                None if value is None else 100 * value / level,
                None if error is None else 100 * error / level,
                f"fixed pattern of {flat.exposure} less {dark.exposure}, over the level",
            )
        )
    return found


def _in_electrons(
    value: float | None, error: float | None, gain: Estimate, power: int = 1
) -> tuple[float | None, float | None]:
    """Return a value over a power of the gain, and its error: the gain is uncertain, too."""
    if value is None or error is None:
        return None, None
    scale, relative = gain.value**power, power * gain.standard_error / gain.value
    return value / scale, float(np.hypot(error / scale, value / scale * relative))


def _root(square: float, error: float) -> tuple[float | None, float | None]:
    """Return the root of a variance and its error; None where noise left less than nothing."""
    if square <= 0:
        return None, None
    return float(np.sqrt(square)), float(error / (2 * np.sqrt(square)))


def _dark_current(darks: Sequence[LevelStatistics], gain: Estimate) -> list[Quantity]:
    times = column(darks, "exposure_time_s")
    line = dark_line(times, column(darks, "level_dn"), column(darks, "level_se_dn"))
    if line.current_dn_per_s is None or line.current_se_dn_per_s is None:
        return []
    noise = dark_line(times, column(darks, "variance_dn2"), column(darks, "variance_se_dn2"))
    in_dn = line.current_dn_per_s, line.current_se_dn_per_s
    means = "growth of the dark mean with exposure time"
    grown = _in_electrons(noise.current_dn_per_s, noise.current_se_dn_per_s, gain, 2)
    of_noise = "growth of the dark variance with exposure time, over K^2"
    return [
        Quantity("mu_I.mean", "DN/s", *in_dn, means),
        Quantity("mu_I.mean", "e-/s", *_in_electrons(*in_dn, gain), means),
        Quantity("mu_I.var", "e-/s", *grown, of_noise),
    ]
