"""The optical transfer function against foreign derivations, and what it does to pictures."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from cinema import CINEMA
from dsis.errors import InputError
from dsis.model import structure
from dsis.optics import (
    Optics,
    aperture_otf,
    diffraction_otf,
    low_pass_otf,
    through_optics,
    transfer,
)

NYQUIST_PER_MM = 1000.0 / (2.0 * 8.25)
# Of unit amplitudes after a float32 Fourier transform of some 10^4 samples: 10 roundings of 6e-8
# in the mean, a few times that in the worst pixel.
FLOAT32_TRANSFORM = 5e-6

# Periods of 16 samples on 49: the reflected margin continues the wave, and 49 + 2 x 44 samples
# are transformed as 144 = 9 x 16, so that the wave is periodic and the prediction exact.
SIDE, PERIOD, MARGIN = 49, 16, 44


def overlap_of_pupils(frequency_per_mm: float, f_number: float, wavelength_nm: float) -> float:
    """Autocorrelation of a circular pupil: area shared by two discs of radius 1, over one disc."""
    half_distance = frequency_per_mm * wavelength_nm * 1e-6 * f_number
    if half_distance >= 1.0:
        return 0.0
    cap, _ = quad(lambda x: 2.0 * math.sqrt(1.0 - x * x), half_distance, 1.0, epsabs=1e-12)
    return 2.0 * cap / math.pi


def spectrum_of_points(fy: float, fx: float, points_yx: list[tuple[float, float]]) -> complex:
    """Fourier transform of equal point masses that sum to 1."""
    return sum(np.exp(-2j * math.pi * (fy * y + fx * x)) for y, x in points_yx) / len(points_yx)


def spectrum_of_box(fy: float, fx: float, width: float) -> complex:
    """Fourier transform of a uniform square of unit mass, as 400 x 400 points."""
    at = (np.arange(400) + 0.5) / 400 * width - width / 2
    along_y, along_x = (np.exp(-2j * math.pi * f * at).mean() for f in (fy, fx))
    return complex(along_y * along_x)


def expected_gain(optics: Optics, fy_per_px: float, fx_per_px: float) -> float:
    fy, fx = fy_per_px / optics.pitch_um, fx_per_px / optics.pitch_um
    d = optics.low_pass_spot_separation_px * optics.pitch_um / 2
    spots = [(y, x) for y in (-d, d) for x in (-d, d)]
    width = optics.pitch_um * math.sqrt(optics.fill_factor)
    lens = overlap_of_pupils(1e3 * math.hypot(fy, fx), optics.f_number, optics.wavelength_nm)
    return lens * (spectrum_of_points(fy, fx, spots) * spectrum_of_box(fy, fx, width)).real


def wave(cycles_y: int, cycles_x: int, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Cosines of whole numbers of cycles per 16 samples, moved by `shift` samples."""
    at = 2.0 * math.pi / PERIOD * np.arange(SIDE)
    angle = 2.0 * math.pi / PERIOD
    down = np.cos(cycles_y * (at - angle * shift[0]))
    right = np.cos(cycles_x * (at - angle * shift[1]))
    return (down[:, None] * right[None, :])[:, :, None].astype(np.float32)


@pytest.mark.parametrize("frequency_per_mm", [0.0, 10.0, NYQUIST_PER_MM, 200.0, 500.0])
def test_diffraction_is_the_autocorrelation_of_the_pupil(frequency_per_mm: float) -> None:
    found = diffraction_otf(np.array(frequency_per_mm), 5.6, 550.0)
    assert float(found) == pytest.approx(overlap_of_pupils(frequency_per_mm, 5.6, 550.0), abs=1e-10)


@pytest.mark.parametrize(
    ("f_number", "published"),
    [(2.8, 0.881), (4.0, 0.831), (5.6, 0.764), (8.0, 0.665), (11.0, 0.544), (16.0, 0.355)],
)
def test_diffraction_at_nyquist_of_8_25_um(f_number: float, published: float) -> None:
    found = float(diffraction_otf(np.array(NYQUIST_PER_MM), f_number, 550.0))
    assert found == pytest.approx(published, abs=6e-4)  # three printed decimals


