"""Promise: EMVA 1288's figures agree with the emva1288 package on a real recording to 1 %.

The package's values (1.0.2, its release 4.0 of the standard's text, on EMVA1288/datasets reference
set 001) are written down here; `benchmarks/emva1288_comparison.py` runs it anew beside ours.
"""

from pathlib import Path

import numpy as np
import pytest

from analysis.photon_transfer import Fit, fit_camera
from analysis.photon_transfer.emva1288 import figures_of_merit
from analysis.photon_transfer.statistics import LevelStatistics
from dsis.camera import read_camera
from dsis.recording import read_recording
from dsis.simulate import simulate_like

ONE_PERCENT = 0.01
Z_MAX = 5.0  # standard errors

PACKAGE = {
    ("K", "DN/e-"): 0.2800626,
    ("R", "DN/light"): 0.1267269,
    ("sigma_y.dark", "DN"): 3.073104,
    ("sigma_d", "e-"): 10.92440,
    ("DSNU1288", "e-"): 0.553188,
    ("DSNU1288", "DN"): 0.1549273,
    ("PRNU1288", "%"): 0.4327052,
    ("LE_min", "%"): -0.6157976,
    ("LE_max", "%"): 0.4804483,
    ("mu_e.sat", "e-"): 14007.88,
    ("mu_p.min", "light"): 25.3548,
    ("SNR_max", "1"): 118.3549,
    ("DR_dB", "dB"): 61.73397,
}


@pytest.fixture(scope="module")
def ccd(shared_data: Path) -> Fit:
    return fit_camera(read_recording(shared_data / "emva1288_ccd12" / "EMVA1288_Data.txt"))


@pytest.mark.parametrize("key", PACKAGE, ids=" ".join)
def test_figures_of_the_real_ccd(ccd: Fit, key: tuple[str, str]) -> None:
    found = {(q.name, q.unit): q.value for q in ccd.channels["MONO"].figures}
    assert found[key] == pytest.approx(PACKAGE[key], rel=ONE_PERCENT)


def test_errors_of_the_real_ccd_are_of_its_scatter(ccd: Fit) -> None:
    """Its levels lie off the lines by more than sampling; oracle: leave-one-out of each level.

    The jackknife knows no leverage beyond its own and no factor for few levels: within a third.
    """
    known = [level.statistics for level in ccd.levels]
    stated = {q.name: q.standard_error for q in ccd.channels["MONO"].figures}
    flats = [s for s in known if s.kind == "flat" and s.exposure != "flat-50"]  # the stack's twin
    inside = [s for s in flats if s.level_dn < 0.7 * max(s.level_dn for s in flats)]
    left = []
    for out in inside:
        figures = figures_of_merit([s for s in known if s.exposure != out.exposure])
        left.append([q.value for q in figures if q.name in ("K", "R")])
    jackknife = np.sqrt((len(left) - 1) * np.var(np.array(left, float), axis=0))
    assert [stated["K"], stated["R"]] == pytest.approx(jackknife, rel=1 / 3)


def test_what_is_wrong_with_the_real_ccd_is_said(ccd: Fit) -> None:
    assert len(ccd.segments.lines) == 1
    assert ccd.segments.scatter > 0
    assert any("not on straight lines" in remark for remark in ccd.remarks)
    assert any("white level" in remark for remark in ccd.remarks)
    assert not ccd.full_well_reached  # codes at 4095 are all that was seen
    assert "converter clips first" in ccd.full_well_means


def test_the_shipped_camera_is_that_fit(ccd: Fit) -> None:
    folder = Path(__file__).parents[1] / "stimuli_specs" / "cameras"
    shipped = read_camera(folder / "ccd12.toml")
    line = ccd.segments.lines[0]
    assert shipped.black_level == pytest.approx(ccd.black_dn, abs=0.01)
    assert shipped.noise.segment[0].slope == pytest.approx(line.slope_dn, rel=1e-3)
    assert shipped.noise.segment[0].intercept == pytest.approx(line.intercept_dn2, rel=1e-3)
    assert [effect.kind for effect in shipped.effect] == [e.kind for e in ccd.effects]
    for effect, fitted in zip(shipped.effect, ccd.effects, strict=True):
        value = getattr(effect, fitted.parameter)
        assert abs(value - fitted.value) < 0.1 * fitted.standard_error
    assert "CC BY-SA 3.0" in (folder / "ccd12.toml").read_text()


def test_fit_simulate_fit_gives_the_same_effects(
    ccd: Fit, shared_data: Path, tmp_path: Path
) -> None:
    """A new sensor of the same statistics: dark current and the pattern's parts come back."""
    like = read_recording(shared_data / "emva1288_ccd12" / "EMVA1288_Data.txt")
    again = fit_camera(simulate_like(ccd.camera, like, tmp_path / "made"))
    assert {effect.kind for effect in ccd.effects} == {
        "dark_current", "dsnu", "row_fpn", "column_fpn", "prnu",
    }  # fmt: skip
    for first, second in zip(ccd.effects, again.effects, strict=True):
        assert first.kind == second.kind
        error = np.hypot(first.standard_error, second.standard_error)
        assert abs(first.value - second.value) < Z_MAX * error, first.kind


