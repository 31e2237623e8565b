"""The planter, which judges `dsis mismatch`: it does what the vocabulary states, and no less."""

import ast
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from planter import KINDS, Case, Choice, Effect, Layout, draw_case, plant, stack  # noqa: E402
from planter.acceptable import STATISTICS, located, points_at  # noqa: E402
from planter.calibration import precision  # noqa: E402
from planter.deck import Deal, camera_for, deal  # noqa: E402
from planter.disk import camera_values  # noqa: E402
from planter.evidence import COUNTED, EVIDENCE  # noqa: E402
from planter.judgement import COMPARED, judge  # noqa: E402
from planter.ledger import read_ledger, versions, work_through  # noqa: E402
from planter.parameters import covered, truth_of  # noqa: E402
from planter.recipes import RECIPES  # noqa: E402
from planter.seal import seal  # noqa: E402
from planter.strength import Unidentifiable, calibrate  # noqa: E402

from dsis.camera import read_camera  # noqa: E402
from dsis.recording import read_recording  # noqa: E402

FIVE_SIGMA = 5.0
PLAIN = Choice(cfa="MONO", segments=1, bit_depth=14, read_noise_dn=6.0, times="darks", light=True)


@pytest.fixture(scope="module")
def base() -> Case:
    return draw_case(7, "small", PLAIN)


def residuals(case: Case, exposure: int) -> np.ndarray:
    frames = stack(case, exposure).astype(float)
    return frames - frames.mean(0)


def planted(case: Case, kind: str, **parameters: object) -> Case:
    return case.having(Effect(kind, parameters))


def test_every_effect_has_a_recipe_evidence_and_a_judgement() -> None:
    assert set(RECIPES) == KINDS
    assert set(EVIDENCE) | set(COUNTED) == KINDS
    assert not set(EVIDENCE) & set(COUNTED)
    assert set(STATISTICS) == KINDS
    assert set(COMPARED) == KINDS - {"poisson_shot_noise"}  # it has no parameter


def test_planting_shares_no_code_with_what_it_judges() -> None:
    """Only what runs the diagnosis, or reads a real recording, may import the project."""
    allowed = {"finder.py", "fitted.py", "onreal.py"}
    for path in (BENCHMARKS / "planter").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        modules = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        modules |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
        if {m.split(".")[0] for m in modules} & {"dsis", "analysis"}:
            assert path.name in allowed


@pytest.mark.parametrize("cfa", ["MONO", "GBRG"])
def test_base_noise_lies_on_its_line(cfa: str) -> None:
    case = draw_case(8, "small", replace(PLAIN, cfa=cfa, segments=2))
    for number, plan in enumerate(case.exposures):
        z = residuals(case, number)
        for name, place in case.channels().items():
            signal = plan.signal_dn * dict(zip("RGB", case.response, strict=True)).get(name[0], 1.0)
            path = next(s for s in case.segments if s.upper_dn is None or signal < s.upper_dn)
            own = z[:, place[0], place[1]]
            degrees = own.size * (plan.frames - 1) / plan.frames
            variance = np.sum(own**2) / degrees
            expected = path.slope * signal + path.intercept + 1 / 12
            assert abs(variance / expected - 1) < FIVE_SIGMA * np.sqrt(2 / degrees)


def test_recording_and_camera_are_read_by_dsis(tmp_path: Path) -> None:
    case = draw_case(9, "tiny", Choice(cfa="RGGB", segments=2, scene=True))
    case = replace(case, wrong={"noise.slope": 10.0, "black_level": -5.0})
    plant(tmp_path, case)
    recording, camera = read_recording(tmp_path), read_camera(tmp_path / "camera.toml")
    for number, exposure in enumerate(recording.exposures):
        assert np.array_equal(np.stack(list(recording.frames(exposure))), stack(case, number))
    known = precision(case, 0)
    written = camera.noise.segment[0]
    assert written.slope_se is not None
    both = np.hypot(known.slope_se, written.slope_se)
    assert written.slope - case.segments[0].slope == pytest.approx(10 * both)
    assert camera.black_level - case.black_level == pytest.approx(-5 * known.black_se)
    assert camera.effect == ()
    assert Case.from_json(case.to_json()) == case


