"""Greens that differ: named as what is seen, with the amplifiers that could have made them."""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import pytest
from planter import Choice, draw_case, plant
from planter.case import Effect as Planted

from analysis.mismatch import Finding, find_mismatch
from analysis.mismatch.diagnose import VOCABULARY
from dsis.camera import read_camera
from dsis.recording import read_recording

pytestmark = pytest.mark.usefixtures("unproven")

WORDS = frozenset({"channel_imbalance", "tap_mismatch", "shading", "row_fpn", "row_prnu"})


def _found(folder: Path, planted: Planted, words: frozenset[str] = WORDS) -> Finding:
    choice = Choice(cfa="GRBG", segments=1, light=True, times="darks")
    case = draw_case(4, "small", choice)
    few = tuple(one for one in case.exposures if one.name not in {"flat-1", "flat-3"})
    plant(folder, replace(case, rows=64, columns=96, exposures=few).having(planted))
    camera = read_camera(folder / "camera.toml")
    return find_mismatch(camera, read_recording(folder), seed=1, vocabulary=words)


def test_greens_that_differ_are_named_and_amplifiers_are_their_alternative(tmp_path: Path) -> None:
    found = _found(tmp_path, Planted("channel_imbalance", {"gain_percent": -0.56}))
    (named,) = found.omitted_physics
    assert named.effect == "channel_imbalance"
    fitted = named.parameters["gain_percent"]
    assert isinstance(fitted.value, float)
    assert abs(abs(fitted.value) - 0.56) < 3 * fitted.standard_error
    (other,) = (one for one in named.alternatives if one.effect == "tap_mismatch")
    assert other.would_settle
    assert not found.undecided


def test_greens_that_differ_are_no_amplifiers_where_they_have_no_word(tmp_path: Path) -> None:
    words = VOCABULARY - {"channel_imbalance"}
    found = _found(tmp_path, Planted("channel_imbalance", {"gain_percent": 0.56}), words)
    assert not found.omitted_physics
    assert "channel_ratio" in {one.statistic for one in found.unexplained}


@pytest.mark.long
def test_amplifiers_whose_noise_tells_them_are_no_greens_that_differ(tmp_path: Path) -> None:
    """Gains that differ by a sixth scale the noise with the signal: light does not."""
    taps = Planted("tap_mismatch", {"gain_percent": 17.0, "regions": "even_odd_rows"})
    found = _found(tmp_path, taps)
    (named,) = found.omitted_physics
    assert named.effect == "tap_mismatch"
    assert named.choices["regions"] == "even_odd_rows"
