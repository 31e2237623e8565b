"""The second simulator, which judges `dsis mismatch`: it keeps its own laws and tells no truth."""

import ast
import json
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dsis.camera import read_camera
from dsis.recording import read_recording

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from second.building import build  # noqa: E402
from second.cases import conceal, hand_values, seal  # noqa: E402
from second.chain import simulate  # noqa: E402
from second.charge import moved  # noqa: E402
from second.dealing import Hand, deal  # noqa: E402
from second.judging import COMPARABLE, judge  # noqa: E402
from second.oracles import ORACLES, z_of  # noqa: E402
from second.places import SHOWS, points_at  # noqa: E402
from second.prepared import Prepared, expected_variance  # noqa: E402
from second.strengths import DRAWS  # noqa: E402
from second.summary import figures, share, shortfalls  # noqa: E402
from second.vocabulary import LISTED, PARAMETERS, UNLISTED  # noqa: E402
from second.writing import words, write  # noqa: E402

NULL = Hand(0, (), None, wrong_number=False, known=False)
FIVE_SIGMA = 5.0


def test_it_shares_no_code_with_what_it_judges_or_with_the_other_planter() -> None:
    for path in (BENCHMARKS / "second").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [str(node.module)]
            roots = {name.split(".")[0] for name in names}
            assert not roots & {"dsis", "analysis", "planter"}, path.name


def test_every_effect_can_be_drawn_measured_and_judged() -> None:
    assert set(DRAWS) == set(ORACLES) == {*LISTED, *UNLISTED}
    assert set(SHOWS) == set(UNLISTED)
    assert set(COMPARABLE) < set(PARAMETERS)


def test_a_nulls_variances_lie_on_the_line_and_its_means_on_the_levels() -> None:
    built = build(5, NULL)
    case, p = built.case, Prepared(built.case, built.frames)
    variances, means = [], []
    for i in p.kinds("dark", "flat"):
        for name, plane in p.planes.items():
            x = case["exposures"][i].get("level", 0) * case["response"][name]
            true, n = float(expected_variance(case, np.array(x))), p.means[i][plane].size
            error = np.sqrt(2 / (n * (p.count(i) - 1)))
            variances.append((float(p.variances[i][plane].mean()) / true - 1) / error)
            off = float(p.means[i][plane].mean(dtype=float)) - case["black"] - x
            means.append(off / np.sqrt(true / n / p.count(i)))
    assert np.abs(variances).max() < FIVE_SIGMA
    assert np.abs(means).max() < FIVE_SIGMA
    assert np.sqrt(np.mean(np.square(variances))) < 2


@pytest.mark.parametrize("kind", ["row_noise", "crosstalk", "tap_mismatch"])
def test_a_planted_effect_shows_at_its_z_against_noise_of_its_own(kind: str) -> None:
    built = build(5, replace(NULL, listed=(kind,)))
    (row,) = built.key["hidden"]
    assert row["z"] == pytest.approx(row["z_target"], rel=0.3)
    effect = {"kind": kind, **row["realisation"]}
    other = Prepared(built.case, simulate({**built.case, "seed": built.case["seed"] + 1}, []))
    there, oracle = Prepared(built.case, built.frames), ORACLES[kind]
    (v1, _), (v0, s) = oracle(there, effect), oracle(other, effect)
    seen = np.sqrt(np.sum(((np.asarray(v1) - v0) / s) ** 2))
    assert abs(seen - row["z"]) < FIVE_SIGMA + np.sqrt(2 * len(np.atleast_1d(s)))
    assert z_of(effect, other, other) == 0


def test_the_folder_is_read_by_the_project_and_holds_no_truth(tmp_path: Path) -> None:
    hand = Hand(3, ("row_noise",), None, wrong_number=True, known=False)
    task = {"hand": hand_values(hand), "seed": 5, "folder": str(tmp_path / "case")}
    entry = json.loads(json.dumps(conceal(task)))
    camera, recording = (
        read_camera(tmp_path / "case/camera.toml"),
        read_recording(tmp_path / "case"),
    )
    assert not camera.effect
    assert len(recording.exposures) == len(entry["exposures"])
    texts = [p for p in (tmp_path / "case").rglob("*") if p.suffix not in (".png", ".tif", ".npy")]
    names = {path.name for path in texts if path.is_file()}
    assert names == {"camera.toml", "recording.toml"}
    said = "".join((tmp_path / "case" / name).read_text(encoding="utf-8") for name in names)
    assert not any(kind in said for kind in (*LISTED, *UNLISTED))
    (off,) = entry["off"]
    assert str(off["true"]) not in said
    key = {"case": entry}
    assert seal(tmp_path / "key", key) == seal(tmp_path / "again", key)