@pytest.mark.parametrize(
    ("fy", "fx"), [(0.0, 0.0), (0.0, 0.03), (0.06, 0.0), (0.05, 0.06), (0.11, -0.02)]
)
def test_low_pass_is_the_spectrum_of_four_points(fy: float, fx: float) -> None:
    d = 6.2
    spots = [(y, x) for y in (-d / 2, d / 2) for x in (-d / 2, d / 2)]
    found = float(low_pass_otf(np.array(fx), np.array(fy), d))
    assert found == pytest.approx(spectrum_of_points(fy, fx, spots), abs=1e-12)


def test_low_pass_at_nyquist() -> None:
    at = np.array(0.5 / 8.25)
    zero = np.array(0.0)
    assert float(low_pass_otf(at, zero, 8.25)) == pytest.approx(0.0, abs=1e-12)
    assert float(low_pass_otf(at, zero, 0.75 * 8.25)) == pytest.approx(0.383, abs=6e-4)
    assert float(low_pass_otf(at, at, 0.0)) == 1.0


@pytest.mark.parametrize(
    ("fy", "fx"), [(0.0, 0.0), (0.0, 0.03), (0.0606, 0.0), (0.05, 0.06), (0.2, -0.15)]
)
def test_aperture_is_the_spectrum_of_a_square(fy: float, fx: float) -> None:
    found = float(aperture_otf(np.array(fx), np.array(fy), 8.25))
    # The square's 400 points are a midpoint rule: relative error (pi f w / 400)^2 / 24 each way.
    assert found == pytest.approx(spectrum_of_box(fy, fx, 8.25), abs=1e-5)


def test_aperture_at_nyquist_is_two_over_pi() -> None:
    found = float(aperture_otf(np.array(0.5 / 8.25), np.array(0.0), 8.25))
    assert found == pytest.approx(2.0 / math.pi)


@settings(max_examples=50)
@given(
    fy=st.floats(-1.0, 1.0),
    fx=st.floats(-1.0, 1.0),
    separation=st.floats(0.0, 1.5),
    fill=st.floats(0.1, 1.0),
)
def test_transfer_is_the_product(fy: float, fx: float, separation: float, fill: float) -> None:
    optics = CINEMA.model_copy(
        update={"low_pass_spot_separation_px": separation, "fill_factor": fill}
    )
    found = float(transfer(optics, np.array(fy), np.array(fx)))
    assert found == pytest.approx(expected_gain(optics, fy, fx), abs=2e-5)  # the square's points


def test_gain_at_zero_is_exactly_one() -> None:
    assert float(transfer(CINEMA, np.array(0.0), np.array(0.0))) == 1.0


