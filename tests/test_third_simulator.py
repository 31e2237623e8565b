"""The third simulator, which judges `dsis mismatch`: it keeps its own laws and tells no truth."""

import ast
import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dsis.camera import read_camera
from dsis.recording import read_recording
from folder_bytes import every_byte

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from third.camera import Array, Camera, Exposure  # noqa: E402
from third.cases import conceal, seal  # noqa: E402
from third.chain import simulate  # noqa: E402
from third.dealing import Dealer, Dealt, deck  # noqa: E402
from third.judging import judge  # noqa: E402
from third.summary import figures, shortfalls  # noqa: E402
from third.vocabulary import LISTED, UNLISTED, clash  # noqa: E402

FIVE_SIGMA = 5.0
CLEAR_Z = 300.0  # at which a size that is 10 % off shows
ROUNDING = 1 / 12
OUTSIDE = {"dsis", "analysis", "planter", "second"}
Recorded = tuple[Camera, Any, list[tuple[Exposure, Array]]]


def alone(kind: str, **holds: Any) -> Recorded:
    """Return the recording of a grey camera of one path with one effect of the exact law."""
    for seed in range(1, 200):
        chance = np.random.default_rng(seed)
        hand = Dealer(chance).fitted("one", [kind], [CLEAR_Z], [])
        if hand is None or hand.bench.camera.mosaic or hand.bench.camera.high:
            continue
        (effect,) = hand.effects
        if effect.neighbouring or any(getattr(effect, k) != v for k, v in holds.items()):
            continue
        return hand.bench.camera, effect, recorded(hand, chance)
    raise LookupError(kind)


def recorded(hand: Dealt, chance: np.random.Generator) -> list[tuple[Exposure, Array]]:
    for effect in hand.effects:
        effect.make_ready()
    camera = hand.bench.camera
    stacks = simulate(camera, hand.effects, chance)
    return [(e, codes - camera.black) for e, codes in stacks if e.kind != "scene"]


def noise(camera: Camera, signal: float) -> float:
    return camera.low.slope * signal + camera.low.intercept + ROUNDING


def unclipped(camera: Camera, stacks: list[tuple[Exposure, Array]]) -> list[tuple[Exposure, Array]]:
    top = {e.name: e.signal_dn + 6 * noise(camera, e.signal_dn) ** 0.5 for e, _ in stacks}
    return [(e, v) for e, v in stacks if top[e.name] < camera.full]


def test_it_shares_no_code_with_what_it_judges_or_with_the_others() -> None:
    shared = set()
    for path in (BENCHMARKS / "third").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [str(node.module)]
            shared |= {(path.name, name) for name in names if name.split(".")[0] in OUTSIDE}
    assert shared == {("summary.py", "planter.tables")}


def test_the_same_seed_gives_the_same_bytes_and_key(tmp_path: Path) -> None:
    first, again, other = (tmp_path / name for name in ("first", "again", "other"))
    made = [
        conceal({"seed": seed, "cases": 2, "folder": str(folder)})["cases"]
        for seed, folder in ((5, first), (5, again), (6, other))
    ]
    assert every_byte(first) == every_byte(again) != every_byte(other)
    assert made[0] == made[1] == json.loads(json.dumps(made[0]))
    assert seal(tmp_path / "key", made[0]) == seal(tmp_path / "key", made[1])
    assert conceal({"seed": 5, "cases": 2, "folder": str(first)})["cases"] == made[0]
    assert every_byte(first) == every_byte(again)


def test_the_folder_is_read_by_the_project_and_holds_no_truth(tmp_path: Path) -> None:
    key = conceal({"seed": 5, "cases": 2, "folder": str(tmp_path)})["cases"]
    for name, entry in key.items():
        camera = read_camera(tmp_path / name / "camera.toml")
        recording = read_recording(tmp_path / name / "rec")
        assert not camera.effect
        assert [len(e.frames) for e in recording.exposures] == entry["camera"]["frames"]
        texts = [p for p in (tmp_path / name).rglob("*.*") if p.suffix not in (".tif", ".npy")]
        assert {path.name for path in texts} == {"camera.toml", "recording.toml"}
        said = "".join(path.read_text(encoding="utf-8") for path in texts)
        assert not any(kind in said for kind in (*LISTED, *UNLISTED))


def test_every_effect_finds_a_camera_that_shows_it() -> None:
    dealer = Dealer(np.random.default_rng(3))
    for kind in (*LISTED, *UNLISTED):
        hand = dealer.alone(kind)
        assert hand is not None, kind
        (effect,) = hand.effects
        assert effect.kind == kind
        assert effect.z >= 4.5
        assert effect.listed == (kind in LISTED)
        if effect.sized:
            assert effect.z_of(1.01 * effect.size) > effect.z > effect.z_of(0.99 * effect.size)


