"""Black level of a camera model: what darks of one sensor say of all sensors of its make."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from analysis.photon_transfer.black import DarkLine
from analysis.photon_transfer.parts import Pattern
from analysis.photon_transfer.remarks import DIFFERENT_P

_SHARING_ROWS = (("MONO",), ("R", "Gr"), ("B", "Gb"))
_SHARING_COLUMNS = (("MONO",), ("R", "Gb"), ("B", "Gr"))


@dataclass(frozen=True)
class BlackLevel:
    """Black level over all channels, DN.

    Attributes
    ----------
    level_dn
        Mean of the channels' by their errors; the nominal one without darks.
    se_dn
        Its error as that of all sensors: temporal noise and fixed pattern; None without darks.
    noise_se_dn
        Its error as this sensor's: temporal noise alone.
    """

    level_dn: float
    se_dn: float | None
    noise_se_dn: float | None


def black_level(
    nominal_dn: float,
    darks: Mapping[str, DarkLine | None],
    patterns: Mapping[str, Pattern],
    remarks: list[str],
    why: str = "",
) -> BlackLevel:
    """Return the black level; what limits it is added to `remarks`.

    Parameters
    ----------
    nominal_dn
        The pedestal that the recording states.
    darks
        The dark line of each channel.
    patterns
        The fixed pattern of each channel's mean dark, at the darks' mean exposure time: where dark
        current differs by pixel, it makes the error an upper bound.
    remarks
        What is to be said.
    why
        Why there is no pattern, where there is none.
    """
    known = {name: dark for name, dark in darks.items() if dark is not None}
    if not known:
        remarks.append(
            f"No usable darks: the black level is the nominal {nominal_dn:g} DN, unchecked; an "
            "error of it moves every intercept by slope times the error."
        )
        return BlackLevel(nominal_dn, None, None)
    if set(known) - set(patterns):
        remarks.append(
            f"The fixed pattern of the darks was not measured ({why}): the black level's error is "
            "temporal noise alone."
        )
        fixed = dict.fromkeys(known, 0.0)
    else:
        fixed = {name: patterns[name].mean_variance for name in known}
    value = np.array([dark.black_dn for dark in known.values()])
    noise = np.array([dark.black_se_dn**2 for dark in known.values()])
    weight = 1 / (noise + np.array(list(fixed.values())))
    misfit = float((weight * (value - (weight @ value) / weight.sum()) ** 2).sum())
    weight /= weight.sum()
    noise_square = float(weight**2 @ noise)
    shares = dict(zip(known, weight.tolist(), strict=True))
    square = noise_square + (_fixed_square(shares, patterns) if any(fixed.values()) else 0.0)
    if len(known) > 1 and stats.chi2.sf(misfit, len(known) - 1) < DIFFERENT_P:
        factor = misfit / (len(known) - 1)
        square, noise_square = square * factor, noise_square * factor
        remarks.append(
            f"The channels' black levels differ by up to {np.ptp(value):.3g} DN, more than chance: "
            "each channel's own is used for its levels, the model has their mean."
        )
    return BlackLevel(float(weight @ value), float(np.sqrt(square)), float(np.sqrt(noise_square)))


def _fixed_square(weights: Mapping[str, float], patterns: Mapping[str, Pattern]) -> float:
    """Return the variance, over sensors, of a weighted mean of the channels' black levels.

    Every pixel has an offset of its own; a row's is common to the channels that share the row, a
    column's to those that share the column. The channels' parts are pooled.
    """
    rows, columns = next(iter(patterns.values())).estimate.shape
    pixel, row, column = (
        float(np.mean([getattr(pattern, kind).variance for pattern in patterns.values()]))
        for kind in ("pixel", "row", "column")
    )

    def shared(groups: tuple[tuple[str, ...], ...]) -> float:
        return sum(sum(weights.get(name, 0.0) for name in group) ** 2 for group in groups)

    alone = tuple((name,) for name in weights)
    square = pixel / (rows * columns) * shared(alone) + row / rows * shared(_SHARING_ROWS)
    # Each part is unbiased and may come out below zero; their sum may not.
    return max(float(square + column / columns * shared(_SHARING_COLUMNS)), 0.0)
