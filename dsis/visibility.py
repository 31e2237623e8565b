"""Visible noise energy: how much of a difference an eye sees at a given distance.

S-CIELAB: both pictures pass the eye's spatial filters in opponent colours, then CIELAB compares
them pixel by pixel (Zhang & Wandell, J. SID 5(1), 1997, 61-63), with the filters of Johnson &
Fairchild, "A top down description of S-CIELAB and CIEDE2000", Color Res. Appl. 28 (2003) 425-435,
in the frequency domain.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import fft

from dsis.model import Model


class Viewing(Model):
    """Viewing conditions: section `[viewing]` of a test spec.

    Attributes
    ----------
    diagonal_inch
        Diagonal of the display, inch; for the report, the energy does not depend on it.
    distance_heights
        Viewing distance in heights of the sequence, which is shown pixel for pixel: a sequence
        smaller than the display is watched from nearer.
    peak_cd_m2
        Luminance of display white, cd/m2; for the report: the filters are those of photopic
        vision, and CIELAB is relative to white.
    """

    diagonal_inch: float = Field(gt=0)
    distance_heights: float = Field(gt=0)
    peak_cd_m2: float = Field(gt=0)


@dataclass(frozen=True)
class VisibleNoise:
    """Mean square S-CIELAB difference of two pictures and its two parts.

    Attributes
    ----------
    lightness
        Mean of (Delta L*)^2: noise that looks grey.
    colour
        Mean of (Delta a*)^2 + (Delta b*)^2: noise that looks coloured. S-CIELAB's opponent
        channels are not orthogonal: of fine grey noise some part is counted here.
    """

    lightness: float
    colour: float

    @property
    def energy(self) -> float:
        """Mean of (Delta E*ab)^2."""
        return self.lightness + self.colour


def pixels_per_degree(viewing: Viewing, height_px: int) -> float:
    """Return the pixels in one degree at the centre of a picture of `height_px` rows."""
    return 2.0 * math.tan(math.radians(0.5)) * viewing.distance_heights * height_px


def contrast_sensitivity(
    frequency_cpd: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the sensitivities (luminance, red-green, blue-yellow) at cycles per degree >= 0.

    Luminance: f^0.8 exp(-0.2 f), relative to its peak at 4 cycles per degree (Movshon & Kiorpes).
    Chrominance: a1 exp(-b1 f^c1) + a2 exp(-b2 f^c2), relative to its value at 0. All in 0..1.
    """
    f = np.asarray(frequency_cpd, np.float64)
    peak_cpd = 0.8 / 0.2
    luminance = (f / peak_cpd) ** 0.8 * np.exp(-0.2 * (f - peak_cpd))
    red_green = 109.1413 * np.exp(-0.00038 * f**3.4244) + 93.5971 * np.exp(-0.00367 * f**2.1677)
    blue_yellow = 7.0328 * np.exp(-0.000004 * f**4.2582) + 40.6910 * np.exp(-0.1039 * f**1.6487)
    return luminance, red_green / (109.1413 + 93.5971), blue_yellow / (7.0328 + 40.6910)


