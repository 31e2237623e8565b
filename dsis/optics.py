"""From light on a fine grid to what the sensor samples: the optical transfer function (OTF).

Lens, optical low-pass filter and pixel aperture multiply in the Fourier domain, before sampling;
aliasing comes afterwards, with the slicing. Everything acts on linear light.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import fft

from dsis.model import Model

_ROWS_AT_ONCE = 128  # of the OTF, in double precision: bounds the memory


class Optics(Model):
    """What stands before the sampling: section `[optics]` of a test spec.

    Attributes
    ----------
    f_number
        Working f-number of an ideal, diffraction-limited lens.
    wavelength_nm
        Wavelength that stands for the whole spectrum, nm.
    pitch_um
        Distance of neighbouring pixels of the sensor, um.
    low_pass_spot_separation_px
        Distance of the four spots of the optical low-pass filter, in pixels; 0: no filter.
    fill_factor
        Light-sensitive share of a pixel's area, 0..1; the aperture is a centred square.
    """

    f_number: float = Field(gt=0)
    wavelength_nm: float = Field(gt=0)
    pitch_um: float = Field(gt=0)
    low_pass_spot_separation_px: float = Field(ge=0)
    fill_factor: float = Field(gt=0, le=1)


def diffraction_otf(
    frequency_per_mm: NDArray[np.float64], f_number: float, wavelength_nm: float
) -> NDArray[np.float64]:
    """Return the OTF of an aberration-free lens with a circular pupil, 1 at 0, never negative.

    (2/pi) (acos s - s sqrt(1 - s^2)) with s = frequency x wavelength x f-number, and 0 from s = 1
    on (Goodman, Introduction to Fourier Optics, section 6.3.2).
    """
    s = np.clip(np.abs(frequency_per_mm) * (wavelength_nm * 1e-6 * f_number), 0.0, 1.0)
    return np.asarray((np.arccos(s) - s * np.sqrt(1.0 - s * s)) * (2.0 / math.pi))


def low_pass_otf(
    fx: NDArray[np.float64], fy: NDArray[np.float64], spot_separation_um: float
) -> NDArray[np.float64]:
    """Return the OTF of a four-spot birefringent filter: cos(pi d fx) cos(pi d fy).

    Frequencies in cycles per um. Signed: beyond its first zero, 1/(2 d), contrast is reversed,
    and an oversampled image carries frequencies there.
    """
    d = math.pi * spot_separation_um
    return np.asarray(np.cos(d * fx) * np.cos(d * fy))


def aperture_otf(
    fx: NDArray[np.float64], fy: NDArray[np.float64], width_um: float
) -> NDArray[np.float64]:
    """Return the OTF of a square aperture: sin(pi w fx)/(pi w fx) times the same in y.

    Frequencies in cycles per um.
    """
    return np.asarray(np.sinc(width_um * fx) * np.sinc(width_um * fy))


def transfer(
    optics: Optics,
    frequency_y_per_px: NDArray[np.float64],
    frequency_x_per_px: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return lens x low-pass x aperture at frequencies in cycles per *sensor* pixel.

    The two arrays broadcast against each other. The result is real and even (all three factors
    are symmetric, so nothing moves), exactly 1 at 0.
    """
    fy, fx = frequency_y_per_px / optics.pitch_um, frequency_x_per_px / optics.pitch_um
    lens = diffraction_otf(np.hypot(fy, fx) * 1e3, optics.f_number, optics.wavelength_nm)
    low_pass = low_pass_otf(fx, fy, optics.low_pass_spot_separation_px * optics.pitch_um)
    aperture = aperture_otf(fx, fy, optics.pitch_um * math.sqrt(optics.fill_factor))
    return np.asarray(lens * low_pass * aperture)


def through_optics(
    image: NDArray[np.float32],
    optics: Optics,
    oversampling: int = 1,
    *,
    shift_px: tuple[float, float] = (0.0, 0.0),
    margin_px: int = 32,
    workers: int = 1,
) -> NDArray[np.float32]:
    """Return the light that reaches the photodiodes, on the grid of `image`.

    Sensor pixel (i, j) is centred on sample (i, j) * oversampling: the caller samples by slicing
    `[::oversampling, ::oversampling]`. A pan at whole fine steps needs this function once, for the
    whole panorama; its frames are slices.

    Parameters
    ----------
    image
        Linear light, float32 (row, column, channel), `oversampling` samples per sensor pixel.
    optics
        Lens, filter and aperture.
    oversampling
        Whole number >= 1.
    shift_px
        (down, right) by which the content moves, in sensor pixels: a whole fine step gives what
        `np.roll` gives. At most `margin_px`; what moves in is the reflected margin.
    margin_px
        Width of the reflected margin that keeps opposite edges apart, in sensor pixels.
    workers
        Threads of the Fourier transform; no influence on the result.

    Returns
    -------
    float32, same shape. The gain at frequency 0 is exactly 1: a uniform image stays as it is.

    Raises
    ------
    ValueError
        A shift beyond the margin.
    """
    if max(abs(step) for step in shift_px) > margin_px:
        message = f"shift_px is {shift_px}, must be at most margin_px = {margin_px}"
        raise ValueError(message)
    rows, columns = image.shape[:2]
    field = _Field.of(rows, columns, oversampling, margin_px)
    gain = field.gain(optics)
    phase_y, phase_x = field.phase_y(shift_px[0]), field.phase_x(shift_px[1])
    out = np.empty(image.shape, np.float32)
    for channel in range(image.shape[2]):
        spectrum = fft.rfft2(field.padded(image[:, :, channel]), workers=workers)
        spectrum *= gain
        if shift_px != (0.0, 0.0):
            spectrum *= phase_y
            spectrum *= phase_x
        size = (field.height, field.width)
        light = fft.irfft2(spectrum, s=size, workers=workers, overwrite_x=True)
        out[:, :, channel] = light[field.margin :, field.margin :][:rows, :columns]
    return out