def test_known_effects_are_written_in_the_projects_words(tmp_path: Path) -> None:
    built = build(5, NULL)
    shifted = {"law": "r2", "centre": [0.4, 0.6], "falloff_percent": 5.0}
    known = [
        {"kind": "crosstalk", "fraction": 0.01, "mode": "columns"},
        {"kind": "readout_memory", "fraction": 0.1, "lag_pixels": 2, "axis": "column"},
        {"kind": "black_level_drift", "sigma_dn": 1.0, "law": "ar1", "ar": 0.5, "period": 5},
        {"kind": "shading", **shifted},
    ]
    built.model["effects"] = known
    write(tmp_path / "case", built)
    said = tomllib.loads((tmp_path / "case/camera.toml").read_text(encoding="utf-8"))["effect"]
    assert said[0] == {"kind": "crosstalk", "fraction": 0.01, "along": "columns"}
    assert said[1]["along"] == "columns"
    assert said[2]["persistence"] == 0.5
    assert said[3]["tilt_down_percent"] < 0 < said[3]["tilt_right_percent"]
    assert len(read_camera(tmp_path / "case/camera.toml").effect) == len(known)
    centred = {"kind": "shading", **shifted, "centre": [0.5, 0.5]}
    assert words(built.case, centred) == {"falloff_percent": 5.0}


def test_hands_are_dealt_alike_again_and_all_effects_in_turn() -> None:
    hands = deal(101, 48)
    assert hands == deal(101, 48)
    assert sum(not hand.listed and not hand.unlisted for hand in hands) == 12
    both = [kind for seed in (101, 202) for hand in deal(seed, 48) for kind in hand.listed]
    assert set(both) == set(LISTED)


def test_lag_that_stays_again_is_no_number_of_lag_that_does_not() -> None:
    """Frames two apart are alike by the square; of two taps they are not alike at all."""
    fraction, shape = 0.12, (400, 300)
    case = {"h": shape[0], "w": shape[1], "seed": 1, "exposures": [{"kind": "flat"}]}
    effect = {"kind": "image_lag", "fraction": fraction, "start": "steady"}
    light, slope = np.full((6, *shape), 400.0), np.ones((6, *shape))
    noise = np.random.default_rng(2).normal(0, 20, light.shape)
    q = moved(case, {"image_lag": effect}, 0, light + noise, (light[0], slope[0])) - 400
    lag = [float((q[k:] * q[: 6 - k]).mean() / (q * q).mean()) for k in (1, 2)]
    assert lag == pytest.approx([fraction, fraction**2], abs=FIVE_SIGMA / np.sqrt(4 * q[0].size))
    taps = 0.5 - np.sqrt(0.25 - fraction / (1 + 2 * fraction))  # that have the first of these
    assert taps * (1 - taps) / (taps**2 + (1 - taps) ** 2) == pytest.approx(fraction)
    assert taps < 0.91 * fraction
    assert "image_lag" not in COMPARABLE


def test_findings_are_judged_by_the_key() -> None:
    row = {"effect": "row_noise", "z": 20.0, "realisation": {"sigma_dn": 2.0}}
    out = {"effect": "dust_shadows", "z": 30.0, "realisation": {}}
    entry = {"case": "case-0", "verdict": "omitted_physics", "effects": ["row_noise"], "off": []}
    entry |= {"unlisted": ["dust_shadows"], "hidden": [row, out], "written": {}}
    number = {"sigma_dn": {"value": 2.3, "standard_error": 0.1}}
    spots = {"statistic": "fixed_patch_variance", "where": {"exposures": ["F1"]}}
    values = {"verdict": "omitted_physics", "seconds": 1.0, "unexplained": [spots]}
    kinds = {"D1": "dark", "F1": "flat"}
    named = {**values, "omitted_physics": [{"effect": "row_noise", "parameters": number}]}
    right = judge(entry, named, kinds)
    assert not right["wrong"]
    assert not right["missed"]
    assert right["outside"] == {"dust_shadows": True}
    assert right["errors_se"]["row_noise.sigma_dn"] == pytest.approx(3.0)
    assert not shortfalls([right])
    other = {**values, "unexplained": [], "omitted_physics": [{"effect": "prnu"}]}
    wrong = judge(entry, other, kinds)
    assert (wrong["wrong"], wrong["missed"]) == (["prnu"], ["row_noise"])
    assert len(shortfalls([right, wrong])) == 1
    assert any("1/2 = 50.0 %" in line for line in figures([right, wrong]))
    assert not points_at("dust_shadows", {**spots, "where": {"exposures": ["D1"]}}, kinds)
    assert share(0, 0) == "0/0"


def test_a_law_the_project_learned_later_is_asked_for_by_its_name() -> None:
    made = {"amplitude": 1.05, "length": 0.08}
    row = {"effect": "line_start_settling", "z": 40.0, "realisation": made}
    entry = {"case": "case-0", "verdict": "omitted_physics", "effects": [], "off": []}
    entry |= {"unlisted": [row["effect"]], "hidden": [row], "written": {}, "camera": {"w": 150}}
    numbers = {
        "offset_dn": {"value": 1.0, "standard_error": 0.1},
        "length_pixels": {"value": 15.0, "standard_error": 1.0},
    }
    values = {"verdict": "omitted_physics", "seconds": 1.0}
    found = {"effect": "line_settling", "parameters": numbers}
    right = judge(entry, {**values, "omitted_physics": [found]}, {})
    assert not right["wrong"]
    assert not right["outside"]
    assert right["errors_se"]["line_settling.offset_dn"] == pytest.approx(-0.5)
    assert right["errors_se"]["line_settling.length_pixels"] == pytest.approx(3.0)
    assert any("z = 10 on" in line and "1/1" in line for line in figures([right]))
    silent = judge(entry, {**values, "unexplained": [{"statistic": "fixed_smooth_tilt"}]}, {})
    assert silent["missed"] == ["line_settling"]
    assert len(shortfalls([silent])) == 1