def test_a_deck_holds_what_it_says_and_no_two_that_cannot_be_told_apart() -> None:
    hands = [dealt for dealt, _ in deck(4, 20)]
    kinds = [hand.kind for hand in hands]
    counts = {kind: kinds.count(kind) for kind in ("null", "one", "two", "three", "unlisted")}
    assert counts == {"null": 4, "one": 8, "two": 4, "three": 2, "unlisted": 2}
    assert sum(bool(hand.wrong) for hand in hands if hand.kind == "null") == 2
    for hand in hands:
        names = [effect.kind for effect in hand.effects]
        if hand.kind != "unlisted":
            assert not any(clash(name, names[:i]) for i, name in enumerate(names))


def test_a_nulls_variances_lie_on_the_line_and_its_means_on_the_levels() -> None:
    chance = np.random.default_rng(8)
    hand = Dealer(chance).deal("null")
    camera, variances, means = hand.bench.camera, [], []
    for exposure, v in unclipped(camera, recorded(hand, chance)):
        for row in (0, 1):
            for column in (0, 1):
                site = v[:, row::2, column::2]
                signal = exposure.signal_dn * camera.response[row, column]
                path = camera.path_at(signal)
                true, n = path.slope * signal + path.intercept + ROUNDING, site[0].size
                seen = float(site.var(0, ddof=1).mean())
                variances.append((seen / true - 1) / np.sqrt(2 / (n * (len(v) - 1))))
                means.append((site.mean() - signal) / np.sqrt(true / site.size))
    assert np.abs(variances).max() < FIVE_SIGMA
    assert np.abs(means).max() < FIVE_SIGMA
    assert np.sqrt(np.mean(np.square(variances))) < 2


def agree(deviations: list[float]) -> None:
    """Check deviations in standard errors, one an exposure: each, and all together."""
    assert len(deviations) >= 3
    assert np.abs(deviations).max() < FIVE_SIGMA
    assert abs(np.sum(deviations)) < FIVE_SIGMA * np.sqrt(len(deviations))


def test_row_noise_is_the_variance_of_row_means() -> None:
    camera, effect, stacks = alone("row_noise")
    off = []
    for exposure, v in unclipped(camera, stacks):
        seen = float(v.mean(2).var(0, ddof=1).mean())
        true = effect.size**2 + noise(camera, exposure.signal_dn) / camera.columns
        off.append((seen / true - 1) / np.sqrt(2 / (camera.rows * (len(v) - 1))))
    agree(off)


def test_prnu_is_what_halves_of_the_frames_share() -> None:
    camera, effect, stacks = alone("prnu")
    off = []
    field = effect.gains - 1.0
    assert abs(field.std() / effect.size - 1) < FIVE_SIGMA / np.sqrt(2 * camera.pixels)
    for exposure, v in unclipped(camera, stacks):
        one, two = v[::2].mean(0), v[1::2].mean(0)
        seen = float(np.mean((one - one.mean()) * (two - two.mean())))
        true = exposure.signal_dn**2 * field.var()  # of these gains, for all levels share them
        first, second = (noise(camera, exposure.signal_dn) / len(v[k::2]) for k in (0, 1))
        spread = first * second + true * (first + second)
        off.append((seen - true) / np.sqrt(spread / camera.pixels))
    agree(off)


def test_dark_current_adds_its_rate_times_the_time() -> None:
    camera, effect, stacks = alone("dark_current")
    off = []
    for exposure, v in unclipped(camera, stacks):
        true = exposure.signal_dn + effect.size * exposure.time_s
        off.append((v.mean() - true) / np.sqrt(noise(camera, true) / v.size))
    agree(off)


def test_crosstalk_correlates_shot_noise_and_leaves_read_noise() -> None:
    camera, effect, stacks = alone("crosstalk", along="both")
    f, off = effect.size, []
    for exposure, v in unclipped(camera, stacks):
        rest = v - v.mean(0)
        samples = (len(v) - 1) * camera.rows * (camera.columns - 1)
        seen = float((rest[:, :, 1:] * rest[:, :, :-1]).sum()) / samples
        kept = 1 - 4 * f
        shot = camera.low.slope * exposure.signal_dn
        alike = 2 * f * kept * shot
        variance = (kept**2 + 4 * f * f) * shot + camera.low.intercept + ROUNDING
        off.append((seen - alike) / np.sqrt((variance**2 + 3 * alike**2) / samples))
    agree(off)


def test_a_bend_of_exponent_one_is_a_parabola_over_85_percent_of_full_scale() -> None:
    camera, effect, stacks = alone("nonlinearity", exponent=1.0)
    end, off = 0.85 * camera.full, []
    for exposure, v in unclipped(camera, stacks):
        if exposure.kind == "flat":  # below black the bend has the other sign
            u = exposure.signal_dn / end
            spread = camera.low.slope * exposure.signal_dn / end**2
            bend = 4 * camera.full * effect.sign * effect.size * (u * (1 - u) - spread)
            steeper = 1 + 4 * camera.full / end * effect.sign * effect.size * (1 - 2 * u)
            variance = noise(camera, exposure.signal_dn) * max(steeper, 1) ** 2
            off.append((v.mean() - exposure.signal_dn - bend) / np.sqrt(variance / v.size))
    agree(off)


