"""Lines that have not settled: the effect, the numbers that see it, and that it is named."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace as Stub
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import numpy as np
import pytest
from planter import Choice, draw_case
from planter.readout import settled
from planter.view import View

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.edges import REACHES, edge_shapes, edges
from analysis.mismatch.bank.edges import names as edge_names
from analysis.mismatch.bank.key import Key
from analysis.mismatch.bank.parts import parts
from analysis.mismatch.candidates.edges import CANDIDATES
from analysis.mismatch.finding import Change, Finding, FittedParameter, Gain, OmittedEffect, Proof
from analysis.mismatch.jsonfile import finding_values
from analysis.mismatch.layout import Layout
from analysis.mismatch.locate import lines_of
from analysis.mismatch.report.sentences import verdict
from analysis.mismatch.report.summary import summary
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.grid import PixelGrid
from dsis.simulate.maps import SensorMaps, with_maps
from exposing import apply, effect
from mismatch_recordings import TWO_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

NAMED = Finding(
    "omitted_physics",
    (),
    (),
    (
        OmittedEffect(
            "line_settling",
            {"length_pixels": FittedParameter(6.0, 0.5)},
            ("fixed_edge",),
            Gain(3.0, (2.0, 4.0)),
            choices={"edge": "top"},
        ),
    ),
    (),
    (),
    Proof({}, Change(-1.0, -0.9), Change(1, 0), None, None),
    camera(),
)
EDGES = ["left", "right", "top", "bottom"]
SURE = 5.0  # standard errors


def _applied(image: np.ndarray, **parameters: Any) -> np.ndarray:
    return apply(effect("line_settling", **parameters), image)


@pytest.mark.parametrize("edge", EDGES)
def test_offset_and_gain_decay_from_the_edge(edge: str) -> None:
    """What is named and what the planter plants, written apart, are one thing."""
    flat = np.full((24, 40), 500.0, np.float32)
    own = {"offset_dn": -3.0, "gain_percent": 2.0, "length_pixels": 6.5, "edge": edge}
    made = _applied(flat, **own)
    turned = {"left": made, "right": made[:, ::-1], "top": made.T, "bottom": made[::-1].T}[edge]
    expected = 500 + (10 - 3) * np.exp(-np.arange(turned.shape[1]) / 6.5)
    np.testing.assert_allclose(turned, np.broadcast_to(expected, turned.shape), rtol=1e-6)
    sooner = _applied(flat, **own, gain_length_pixels=3.0)
    apart = 10 * (
        np.exp(-np.arange(turned.shape[1]) / 3) - np.exp(-np.arange(turned.shape[1]) / 6.5)
    )
    turned = {"left": sooner, "right": sooner[:, ::-1], "top": sooner.T, "bottom": sooner[::-1].T}
    np.testing.assert_allclose(
        turned[edge] - expected, np.broadcast_to(apart, turned[edge].shape), atol=2e-4
    )
    case = draw_case(3, "tiny", Choice(cfa="MONO"))
    left = settled(View(case, 0, 0), own)
    ones = np.zeros((case.rows, case.columns), np.float32)
    again = _applied(ones, **{**own, "offset_dn": 1.0, "gain_percent": 0.0})
    np.testing.assert_allclose(left, again, rtol=1e-4, atol=1e-7)


def test_a_crop_is_the_crop_of_the_whole() -> None:
    one = effect("line_settling", gain_percent=5.0, length_pixels=4.0, edge="right")
    image = np.full((8, 32), 100.0)
    grid = PixelGrid(8, 12, Cfa.MONO, first_column=20, sensor_rows=8, sensor_columns=32)
    crop = apply(one, image[:, 20:], grid=grid)
    np.testing.assert_allclose(crop, apply(one, image)[:, 20:])


def test_numbers_of_edges_are_normal_where_there_is_none() -> None:
    rng = np.random.default_rng(1)
    found = [parts(rng.normal(0, 2.0, (48, 64)), 2.0).numbers for _ in range(200)]
    for axis in ("rows", "columns"):
        for name in edge_names(axis):
            values = np.array([one[name][0] for one in found])
            assert abs(values.mean()) < SURE / np.sqrt(200)
            assert values.std() == pytest.approx(1, abs=SURE / np.sqrt(400))


def test_numbers_of_edges_are_in_units_of_their_noise() -> None:
    size, across, sd = 64, 48, 0.3
    for i, reach in enumerate(REACHES.values()):
        decay = 0.5 * np.exp(-np.arange(size) / reach)
        found = edges(np.zeros(across), decay, (1.0, sd**2))
        name = list(edge_names("columns"))[i]
        expected = edge_shapes(size)[i] @ decay / (sd / np.sqrt(across))
        assert found[name][0] == pytest.approx(expected)
        assert found[name][0] > 0


def test_the_same_sensor_keeps_the_mean_that_a_map_has_not() -> None:
    """Maps hold the decay as it was measured, less the mean of all pixels."""
    shape = (24, 40)
    own = effect("line_settling", offset_dn=50.0, gain_percent=20.0, length_pixels=6.0)
    drawn = apply(own, np.full(shape, 500.0)) - 500
    zero, one = np.zeros(shape, np.float32), np.ones(shape, np.float32)
    same = with_maps(camera(own), SensorMaps(zero, one), PixelGrid(*shape, Cfa.MONO))
    image = np.full(shape, 500.0)
    for link in same.effect:
        image = apply(link, image)
    assert (image - 500).mean() == pytest.approx(drawn.mean(), rel=1e-3)


def test_so_few_lines_that_a_decay_is_a_surface_have_no_number() -> None:
    found = edges(np.zeros(12), np.zeros(64), (1.0, 1.0))
    assert all(np.isnan(found[name][0]) for name in edge_names("rows"))
    assert all(np.isfinite(found[name][0]) for name in edge_names("columns"))


def _clues(offset: np.ndarray, gain: np.ndarray, *effects: object, top: float = 1000.0) -> Any:
    images = {"offset": {"MONO": (offset, 0.05)}, "gain": {"MONO": (gain, 0.05)}}
    rows, columns = offset.shape
    return Stub(
        image=images.__getitem__,
        scale=lambda name, _channel: top if name == "gain" else 1.0,
        layout=Layout((), rows, columns, Cfa.MONO, 0.0, 4095.0, {}, {}),
        shape=lambda _channel: (rows, columns),
        camera=Stub(effect=effects),
    )


@pytest.mark.parametrize("edge", EDGES)
def test_proposals_start_from_what_the_maps_show(edge: str) -> None:
    rng = np.random.default_rng(2)
    own = {"length_pixels": 5.0, "edge": edge}
    noise = rng.normal(0, 0.05, (2, 96, 128))
    dark = np.zeros((96, 128), np.float32)
    offset = noise[0] + _applied(dark, offset_dn=-1.5, **own)
    # A map of gains in DN at the brightest signal: 1 % of 1000.
    gain = noise[1] + _applied(dark + 1000, gain_percent=1.0, **own) - 1000
    found = CANDIDATES[0].propose(_clues(offset, gain))
    planted = {"offset_dn": -1.5, "gain_percent": 1.0}
    lengths = ("length_pixels", "gain_length_pixels")
    # Beside a smooth surface, and alone: of both maps, and of either.
    each = [(*planted, *lengths), ("offset_dn", lengths[0]), ("gain_percent", lengths[0])]
    assert [proposal.free for proposal in found] == 2 * each
    for proposal in found:
        values = proposal.effect.model_dump()
        assert values["edge"] == edge
        for name, size in planted.items():
            assert values[name] == pytest.approx(size if name in proposal.free else 0.0, rel=0.1)
        for name in lengths:
            assert name not in proposal.free or values[name] == pytest.approx(5.0, rel=0.15)
    known = effect("line_settling", offset_dn=-1.5, gain_percent=1.0, **own)
    assert not CANDIDATES[0].propose(_clues(offset, gain, known))
    for alone in CANDIDATES[0].propose(_clues(offset, noise[1])):
        assert alone.free == ("offset_dn", "length_pixels")


@pytest.mark.parametrize(
    ("values", "sane"),
    [
        ({"length_pixels": 12.0}, True),
        ({"length_pixels": 66.0}, False),
        ({"length_pixels": 5.0, "gain_length_pixels": 66.0}, False),
    ],
)
def test_a_decay_over_much_of_the_sensor_is_uneven_light(
    values: dict[str, float], sane: bool
) -> None:
    layout: Any = Stub(rows=96, columns=640)
    (candidate,) = CANDIDATES
    assert (
        candidate.sane(layout, effect("line_settling", gain_percent=1.0, edge="top", **values))
        == sane
    )


def _found(true: Camera, words: frozenset[str]) -> Finding:
    recording = recorded(true, 9, rows=48, levels=TWO_LEVELS)
    return find_mismatch(camera(), recording, seed=1, vocabulary=words)


def test_lines_that_have_not_settled_are_named_with_their_numbers() -> None:
    own = {"offset_dn": -1.4, "gain_percent": 1.4, "length_pixels": 5.0}
    true = camera(effect("line_settling", edge="right", **own))
    words = frozenset({"line_settling", "column_prnu", "column_fpn", "shading", "amp_glow"})
    found = _found(true, words)
    (named,) = found.omitted_physics
    assert named.effect == "line_settling"
    assert not found.unexplained
    for name, value in own.items():
        fitted = named.parameters[name]
        assert abs(fitted.value - value) < 4 * fitted.standard_error  # type: ignore[operator] # one number
    (where,) = [m.where for m in found.mismatches if m.statistic == "fixed_edge"]
    assert where.columns == (128 - 16, 128 - 1)
    assert where.rows is None


@pytest.mark.long
def test_two_edges_are_two_effects_and_offset_and_gain_have_lengths_of_their_own() -> None:
    left = {
        "offset_dn": -17.0,
        "gain_percent": 2.1,
        "length_pixels": 9.0,
        "gain_length_pixels": 5.0,
    }
    top = {"gain_percent": 1.0, "length_pixels": 3.0}
    effects = effect("line_settling", **left), effect("line_settling", edge="top", **top)
    words = frozenset({"line_settling", "row_prnu", "column_prnu", "shading", "amp_glow"})
    found = _found(camera(*effects), words)
    assert {one.effect for one in found.omitted_physics} == {"line_settling"}
    assert not found.unexplained
    by_edge = {one.choices["edge"]: one.parameters for one in found.omitted_physics}
    assert by_edge.keys() == {"left", "top"}
    for edge, planted in (("left", left), ("top", top)):
        for name, value in planted.items():
            fitted = by_edge[edge][name]
            assert abs(fitted.value - value) < 4 * fitted.standard_error  # type: ignore[operator] # one number


@pytest.mark.long
def test_without_its_word_nothing_else_is_named() -> None:
    one = effect("line_settling", gain_percent=1.4, length_pixels=5.0)
    words = frozenset({"column_prnu", "column_fpn", "shading", "amp_glow", "tap_mismatch"})
    found = _found(camera(one), words)
    assert not [one.effect for one in found.omitted_physics]
    assert any(m.statistic == "fixed_edge" for m in found.unexplained)


@pytest.mark.long
def test_one_column_at_the_edge_is_no_decay() -> None:
    stacks = recorded(camera(), 9, columns=64, levels=TWO_LEVELS)
    assert stacks.stacks is not None
    for stack in stacks.stacks.values():
        stack[:, :, 0] += 5
    words = frozenset({"line_settling", "amp_glow", "shading"})
    found = find_mismatch(camera(), stacks, seed=1, vocabulary=words)
    assert not found.omitted_physics
    assert "fixed_edge" in {m.statistic for m in found.unexplained}


@pytest.mark.parametrize("detail", ["columns, last, near", "offset alone columns, last, far"])
def test_numbers_of_edges_and_contrasts_of_them_say_their_lines(detail: str) -> None:
    key = Key("fixed_edge", "contrast", "", "", detail)
    assert lines_of(key, "columns", 128) == (112, 127)
    assert lines_of(key, "rows", 96) is None


def test_one_hot_pixel_at_the_edge_is_no_decay() -> None:
    rng = np.random.default_rng(4)
    image = rng.normal(0, 1, (48, 64))
    image[20, 0] += 400.0
    assert abs(parts(image, 1.0).numbers["fixed_edge of columns, first, near"][0]) < SURE


def test_a_named_decay_says_at_which_edge() -> None:
    values = finding_values(NAMED)
    (named,) = values["omitted_physics"]
    assert named["choices"] == {"edge": "top"}
    assert "edge top; length 6.00 ± 0.50 pixels" in verdict(NAMED)[0]
    assert "edge top" in summary(NAMED)


def test_many_effects_are_named_without_their_numbers() -> None:
    (one,) = NAMED.omitted_physics
    others = [replace(one, effect=kind) for kind in ("row_noise", "prnu", "flicker")]
    many = replace(NAMED, omitted_physics=(one, one, *others))
    said = verdict(many)[0]
    assert "pixels" not in said
    assert said.count("lines that have not settled (2 of them)") == 1
    assert "row noise" in said