def level(
    kind: str, seconds: float, mean: float, variance: float, **more: object
) -> LevelStatistics:
    values: dict[str, object] = {
        "exposure": f"{kind}-{seconds}",
        "kind": kind,
        "exposure_time_s": seconds,
        "light": 1e5 * seconds if kind == "flat" else None,
        "channel": "MONO",
        "frames": 2,
        "rows": 100,
        "columns": 100,
        "level_dn": mean,
        "level_se_dn": 1e-3,
        "variance_dn2": variance,
        "variance_se_dn2": 1e-3 * variance,
        "pair_variance_dn2": variance,
        "removed_dn2": 0.0,
        "frame_sd_dn": 0.0,
        "wander": 1.0,
        "kurtosis": 0.0,
        "clipped_low": 0.0,
        "clipped_high": 0.0,
        "fixed_dn2": 0.0,
        "fixed_se_dn2": 0.0,
        "repeated_frames": 0,
    }
    return LevelStatistics(**(values | more))  # type: ignore[arg-type]


def test_an_ideal_camera_has_its_closed_forms() -> None:
    """QE 0.5, K 0.4 DN/e-, sigma_d 5 e-, black 30 DN, dark current 50 e-/s, DSNU 2, PRNU 1 %."""
    levels, k, dark2 = [], 0.4, 0.4**2 * 25 + 1 / 12
    for seconds in np.linspace(0.01, 0.4, 20):
        current = 50 * float(seconds)
        electrons = 0.5 * 1e5 * float(seconds)
        more: dict[str, object] = {}
        if abs(seconds - 0.2) < 0.01:
            more = {"frames": 50, "fixed_dn2": (2 * k) ** 2}
        levels.append(
            level("dark", float(seconds), 30 + k * current, dark2 + k**2 * current, **more)
        )
        if more:
            more["fixed_dn2"] = (2 * k) ** 2 + (0.01 * k * electrons) ** 2
        total = current + electrons
        levels.append(level("flat", float(seconds), 30 + k * total, dark2 + k**2 * total, **more))
    found = {(q.name, q.unit): q.value for q in figures_of_merit(levels)}
    sigma = np.sqrt(dark2)
    expected = {
        ("K", "DN/e-"): k,
        ("QE", "e-/light"): 0.5,
        ("sigma_y.dark", "DN"): sigma,
        ("sigma_d", "e-"): 5.0,
        ("mu_p.min", "light"): (sigma / k + 0.5) / 0.5,
        ("mu_e.sat", "e-"): 0.5 * 4e4,
        ("SNR_max", "1"): np.sqrt(2e4),
        ("DR_stops", "stops"): np.log2(2e4 / (sigma / k + 0.5)),
        ("DSNU1288", "e-"): 2.0,
        ("PRNU1288", "%"): 1.0,
        ("mu_I.mean", "e-/s"): 50.0,
        ("mu_I.var", "e-/s"): 50.0,
    }
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, rel=1e-6), key
    for name in ("LE", "LE_min", "LE_max", "LE_half_range"):
        assert found[name, "%"] == pytest.approx(0.0, abs=1e-9)


def test_a_bent_response_has_the_linearity_error_of_its_bend() -> None:
    """Oracle: the relative deviations of numpy's weighted polyfit."""
    levels = []
    for seconds in np.linspace(0.01, 0.4, 20):
        electrons = 5e4 * float(seconds)
        signal = 0.4 * electrons * (1 - electrons / 1e6)
        levels.append(level("dark", float(seconds), 30.0, 4.0))
        levels.append(level("flat", float(seconds), 30 + signal, 4 + 0.4 * signal))
    found = {(q.name, q.unit): q.value for q in figures_of_merit(levels)}
    light = np.linspace(0.01, 0.4, 20) * 1e5
    y = 0.2 * light * (1 - 0.5 * light / 1e6)
    inside = (y >= 0.05 * y[-1]) & (y <= 0.95 * y[-1])
    slope, offset = np.polyfit(light[inside], y[inside], 1, w=1 / y[inside])
    deviation = 100 * (y / (slope * light + offset) - 1)[inside]
    assert found["LE_min", "%"] == pytest.approx(deviation.min(), rel=1e-6)
    assert found["LE_max", "%"] == pytest.approx(deviation.max(), rel=1e-6)
    assert found["LE", "%"] == pytest.approx(np.abs(deviation).mean(), rel=1e-6)


def test_nothing_is_stated_without_darks_or_flats() -> None:
    assert figures_of_merit([level("flat", 0.1, 500.0, 200.0)]) == ()
    assert figures_of_merit([level("dark", 0.1, 30.0, 4.0)]) == ()