def test_line_and_frame_offsets_have_their_variance() -> None:
    layout = Layout(200, 240, 2, 12, 12)
    case = draw_case(3, layout, PLAIN)
    for kind, axes in (("row_noise", 2), ("column_noise", 1), ("black_level_drift", (1, 2))):
        noisy = planted(case, kind, sigma_dn=30.0)
        gained = stack(noisy, 0).astype(float) - stack(case, 0)
        lines = gained.mean(axes)
        assert abs(np.mean(lines**2) / 900 - 1) < FIVE_SIGMA * np.sqrt(2 / lines.size)


def test_neighbours_are_correlated_as_stated(base: Case) -> None:
    top, f = len(base.exposures) - 1, 0.04
    shot = base.segments[0].slope * base.exposures[top].signal_dn
    lag1 = 2 * f * (1 - 4 * f) * shot
    for kind, parameter in (
        ("crosstalk", {"fraction": f}),
        ("brighter_fatter", {"per_dn": f / base.exposures[top].signal_dn}),
    ):
        z = residuals(planted(base, kind, **parameter), top)
        found = np.mean(z[:, :, :-1] * z[:, :, 1:])
        frames = base.exposures[top].frames
        error = shot / np.sqrt(z.size)
        # brighter-fatter's variance of the squares adds shot/S, a share of 1e-4 here
        assert abs(found / (1 - 1 / frames) - lag1) < FIVE_SIGMA * error


def test_memory_and_lag_return_noise(base: Case) -> None:
    case = planted(base, "readout_memory", fraction=0.2, lag_pixels=3, along="columns")
    z = residuals(case, 0)
    rho = np.mean(z[:, :-3] * z[:, 3:]) / np.mean(z**2)
    assert abs(rho - 0.2 / 1.04) < FIVE_SIGMA / np.sqrt(z.size)
    top = len(base.exposures) - 1
    frames = stack(planted(base, "image_lag", fraction=0.2), top).astype(float)
    step = np.var(frames[1:] - frames[:-1]) / 2
    shot = base.segments[0].slope * base.exposures[top].signal_dn
    # Var(Q(t) - Q(t-1)) / 2 = shot (a^2 + b^2 - a b), a = 1 - f, b = f; read noise stays.
    expected = shot * (0.64 + 0.04 - 0.16) + base.segments[0].intercept + 1 / 12
    assert abs(step / expected - 1) < FIVE_SIGMA * np.sqrt(4 / z.size)


def test_memory_carries_over_noise_and_no_error_of_an_amplifier(base: Case) -> None:
    """The first samples of a line, which have none before them, lie where all others do."""
    case = planted(base, "readout_memory", fraction=0.2, lag_pixels=3, along="columns")
    case = planted(case, "tap_mismatch", gain_percent=20.0, regions="even_odd_columns")
    frames = stack(case, len(case.exposures) - 1).astype(float)
    first, others = frames[:, :3].mean(1), frames[:, 3:].mean(1)
    error = np.hypot(first.std(0, ddof=1), others.std(0, ddof=1)) / np.sqrt(len(frames))
    off = (first - others).mean(0) / error
    for amplifier in (off[::2], off[1::2]):
        assert abs(amplifier.mean()) < FIVE_SIGMA / np.sqrt(amplifier.size)


def test_tails_skew_and_spread_have_their_moments() -> None:
    case = draw_case(5, Layout(240, 240, 2, 8, 8), replace(PLAIN, electrons=400.0))
    tails = residuals(planted(case, "heavy_tailed_read_noise", tail_df=12.0), 0)
    shrink = (1 - 1 / 8) ** 2 + 7 / 8**4 / (1 - 1 / 8) ** 2  # of excess kurtosis by 8-frame means
    blocks = tails.reshape(8, 60, -1).swapaxes(0, 1).reshape(60, -1)
    kurtosis = np.mean(blocks**4, 1) / np.mean(tails**2) ** 2 - 3
    error = kurtosis.std(ddof=1) / np.sqrt(60)
    rounding = 1 / 6 / 36  # 2 (1/12) / sigma^2, of the excess: codes add a variance, no tail
    expected = 0.75 * shrink * (1 - rounding)  # df 12: 6 / (12 - 4)
    assert abs(kurtosis.mean() - expected) < FIVE_SIGMA * error
    top = len(case.exposures) - 1
    counts = stack(planted(case, "poisson_shot_noise"), top).astype(float)
    third = np.mean((counts - counts.mean()) ** 3)
    expected = case.segments[0].slope ** 2 * case.exposures[top].signal_dn
    variance = counts.var()
    assert abs(third - expected) < FIVE_SIGMA * np.sqrt(6 * variance**3 / counts.size)