def test_quantised_codes_are_whole_steps() -> None:
    camera, effect, stacks = alone("quantisation", step=2.0)
    for _, v in stacks:
        codes = v + camera.black
        assert set(np.unique((codes - effect.phase) % 2)) == {0}


def test_a_grabber_repeats_frames_of_three_exposures() -> None:
    _, _, stacks = alone("repeated_frame")
    same = [sum((a == b).all() for a, b in pairwise(v)) for _, v in stacks]
    assert sorted(same)[-3:] == [1, 1, 1]
    assert sum(same) == 3


def planted(effect: str, z: float = 20.0, **also: Any) -> dict[str, Any]:
    entry = {"effect": effect, "z": z, "law": "exact", "also_right": [], "listed": True}
    return {**entry, "parameters": {}, **also}


def case(kind: str, *effects: dict[str, Any], **wrong: float) -> dict[str, Any]:
    return {"case": "case-0", "kind": kind, "planted": list(effects), "wrong_numbers": wrong}


def finding(*names: str, open_: tuple[str, ...] = (), **also: Any) -> dict[str, Any]:
    values = {"omitted_physics": [{"effect": name} for name in names], "seconds": 1.0}
    return {**values, "unexplained": [{"statistic": s} for s in open_], "verdict": "x", **also}


def marks(judged: dict[str, Any]) -> list[str]:
    return [effect["mark"] for effect in judged["effects"]]


def test_effects_are_right_missed_or_wrong() -> None:
    entry = case("two", planted("row_noise"), planted("channel_imbalance", also_right=["taps"]))
    right = judge(entry, finding("taps", "row_noise"))
    assert marks(right) == ["right", "right"]
    assert not right["wrong"]
    assert not shortfalls([right])
    other = judge(entry, finding("prnu", "row_noise", "row_noise"))
    assert marks(other) == ["right", "missed"]
    assert (other["wrong"], other["twice"]) == (["prnu"], ["row_noise"])
    (line,) = shortfalls([right, other])
    assert "not named: channel_imbalance; wrong: prnu" in line
    weak = judge(case("one", planted("prnu", 7.0)), finding())
    assert marks(weak) == ["missed"]
    assert not shortfalls([weak])
    said = "\n".join(figures([right, other, weak]))
    assert "right names from z = 10 on           3/4 = 75.0 %" in said
    assert "right names below z = 10             0/1 = 0.0 %" in said
    assert "cases with a wrong name              1/3" in said


def test_physics_on_no_list_is_abstained_from_named_or_not_seen() -> None:
    entry = case("unlisted", planted("scratch", listed=False))
    found = {
        "abstained": finding(open_=("outlying_patch",)),
        "named": finding("shading", open_=("outlying_patch",)),
        "not seen": finding(),
    }
    judged = {mark: judge(entry, values) for mark, values in found.items()}
    assert {mark: marks(case)[0] for mark, case in judged.items()} == {m: m for m in found}
    assert judged["named"]["wrong"] == ["shading"]
    assert len(shortfalls(judged.values())) == 2
    assert "on no list: left open, unnamed       1/3" in "\n".join(figures(list(judged.values())))


def test_nulls_are_silent_and_wrong_numbers_are_told_as_such() -> None:
    assert judge(case("null"), finding(verdict="match"))["silent"]
    assert not judge(case("null"), finding(open_=("level",)))["silent"]
    assert not judge(case("null"), finding("prnu"))["silent"]
    crashed = judge(case("null"), {"verdict": "error", "error": "E", "seconds": 1.0})
    assert not crashed["silent"]
    assert shortfalls([crashed])
    off = case("null", **{"noise.slope": 1.1})
    errors = [{"parameter": "noise.segment[0].slope"}]
    told = judge(off, finding(verdict="parameters", parameter_errors=errors))
    assert told["numbers_told"]
    other = [{"parameter": "black_level"}]
    assert not judge(off, finding(verdict="parameters", parameter_errors=other))["numbers_told"]
    silent = judge(off, finding(verdict="match"))
    assert not silent["numbers_told"]
    (line,) = shortfalls([told, silent])
    assert "not told: noise.slope (hidden nothing; camera.toml has noise.slope wrong" in line


@pytest.mark.parametrize("kind", ["row_noise", "row_fpn", "row_prnu", "prnu"])
def test_effects_of_one_group_are_never_together(kind: str) -> None:
    same = [other for other in LISTED if LISTED[other].group == LISTED[kind].group]
    assert all(clash(kind, [other]) for other in same)
