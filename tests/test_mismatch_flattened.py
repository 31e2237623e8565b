"""Flats at a full well are no part of the line; what frames' wander and glows allow is no more."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.stats

from analysis.mismatch.bank.key import Key
from analysis.mismatch.flattened import flattened
from analysis.mismatch.null import _grown
from analysis.mismatch.uneven import uneven
from analysis.mismatch.unmet import _of_its_map
from analysis.mismatch.wander import by_lines, wandering_dn2
from dsis.effects import registry
from mismatch_recordings import camera

SLOPE, READ = 2.0, 30.0
MODEL = camera(segments=((SLOPE, READ, None),))


def _layout(flats: int) -> Any:
    exposures = [SimpleNamespace(name="dark", kind="dark", numbers=range(8))]
    exposures += [
        SimpleNamespace(name=f"flat-{i}", kind="flat", numbers=range(8)) for i in range(flats)
    ]
    return SimpleNamespace(uniform=exposures, channels=("MONO",), rows=10, columns=20)


def _levels(signals: list[float], full_well: float, curvature: float = 0.0) -> Any:
    """Return levels of a censored normal law, drawn apart from the effect."""
    rng = np.random.default_rng(1)
    found = {("dark", "MONO"): SimpleNamespace(level_dn=0.0, variance_dn2=READ)}
    for i, signal in enumerate(signals):
        shot = rng.normal(signal, np.sqrt(SLOPE * signal * (1 - curvature * signal)), 20_000)
        seen = np.minimum(shot, full_well) + rng.normal(0, np.sqrt(READ), shot.size)
        level = SimpleNamespace(level_dn=seen.mean(), variance_dn2=seen.var())
        found[f"flat-{i}", "MONO"] = level
    return found


SIGNALS = [100.0, 400.0, 900.0, 1600.0, 2500.0]


@pytest.mark.parametrize(
    ("full_well", "curvature", "expected"),
    [
        (1e9, 0.0, set()),
        (2300.0, 0.0, {"flat-4"}),
        (1500.0, 0.0, {"flat-3", "flat-4"}),
        (800.0, 0.0, {"flat-2", "flat-3", "flat-4"}),
        (1e9, 2e-4, set()),  # charge that is shared takes half of the brightest's variance
    ],
)
def test_flats_at_the_full_well_are_left_out(
    full_well: float, curvature: float, expected: set[str]
) -> None:
    found = flattened(_layout(5), _levels(SIGNALS, full_well, curvature), MODEL, {})
    assert found == expected


def test_two_flats_below_are_needed() -> None:
    assert flattened(_layout(2), _levels(SIGNALS[:2], 300.0), MODEL, {}) == frozenset()
    assert flattened(_layout(3), _levels(SIGNALS[:3], 800.0), MODEL, {}) == {"flat-2"}


def _two_paths(signals: list[float], switch: float, slope: float) -> Any:
    """Return levels of two read-out paths, the slope of the second smaller."""
    found = {("dark", "MONO"): SimpleNamespace(level_dn=0.0, variance_dn2=READ)}
    for i, x in enumerate(signals):
        variance = READ + SLOPE * x if x < switch else 2 * READ + slope * x
        found[f"flat-{i}", "MONO"] = SimpleNamespace(level_dn=x, variance_dn2=variance)
    return found


@pytest.mark.parametrize("slope", [0.5, 0.2, 0.1])
def test_a_path_of_less_slope_is_no_full_well(slope: float) -> None:
    signals = [150.0, 300.0, 600.0, 900.0, 1200.0, 2000.0, 3300.0]
    levels = _two_paths(signals, 1000.0, slope)
    two = camera(segments=((SLOPE, READ, 1000.0), (slope, 2 * READ, None)))
    assert flattened(_layout(7), levels, two, {}) == frozenset()
    # Slope and intercept a fifth off are numbers to be fitted.
    off = camera(segments=((1.2 * SLOPE, READ, 1000.0), (0.8 * slope, 2 * READ, None)))
    assert flattened(_layout(7), levels, off, {}) == frozenset()
    levels["flat-6", "MONO"].variance_dn2 = 2 * READ  # the well is full, not only the first path
    assert flattened(_layout(7), levels, two, {}) == {"flat-6"}


@pytest.mark.parametrize("slope", [0.5, 0.3])
def test_a_path_that_the_camera_lacks_is_no_full_well(slope: float) -> None:
    signals = [150.0, 300.0, 600.0, 900.0, 1200.0, 1700.0, 2500.0, 3300.0]
    assert flattened(_layout(8), _two_paths(signals, 1000.0, slope), MODEL, {}) == frozenset()


def test_levels_are_known_no_better_than_frames_that_wander_allow() -> None:
    layout = _layout(1)
    layout.variance_dn2 = {("flat-0", "MONO"): 50.0, ("dark", "MONO"): 30.0}
    keys = [
        Key("frame_variance", "exposure", "flat-0", "MONO"),
        Key("level", "exposure", "flat-0", "MONO"),
        Key("level", "exposure", "dark", "MONO"),
    ]
    # Means of 200 pixels have 50 / 200 DN^2; frames that scatter by 9 times as much have 8 more.
    model, recorded = np.array([1.0, 0.0, 0.0]), np.array([9 ** (1 / 3), 3.0, 0.0])
    added = wandering_dn2(layout, keys, model, recorded)
    assert added == pytest.approx([0.0, 8 * 50 / 200 / 8, 0.0])
    rng = np.random.default_rng(2)
    frames = rng.normal(0, np.sqrt(9 * 50 / 200), (4000, 8))
    assert frames.mean(1).var() == pytest.approx(50 / 200 / 8 + added[1], rel=0.1)
    assert wandering_dn2(layout, keys, model, np.array([0.5, 3.0, 0.0])) == pytest.approx([0, 0, 0])


def test_a_level_scatters_by_the_noise_of_rows_and_columns_too() -> None:
    """Means of frames with noise of lines, drawn: their own number counts from there on."""
    rows, columns, frames, pixel, row, column = 12, 20, 8, 50.0, 1.5, 0.8
    rng = np.random.default_rng(4)
    shape = (4000, frames)
    means = np.sqrt(pixel / rows / columns) * rng.standard_normal(shape)
    means += row * rng.standard_normal((*shape, rows)).mean(2)
    means += column * rng.standard_normal((*shape, columns)).mean(2)
    place = ("dark", "MONO")
    ratios = {
        "frame_variance": 1.0,
        "row_variance": 1 + columns * row**2 / pixel,
        "column_variance": 1 + rows * column**2 / pixel,
    }
    keys = [*(Key(name, "exposure", *place) for name in ratios), Key("level", "exposure", *place)]
    model = np.array([*np.cbrt(list(ratios.values())), 0.0])
    still = by_lines(keys, model)[place]
    grown = _grown(keys, model)[-1]
    assert grown == pytest.approx(np.sqrt(still), rel=1e-12)
    alone = pixel / rows / columns / frames
    assert means.mean(1).var() == pytest.approx(alone * grown**2, rel=0.06)
    # Frames that wander besides do so beyond all of this.
    model[0] = np.cbrt(1 + 0.6**2 * rows * columns / pixel / still)
    wander = 0.6 * rng.standard_normal(shape)
    scatter = (means + wander).mean(1).var()
    assert scatter == pytest.approx(alone * _grown(keys, model)[-1] ** 2, rel=0.06)
    layout: Any = SimpleNamespace(
        uniform=[SimpleNamespace(name="dark", numbers=range(frames))],
        channels=("MONO",),
        rows=rows,
        columns=columns,
        variance_dn2={place: pixel},
    )
    recorded, model = model.copy(), np.where(np.arange(4) == 0, 1.0, model)
    added = wandering_dn2(layout, keys, model, recorded)[-1]
    assert added == pytest.approx(0.6**2 / frames, rel=1e-9)


def test_what_stays_of_offsets_says_nothing_of_gains() -> None:
    scopes = ["exposure", "offset", "gain", "gain alone"]
    keys = [Key("fixed_pixel_variance", scope) for scope in scopes]
    null = SimpleNamespace(keys=keys, known=np.ones(4, bool))
    assert _of_its_map(_state(null), "prnu").tolist() == [False, False, True, False]
    assert _of_its_map(_state(null), "dsnu").tolist() == [False, True, False, False]
    assert _of_its_map(_state(null), "row_noise").all()
    null.known[2] = False  # one level: a map has both
    assert _of_its_map(_state(null), "prnu").all()


def _state(null: Any) -> Any:
    return SimpleNamespace(null=null)


@pytest.mark.parametrize(("rate", "denied"), [(0.01, True), (0.03, False)])
def test_a_glow_may_reach_all_of_the_sensor(rate: float, denied: bool) -> None:
    glow = registry()["amp_glow"](dn_per_s=0.06, place="right", extent=0.2)
    seen = SimpleNamespace(images={})  # no map tells
    state: Any = SimpleNamespace(
        camera=SimpleNamespace(effect=(glow,)), setting=SimpleNamespace(seen=seen, layout=None)
    )
    found = uneven(state, registry()["dark_current"](dn_per_s=rate))
    assert (found is not None) is denied
    # A glow of 1 / r has so much where it is least, of 0.06 at its edge and 0.2 of the sensor.
    assert pytest.approx(0.01) == 0.06 * 0.2 / (1 + 0.2)


@pytest.mark.parametrize(
    ("above", "left_out"), [(0.0, True), (0.5, True), (0.9, True), (2.0, False), (20.0, False)]
)
def test_a_flat_whose_noise_is_cut_is_left_out_by_its_skewness(
    above: float, *, left_out: bool
) -> None:
    """A full well so many standard deviations above the brightest signal: a third or more stays."""
    top = SIGNALS[-1]
    full_well = top + above * (SLOPE * top) ** 0.5
    rng = np.random.default_rng(2)
    shot = np.minimum(rng.normal(top, (SLOPE * top) ** 0.5, 20_000), full_well)
    skewness = {("flat-4", "MONO"): float(scipy.stats.skew(shot))}
    levels = _levels(SIGNALS, full_well)
    assert flattened(_layout(5), levels, MODEL, skewness) == ({"flat-4"} if left_out else set())
    assert flattened(_layout(5), levels, MODEL, {}) == set()
