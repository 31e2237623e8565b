"""Few warm pixels of a mosaic are named, by the law of pixels and not by their kurtosis."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import pytest
from planter import Choice, draw_case, plant
from planter.case import Effect as Planted

from analysis.mismatch import find_mismatch
from dsis.camera import read_camera
from dsis.recording import read_recording

pytestmark = pytest.mark.usefixtures("unproven")

WORDS = frozenset({"hot_pixels", "dsnu", "dark_current", "rts", "amp_glow", "impulse", "prnu"})


def test_a_handful_of_warm_pixels_is_named(tmp_path: Path) -> None:
    choice = Choice(cfa="GRBG", segments=1, light=True, times="darks")
    case = draw_case(4, "small", choice)
    noise = case.segments[0].intercept ** 0.5
    times = [one.exposure_time_s for one in case.exposures if one.kind == "dark"]
    rate = 2.5 * noise / max(times)  # in a mean of eight frames, seven standard deviations
    own = {"pixel_fraction": 0.002, "mean_dn_per_s": rate}
    plant(tmp_path, case.having(Planted("hot_pixels", own)))
    camera = read_camera(tmp_path / "camera.toml")
    found = find_mismatch(camera, read_recording(tmp_path), seed=1, vocabulary=WORDS)
    (named,) = found.omitted_physics
    assert named.effect == "hot_pixels"
    for name, value in own.items():
        fitted = named.parameters[name]
        assert isinstance(fitted.value, float)
        assert abs(fitted.value - value) < 3 * fitted.standard_error
        assert fitted.standard_error < value
    assert not found.unexplained