def test_pink_noise_has_its_variance_over_two_frames() -> None:
    case = draw_case(6, Layout(64, 64, 1, 40, 40), PLAIN)
    gained = stack(planted(case, "pink_noise", sigma_dn=20.0), 0).astype(float) - stack(case, 0)
    by_frame = np.mean(gained**2, (1, 2))
    assert abs(by_frame.mean() - 400) < FIVE_SIGMA * by_frame.std(ddof=1) / np.sqrt(40)


def test_nonlinearity_is_the_largest_deviation(base: Case) -> None:
    for law in ("quadratic", "cubic"):
        bent = planted(base, "nonlinearity", percent_full_scale=2.0, law=law)
        bent = replace(bent, segments=(replace(base.segments[0], slope=1e-6, intercept=1e-6),))
        levels = np.linspace(0, 0.85, 35) * base.full_scale_dn
        plans = tuple(
            replace(base.exposures[-1], name=str(i), signal_dn=float(s), frames=1)
            for i, s in enumerate(levels)
        )
        bent = replace(bent, rows=2, columns=2, exposures=plans)
        means = np.array([stack(bent, i).mean() for i in range(levels.size)]) - base.black_level
        line = means[-1] * levels / levels[-1]
        largest = np.abs(means - line).max() / base.full_scale_dn
        assert largest == pytest.approx(0.02, rel=0.01)


def test_an_effect_leaves_all_other_noise_as_it_was(base: Case) -> None:
    noisy = planted(base, "row_noise", sigma_dn=8.0)
    both = planted(noisy, "dsnu", sigma_dn=5.0)
    lines = stack(noisy, 0).astype(float) - stack(base, 0)
    again = stack(both, 0).astype(float) - stack(planted(base, "dsnu", sigma_dn=5.0), 0)
    assert np.abs(lines - again).max() <= 2  # rounding alone


@pytest.mark.parametrize("kind", ["row_noise", "tap_mismatch", "image_lag", "impulse"])
def test_calibration_reaches_the_wanted_strength(kind: str) -> None:
    case = draw_case(4, "tiny", PLAIN)
    assert calibrate(case, kind, 12.0).z == pytest.approx(12, rel=0.1)


def test_what_a_recording_cannot_show_is_said() -> None:
    case = draw_case(4, "tiny", replace(PLAIN, times="one", light=False))
    for kind in ("dark_current", "hot_pixels"):
        with pytest.raises(Unidentifiable):
            calibrate(case, kind, 10.0)


def test_cases_are_dealt_fairly_and_always_the_same() -> None:
    deals = deal(1, 200)
    assert deals == deal(1, 200)
    assert sum(not dealt.kinds for dealt in deals) == 60
    named = [kind for dealt in deals for kind in dealt.kinds if kind != dealt.out]
    assert min(named.count(kind) for kind in KINDS) >= 4
    assert any(dealt.real for dealt in deals)
    for dealt in deals[:40]:
        case = camera_for(dealt, 1)
        assert all(RECIPES[kind].fits(case) for kind in dealt.kinds)
    assert camera_for(Deal(3), 1) == camera_for(Deal(3), 1)


def test_mismatches_are_accepted_where_they_belong(base: Case) -> None:
    wave = planted(base, "periodic_noise", amplitude_dn=1.0, frequency=(0.2, -0.1))
    here = {"statistic": "spectral_peak", "where": {"spatial_frequency": [-0.2, 0.1]}}
    there = {"statistic": "spectral_peak", "where": {"spatial_frequency": [0.2, 0.1]}}
    assert points_at(wave, "periodic_noise", here) == (True, True)
    assert points_at(wave, "periodic_noise", there) == (True, False)
    dark = {"statistic": "frame_variance", "where": {"exposures": ["dark-0"]}}
    assert located(base, "flicker", [dark]) == (True, False)
    assert located(base, "black_level_drift", [dark]) == (True, True)
    bent = {"statistic": "pixel_variance", "where": {"exposures": ["flat-1"]}}
    assert located(base, "nonlinearity", [bent])[0]  # of light that is not known