@dataclass(frozen=True)
class Pan:
    """Light after the optics that may be looked at from any place along its rows.

    Holds the sampled rows as spectra along the row, so a window at any part of a pixel is a phase
    ramp and the way back, in one dimension. At a whole place it is a slice of `through_optics`.

    Attributes
    ----------
    spectra
        complex64 (channel, row of the sensor, frequency), after the optics.
    """

    spectra: NDArray[np.complex64]
    _field: "_Field"

    @classmethod
    def of(
        cls,
        image: NDArray[np.float32],
        optics: Optics,
        oversampling: int = 1,
        *,
        first_row: int = 0,
        margin_px: int = 32,
    ) -> "Pan":
        """Return the light of `image`, float32 (row, column, channel), in the sensor's rows.

        Sensor row i is centred on row first_row + i * oversampling; see `through_optics`.
        """
        rows, columns, channels = image.shape
        field = _Field.of(rows, columns, oversampling, margin_px)
        gain = field.gain(optics)
        first = field.margin + first_row
        sampled = slice(first, field.margin + rows, oversampling)
        kept = len(range(*sampled.indices(field.height)))
        spectra = np.empty((channels, kept, field.width // 2 + 1), np.complex64)
        for channel in range(channels):
            spectrum = fft.rfft2(field.padded(image[:, :, channel]))
            spectrum *= gain
            spectra[channel] = fft.ifft(spectrum, axis=0, overwrite_x=True)[sampled]
        return cls(spectra, field)

    def window(self, column: float, rows: int, columns: int) -> NDArray[np.float32]:
        """Return (rows, columns, channel) of the sensor, the first column centred on `column`.

        Parameters
        ----------
        column
            Place on the grid of the image, any fraction; the window must lie within the image.
        """
        field = self._field
        ramp = field.phase_x(-column / field.oversampling)
        first, step = field.margin, field.oversampling
        out = np.empty((rows, columns, len(self.spectra)), np.float32)
        for channel, spectra in enumerate(self.spectra):
            light = fft.irfft(spectra[:rows] * ramp, n=field.width, overwrite_x=True)
            out[:, :, channel] = light[:, first : first + step * columns : step]
        return out


@dataclass(frozen=True)
class _Field:
    """A picture with its reflected margin, as the Fourier transform sees it."""

    height: int
    width: int
    padding: tuple[tuple[int, int], tuple[int, int]]
    oversampling: int

    @classmethod
    def of(cls, rows: int, columns: int, oversampling: int, margin_px: int) -> "_Field":
        margin = margin_px * oversampling
        height, width = (fft.next_fast_len(n + 2 * margin, real=True) for n in (rows, columns))
        padding = ((margin, height - rows - margin), (margin, width - columns - margin))
        return cls(height, width, padding, oversampling)

    @property
    def margin(self) -> int:
        return self.padding[0][0]

    def padded(self, plane: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.pad(plane, self.padding, mode="reflect")

    def gain(self, optics: Optics) -> NDArray[np.float32]:
        fy, fx = self._fy(), self._fx()
        out = np.empty((self.height, fx.size), np.float32)
        for first in range(0, self.height, _ROWS_AT_ONCE):
            rows = slice(first, first + _ROWS_AT_ONCE)
            out[rows] = transfer(optics, fy[rows], fx)
        return out

    def phase_y(self, shift_px: float) -> NDArray[np.complex64]:
        return _shift_phase(self._fy(), shift_px, self.oversampling)

    def phase_x(self, shift_px: float) -> NDArray[np.complex64]:
        return _shift_phase(self._fx(), shift_px, self.oversampling)

    def _fy(self) -> NDArray[np.float64]:
        return np.asarray(fft.fftfreq(self.height)[:, np.newaxis] * self.oversampling)

    def _fx(self) -> NDArray[np.float64]:
        return np.asarray(fft.rfftfreq(self.width)[np.newaxis, :] * self.oversampling)


def _shift_phase(
    frequency_per_px: NDArray[np.float64], shift_px: float, oversampling: int
) -> NDArray[np.complex64]:
    """Return exp(-2 pi i f shift); real at the Nyquist frequency of an even grid.

    There +f and -f share one sample, so that only the mean of their two phases keeps images real.
    """
    angle = 2.0 * math.pi * frequency_per_px * shift_px
    phase = np.exp(-1j * angle)
    nyquist = np.abs(frequency_per_px) == 0.5 * oversampling
    return np.where(nyquist, np.cos(angle), phase).astype(np.complex64)
