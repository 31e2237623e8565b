"""Optics of a cinema camera, as tests use them: f/5.6 and a weak optical low-pass."""

from dsis.optics import Optics

CINEMA = Optics(
    f_number=5.6,
    wavelength_nm=550.0,
    pitch_um=8.25,
    low_pass_spot_separation_px=0.75,
    fill_factor=1.0,
)