def test_findings_are_judged_by_the_key(base: Case) -> None:
    case = planted(planted(base, "row_noise", sigma_dn=2.0), "dsnu", sigma_dn=1.0)
    entry = {"case": json.loads(case.to_json()), "z": {"row_noise": 20.0, "dsnu": 9.0}}
    row = {"effect": "row_noise", "parameters": {"sigma_dn": {"value": 2.3, "standard_error": 0.1}}}
    right = judge(entry, {"omitted_physics": [row]})
    assert right["outcome"] == {"row_noise": "right", "dsnu": "missed"}
    assert right["wrong"] == []
    assert right["errors_se"]["row_noise.sigma_dn"] == pytest.approx(3.0)
    other = {"effect": "prnu", "parameters": {}}
    assert judge(entry, {"omitted_physics": [other]})["wrong"] == ["prnu"]
    assert judge(entry, {"omitted_physics": [other]}, known=["prnu"])["wrong"] == []
    assert judge({**entry, "out": "row_noise"}, {"omitted_physics": [row]})["wrong"] == [
        "row_noise"
    ]
    crash = judge(entry, {"verdict": "error", "error": "KeyError"})
    assert set(crash["outcome"].values()) == {"crashed"}
    left = {"unexplained": [{"statistic": "fixed_pixel_variance"}]}
    assert judge(entry, left)["outcome"]["dsnu"] == "abstained"


def test_parameter_errors_are_compared_with_the_truth(base: Case) -> None:
    wrong = replace(base, wrong={"noise.slope": 20.0})
    true = base.segments[0].slope
    written = true + 20 * np.hypot(1, 0.5) * precision(base, 0).slope_se
    entry = {"parameter": "noise.slope", "model": written, "recorded": true * 1.01}
    found = truth_of(wrong, entry)
    assert found == ("noise.slope", (true, true))
    assert covered({**entry, "standard_error": 0.006 * true}, found[1])
    assert not covered({**entry, "standard_error": 0.004 * true}, found[1])


def test_an_effect_that_the_camera_has_is_written_with_its_wrong_size(base: Case) -> None:
    own = replace(planted(base, "prnu", sigma_percent=1.0), known=("prnu",))
    wrong = replace(own, wrong={"effect.prnu.sigma_percent": 0.25})
    assert "effect" not in camera_values(base)
    assert camera_values(own)["effect"] == [{"kind": "prnu", "sigma_percent": 1.0}]
    assert camera_values(wrong)["effect"] == [{"kind": "prnu", "sigma_percent": 1.25}]
    assert Case.from_json(wrong.to_json()) == wrong
    entry = {"parameter": "effect.prnu.sigma_percent", "model": 1.25, "recorded": 1.01}
    assert truth_of(wrong, entry) == ("effect.prnu.sigma_percent", (1.0, 1.0))
    sealed = {"case": json.loads(wrong.to_json()), "z": {}}
    assert judge(sealed, {"parameter_errors": [entry]})["wrong_found"] == {entry["parameter"]: True}
    named = {"omitted_physics": [{"effect": "prnu", "parameters": {}}]}
    assert judge(sealed, named)["wrong"] == ["prnu"]


def test_the_key_is_sealed_and_a_cut_ledger_goes_on(tmp_path: Path) -> None:
    key = {"case-1": {"z": {}}, "case-0": {"z": {"prnu": 3.0}}}
    first = seal(tmp_path / "key.jsonl", key)
    assert first == seal(tmp_path / "again.jsonl", dict(reversed(key.items())))
    assert first != seal(tmp_path / "key.jsonl", {**key, "case-1": {"z": {"prnu": 1.0}}})
    ledger = tmp_path / "ledger.jsonl"
    ledger.write_text('{"task": "a", "n": 1}\n{"task": "b", "n"', encoding="utf-8")
    assert set(read_ledger(ledger)) == {"a"}


def test_a_ledger_is_used_again_for_the_same_tasks_only(tmp_path: Path) -> None:
    ledger = tmp_path / "ledger.jsonl"
    first = work_through(ledger, {"a": {"n": 1}}, dict, 1)
    again = work_through(ledger, {"a": {"n": 1}}, fails, 1)
    assert again == first
    other = work_through(ledger, {"a": {"n": 2}}, dict, 1)
    assert (first["a"]["n"], other["a"]["n"]) == (1, 2)
    assert "MIXED" not in versions([*first.values(), *other.values()])
    assert "MIXED" in versions([{"code": "x"}, {"code": "y"}])


def fails(task: object) -> dict[str, object]:
    raise AssertionError(task)
