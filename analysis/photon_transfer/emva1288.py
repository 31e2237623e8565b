"""EMVA 1288's figures of merit of one channel, by the standard's own definitions.

Release 3.1: gain and responsivity are unweighted lines through the origin up to 70 % of saturation,
saturation is the level of the largest temporal variance, non-uniformities come without a spatial
high-pass. They describe what was measured; the camera model is fitted apart from them
(`segments`), with weights, black level and all levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.photon_transfer.black import dark_line
from analysis.photon_transfer.quantity import Quantity
from analysis.photon_transfer.rounding import SHEPPARD_DN2
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.recording.hygiene import CLIPPED_SHARE

Floats = NDArray[np.float64]

SENSITIVITY_END = 0.7  # of saturation: gain and responsivity
LINEARITY_RANGE = (0.05, 0.95)  # of saturation: linearity error
LEAST_STACK = 4  # frames from which a fixed pattern is worth stating


@dataclass(frozen=True)
class _Response:
    """Flats above their darks, ascending in level; light in its own unit or seconds."""

    light: Floats | None
    light_unit: str
    level_dn: Floats
    variance_dn2: Floats
    saturation: int
    turned_over: bool

    @property
    def sensitive(self) -> slice:
        """Levels from the darkest to 70 % of saturation."""
        below = np.flatnonzero(self.level_dn <= SENSITIVITY_END * self.level_dn[self.saturation])
        return slice(0, int(below.max()) + 1) if below.size else slice(0, 1)


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
    response = _response(flats, darks)
    gain, gain_se = _through_origin(
        response.level_dn[response.sensitive], response.variance_dn2[response.sensitive]
    )
    if not gain > 0:
        return ()
    dark_variance, dark_variance_se, dark_means = _dark_noise(darks)
    found = [
        Quantity("K", "DN/e-", gain, gain_se, "line through the origin, to 70 % of saturation"),
        Quantity("1/K", "e-/DN", 1 / gain, gain_se / gain**2, "inverse of K"),
    ]
    sigma = float(np.sqrt(max(dark_variance, 0.0)))
    sigma_se = dark_variance_se / (2 * sigma) if sigma else np.nan
    found.append(Quantity("sigma_y.dark", "DN", sigma, sigma_se, dark_means))
    dark_electrons = float(np.sqrt(max(dark_variance - SHEPPARD_DN2 * step_dn**2, 0.0))) / gain
    found.append(
        Quantity(
            "sigma_d",
            "e-",
            dark_electrons,
            _ratio_se(dark_electrons, (sigma_se, sigma), (gain_se, gain)),
            "sqrt(sigma_y.dark^2 - 1/12) / K",
        )
    )
    found += _sensitivity(response, gain, gain_se, sigma)
    found += _linearity(response)
    found += _non_uniformity(flats, darks, response, gain)
    found += _dark_current(darks, gain)
    return tuple(_with_known_error(quantity) for quantity in found)


def _with_known_error(quantity: Quantity) -> Quantity:
    """Return a figure whose error is None where one level, or noise of nought, tells none."""
    error = quantity.standard_error
    return (
        quantity if error is None or np.isfinite(error) else replace(quantity, standard_error=None)
    )


def _response(flats: Sequence[LevelStatistics], darks: Sequence[LevelStatistics]) -> _Response:
    mean, variance = [], []
    line = dark_line(*_columns(darks, "level_dn", "level_se_dn"))
    noise = dark_line(*_columns(darks, "variance_dn2", "variance_se_dn2"))
    for flat in flats:
        same = [d for d in darks if d.exposure_time_s == flat.exposure_time_s]
        # Darks of the same time; else the line through all darks.
        dark = np.mean([d.level_dn for d in same]) if same else line.at(flat.exposure_time_s)
        dark2 = np.mean([d.variance_dn2 for d in same]) if same else noise.at(flat.exposure_time_s)
        mean.append(flat.level_dn - float(dark))
        variance.append(flat.variance_dn2 - float(dark2))
    level, light, unit = np.array(mean), None, "light"
    if all(f.light is not None for f in flats):
        light = np.array([f.light for f in flats], float)
    elif len({f.exposure_time_s for f in flats}) > 2:
        light, unit = np.array([f.exposure_time_s for f in flats]), "s"
    top = int(np.argmax(variance))
    # Beyond the largest variance there must be a level that the converter does not clip.
    turned = any(flat.clipped_high <= CLIPPED_SHARE for flat in flats[top + 1 :])
    return _Response(light, unit, level, np.array(variance), top, turned)


def _columns(
    darks: Sequence[LevelStatistics], value: str, error: str
) -> tuple[list[float], list[float], list[float]]:
    return (
        [d.exposure_time_s for d in darks],
        [getattr(d, value) for d in darks],
        [getattr(d, error) for d in darks],
    )


def _through_origin(x: Floats, y: Floats) -> tuple[float, float]:
    """Return the unweighted slope through the origin and its error, from the scatter."""
    square = float((x**2).sum())
    if square <= 0:
        return np.nan, np.nan
    slope = float((x * y).sum()) / square
    if x.size < 2:
        return slope, np.nan
    left = y - slope * x
    error = np.sqrt(float((x**2 * left**2).sum()) * x.size / (x.size - 1)) / square
    return slope, float(error)


def _ratio_se(value: float, *parts: tuple[float, float]) -> float:
    """Return the error of a product or ratio of independent (error, value)."""
    return abs(value) * float(np.sqrt(sum((e / v) ** 2 for e, v in parts if v)))


def _dark_noise(darks: Sequence[LevelStatistics]) -> tuple[float, float, str]:
    times = np.array([d.exposure_time_s for d in darks])
    variance = np.array([d.variance_dn2 for d in darks])
    if len(set(times.tolist())) > 2:
        design = np.stack([np.ones_like(times), times / times.max()], 1)
        solution, *_ = np.linalg.lstsq(design, variance, rcond=None)
        left = variance - design @ solution
        spread = float((left**2).sum()) / max(times.size - 2, 1)
        error = np.sqrt(np.linalg.inv(design.T @ design)[0, 0] * spread)
        return float(solution[0]), float(error), "dark variance at zero exposure time, square root"
    error = np.sqrt(sum(d.variance_se_dn2**2 for d in darks)) / len(darks)
    return float(variance.mean()), float(error), "square root of the mean dark variance"


def _sensitivity(response: _Response, gain: float, gain_se: float, sigma: float) -> list[Quantity]:
    part, top = response.sensitive, response.saturation
    least = sigma / gain + 0.5
    full = float(response.level_dn[top]) / gain
    found = []
    if response.light is not None and response.light_unit == "light":
        slope, slope_se = _through_origin(response.light[part], response.level_dn[part])
        efficiency = slope / gain
        full = efficiency * float(response.light[top])
        found = [
            Quantity("R", "DN/light", slope, slope_se, "responsivity, to 70 % of saturation"),
            Quantity(
                "QE",
                "e-/light",
                efficiency,
                _ratio_se(efficiency, (slope_se, slope), (gain_se, gain)),
                "R / K: quantum efficiency where light is photons per pixel",
            ),
            Quantity(
                "mu_p.min", "light", least / efficiency, None, "(sigma_y.dark / K + 1/2) / QE"
            ),
            Quantity("mu_p.sat", "light", float(response.light[top]), None, "light at saturation"),
        ]
    relative = gain_se / gain
    means = "full well: at the largest variance"
    if not response.turned_over:
        means += "; lower limit: no unclipped level lies beyond it"
    snr = float(np.sqrt(full))
    ratio = full / least
    return [
        *found,
        Quantity("mu_e.min", "e-", least, least * relative, "absolute sensitivity threshold"),
        Quantity("mu_e.sat", "e-", full, full * relative, means),
        Quantity("SNR_max", "1", snr, snr * relative / 2, "sqrt(mu_e.sat)"),
        Quantity("SNR_max_dB", "dB", 20 * np.log10(snr), 4.343 * relative, "20 log10 SNR_max"),
        Quantity("DR", "1", ratio, None, "mu_e.sat / mu_e.min"),
        Quantity("DR_dB", "dB", 20 * np.log10(ratio), None, "20 log10 DR"),
        Quantity("DR_stops", "stops", np.log2(ratio), None, "log2 DR"),
    ]


def _linearity(response: _Response) -> list[Quantity]:
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
    response: _Response,
    gain: float,
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
        for unit, scale in (("e-", gain), ("DN", 1.0)):
            value, error = _root(dark.fixed_dn2, dark.fixed_se_dn2)
            found.append(
                Quantity(
                    "DSNU1288",
                    unit,
                    None if value is None else value / scale,
                    None if error is None else error / scale,
                    f"fixed pattern of {dark.exposure}, {dark.frames} frames",
                )
            )
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


def _root(square: float, error: float) -> tuple[float | None, float | None]:
    """Return the root of a variance and its error; None where noise left less than nothing."""
    if square <= 0:
        return None, None
    return float(np.sqrt(square)), float(error / (2 * np.sqrt(square)))


def _dark_current(darks: Sequence[LevelStatistics], gain: float) -> list[Quantity]:
    line = dark_line(*_columns(darks, "level_dn", "level_se_dn"))
    if line.current_dn_per_s is None or line.current_se_dn_per_s is None:
        return []
    noise = dark_line(*_columns(darks, "variance_dn2", "variance_se_dn2"))
    found = [
        Quantity(
            "mu_I.mean",
            unit,
            line.current_dn_per_s / scale,
            line.current_se_dn_per_s / scale,
            "growth of the dark mean with exposure time",
        )
        for unit, scale in (("DN/s", 1.0), ("e-/s", gain))
    ]
    if noise.current_dn_per_s is not None and noise.current_se_dn_per_s is not None:
        found.append(
            Quantity(
                "mu_I.var",
                "e-/s",
                noise.current_dn_per_s / gain**2,
                noise.current_se_dn_per_s / gain**2,
                "growth of the dark variance with exposure time, over K^2",
            )
        )
    return found