@pytest.mark.parametrize("cycles", [(0, 1), (1, 3), (5, 2), (7, 0), (4, 8)])
@pytest.mark.parametrize("oversampling", [1, 2])
def test_a_wave_is_attenuated_as_predicted(cycles: tuple[int, int], oversampling: int) -> None:
    image = wave(*cycles)
    seen = through_optics(image, CINEMA, oversampling, margin_px=MARGIN // oversampling)
    gain = expected_gain(CINEMA, *(oversampling * c / PERIOD for c in cycles))
    np.testing.assert_allclose(seen, gain * image, atol=2e-5)  # the square's 400 points


@pytest.mark.parametrize("shift_px", [(0.5, 0.0), (0.0, -0.5), (0.25, 0.5), (-1.3, 2.7)])
@pytest.mark.parametrize("oversampling", [1, 2])
def test_a_shift_by_parts_of_a_pixel(shift_px: tuple[float, float], oversampling: int) -> None:
    still = through_optics(wave(3, 5), CINEMA, oversampling, margin_px=MARGIN // oversampling)
    moved = through_optics(
        wave(3, 5), CINEMA, oversampling, shift_px=shift_px, margin_px=MARGIN // oversampling
    )
    gain = still[0, 0, 0]  # the wave's value there is 1
    expected = gain * wave(3, 5, (oversampling * shift_px[0], oversampling * shift_px[1]))
    np.testing.assert_allclose(moved, expected, atol=FLOAT32_TRANSFORM)


@settings(max_examples=20, deadline=None)  # the first transform of a size plans it
@given(
    rows=st.integers(11, 40),  # more than the longest shift, 5 pixels of 2 samples
    columns=st.integers(11, 40),
    down=st.integers(-5, 5),
    right=st.integers(-5, 5),
    oversampling=st.integers(1, 2),
)
def test_a_shift_by_whole_pixels_is_a_roll(
    rows: int, columns: int, down: int, right: int, oversampling: int
) -> None:
    rng = np.random.default_rng([rows, columns])
    image = rng.random((rows, columns, 2), dtype=np.float32)
    still = through_optics(image, CINEMA, oversampling)
    moved = through_optics(image, CINEMA, oversampling, shift_px=(down, right))
    down, right = down * oversampling, right * oversampling
    rolled = np.roll(still, (down, right), (0, 1))
    inside = (
        slice(max(down, 0), rows + min(down, 0)),
        slice(max(right, 0), columns + min(right, 0)),
    )
    np.testing.assert_allclose(moved[inside], rolled[inside], atol=FLOAT32_TRANSFORM)


@settings(max_examples=20, deadline=None)  # the first transform of a size plans it
@given(
    rows=st.integers(1, 70),
    columns=st.integers(1, 70),
    value=st.floats(0.0, 1e4, width=32),
    oversampling=st.integers(1, 3),
)
def test_a_uniform_picture_stays(rows: int, columns: int, value: float, oversampling: int) -> None:
    image = np.full((rows, columns, 1), value, np.float32)
    seen = through_optics(image, CINEMA, oversampling, shift_px=(0.3, -0.7))
    assert seen.dtype == np.float32
    np.testing.assert_allclose(seen, image, rtol=FLOAT32_TRANSFORM)


def test_the_finest_wave_moved_by_half_its_sample_vanishes() -> None:
    """Samples cannot hold (-1)^i cos(x) half a sample on: they lie where it is 0."""
    row, column = np.indices((64, 64))
    finest = np.where(row % 2 == 0, 0.5, -0.5) * np.cos(2 * np.pi * column / 8)
    image = (1 + finest).astype(np.float32)[..., np.newaxis]
    still = through_optics(image, CINEMA)[16:48, 16:48]
    assert still.max() > 1.05
    for shift_px in ((0.5, 0.0), (0.5, 0.25)):
        moved = through_optics(image, CINEMA, shift_px=shift_px)[16:48, 16:48]
        np.testing.assert_allclose(moved, 1, atol=1e-3)  # the ends of the wave along the row


def test_opposite_edges_do_not_leak_into_each_other() -> None:
    image = np.zeros((40, 60, 1), np.float32)
    image[:, 0] = 1.0
    seen = through_optics(image, CINEMA)
    near, far = seen[:, 1].max(), np.abs(seen[:, -10:]).max()
    assert near > 0.1
    # A kink of the OTF makes tails of (jump of its slope) / (2 pi x)^2 at a distance x: 0.95 for
    # the lens at frequency 0, less than 4 where sampling folds the slope at Nyquist.
    assert far < (0.95 + 4.0) / (2.0 * math.pi * 50.0) ** 2


def test_workers_do_not_change_a_byte() -> None:
    image = np.random.default_rng(5).random((121, 75, 3), dtype=np.float32)
    alone = through_optics(image, CINEMA, 2, shift_px=(0.2, 0.4))
    for workers in (2, 3):
        together = through_optics(image, CINEMA, 2, shift_px=(0.2, 0.4), workers=workers)
        assert together.tobytes() == alone.tobytes()


def test_a_shift_beyond_the_margin_is_refused() -> None:
    with pytest.raises(ValueError, match="margin_px = 4"):
        through_optics(wave(1, 1), CINEMA, shift_px=(0.0, 4.5), margin_px=4)


def test_wrong_values_are_refused_all_at_once() -> None:
    wrong = {
        "f_number": 0.0,
        "wavelength_nm": -550.0,
        "low_pass_spot_separation_px": -0.1,
        "fill_factor": 1.5,
        "aperture": 2.0,
    }
    with pytest.raises(InputError) as refused:
        structure(Optics, wrong, "test.toml", "optics")
    keys = {fault.key for fault in refused.value.faults}
    assert keys == {
        "optics.f_number",
        "optics.wavelength_nm",
        "optics.pitch_um",
        "optics.low_pass_spot_separation_px",
        "optics.fill_factor",
        "optics.aperture",
    }