@dataclass(frozen=True)
class Eye:
    """An eye at a fixed distance from pictures.

    Attributes
    ----------
    pixels_per_degree
        Of the visual field, see `pixels_per_degree`.
    """

    pixels_per_degree: float

    def seen(self, frame: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a display frame as S-CIELAB sees it: keep it to compare many frames with one.

        Parameters
        ----------
        frame
            Code values 0..1, float32 (row, column, 3), of a BT.1886 display without flare
            (light = value^2.4) with BT.709 primaries and white D65.

        Returns
        -------
        L*, a*, b* relative to display white, float32 (row, column, 3).
        """
        light = np.maximum(np.moveaxis(frame, 2, 0), np.float32(0.0)) ** np.float32(2.4)
        opponent = _mixed(_OPPONENT_FROM_RGB, light)
        filters = _filters(frame.shape[0], frame.shape[1], self.pixels_per_degree)
        # The cosine transform reflects the picture at its edges: no margin, no wrap-around.
        spectrum = fft.dctn(opponent, type=2, axes=(1, 2)) * filters
        opponent = fft.idctn(spectrum, type=2, axes=(1, 2), overwrite_x=True)
        return _lab(_mixed(_RELATIVE_XYZ_FROM_OPPONENT, opponent))

    def difference(
        self, test: NDArray[np.float32], seen_reference: NDArray[np.float32]
    ) -> VisibleNoise:
        """Return the visible difference of a display frame from what `seen` gave before."""
        square = np.square(self.seen(test) - seen_reference).mean(axis=(0, 1), dtype=np.float64)
        return VisibleNoise(lightness=float(square[0]), colour=float(square[1] + square[2]))


def visible_noise_energy(
    test: NDArray[np.float32], reference: NDArray[np.float32], viewing: Viewing
) -> float:
    """Return the mean over pixels of the squared S-CIELAB difference Delta E*ab.

    Parameters
    ----------
    test, reference
        Display frames as in `Eye.seen`, of the same shape.
    viewing
        The distance counts in heights of these frames.
    """
    eye = Eye(pixels_per_degree(viewing, reference.shape[0]))
    return eye.difference(test, eye.seen(reference)).energy


def _xyz_from_rgb() -> NDArray[np.float64]:
    """Return the matrix from linear BT.709 light to XYZ, white D65 having Y = 1."""
    x = np.array([0.640, 0.300, 0.150, 0.3127])
    y = np.array([0.330, 0.600, 0.060, 0.3290])
    xyz = np.stack([x / y, np.ones(4), (1.0 - x - y) / y])
    primaries, white = xyz[:, :3], xyz[:, 3]
    return np.asarray(primaries * np.linalg.solve(primaries, white))


# Luminance, red-green, blue-yellow of Poirson & Wandell, Vision Research 33 (1993), from XYZ of
# the 2 degree observer, as S-CIELAB uses them.
_OPPONENT_FROM_XYZ = np.array(
    [
        [0.2787336, 0.7218031, -0.1065520],
        [-0.4487736, 0.2898056, 0.0771569],
        [0.0859513, -0.5899859, 0.5011089],
    ]
)
_OPPONENT_FROM_RGB = (_OPPONENT_FROM_XYZ @ _xyz_from_rgb()).astype(np.float32)
_RELATIVE_XYZ_FROM_OPPONENT = (
    np.linalg.inv(_OPPONENT_FROM_XYZ) / _xyz_from_rgb().sum(axis=1)[:, np.newaxis]
).astype(np.float32)


@lru_cache(maxsize=2)
def _filters(rows: int, columns: int, pixels_per_degree: float) -> NDArray[np.float32]:
    """Return the gains of the three opponent channels at cosine frequencies (3, row, column).

    The luminance filter is held at 1 below its peak: S-CIELAB must leave large areas alone, and
    a band-pass would replace their lightness by the picture's mean. Johnson & Fairchild suggest
    so; Preiss, Fernandes & Urban (IEEE Trans. Image Process. 23(3), 2014) do the same.
    """
    fy = np.arange(rows)[:, np.newaxis] * (0.5 * pixels_per_degree / rows)
    fx = np.arange(columns)[np.newaxis, :] * (0.5 * pixels_per_degree / columns)
    frequency_cpd = np.hypot(fy, fx)
    luminance, red_green, blue_yellow = contrast_sensitivity(frequency_cpd)
    luminance[frequency_cpd <= 4.0] = 1.0
    gains = np.stack([luminance, red_green, blue_yellow]).astype(np.float32)
    gains.flags.writeable = False
    return gains


def _mixed(matrix: NDArray[np.float32], planes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return matrix times planes (3, row, column), in an order of sums that no library changes."""
    red, green, blue = planes
    return np.stack([r * red + g * green + b * blue for r, g, b in matrix])


def _lab(relative_xyz: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return CIE 1976 L*, a*, b* (row, column, 3) of X/Xn, Y/Yn, Z/Zn (3, row, column)."""
    knee = np.float32((6.0 / 29.0) ** 3)
    linear = relative_xyz * np.float32(841.0 / 108.0) + np.float32(4.0 / 29.0)
    fx, fy, fz = np.where(relative_xyz > knee, np.cbrt(relative_xyz), linear)
    return np.stack([116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)], axis=-1)
