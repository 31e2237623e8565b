"""A mean of frames that are alike varies more: that is no fixed pattern."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.coloured import coloured
from analysis.mismatch.feigned import (
    feigned,
    heated,
    outlying,
    stepped,
)
from analysis.mismatch.standout import side_by_side
from dsis.effects.hot_pixels import HotPixels
from dsis.effects.rts import Rts

NUMBERS = (0, 1, 2, 4, 5, 6)  # of eight frames two are locked
FRAMES, PIXELS = 6, 200_000
JUMPS = Rts(pixel_fraction=0.02, amplitude_dn=2.0)


def _state(rho: float, pattern: float, located: bool = True) -> Any:
    """Return a state whose numbers are those of drawn frames, correlated with the one before."""
    rng = np.random.default_rng(6)
    frames = [rng.standard_normal(PIXELS)]
    for _ in range(NUMBERS[-1]):
        frames.append(rho * frames[-1] + (1 - rho**2) ** 0.5 * rng.standard_normal(PIXELS))
    kept = np.array(frames)[list(NUMBERS)]
    # As it is measured: over all neighbours that are kept, gaps included.
    seen = float(np.mean([(a * b).mean() for a, b in pairwise(kept)]))
    mean = kept.mean(0) + pattern * rng.standard_normal(PIXELS)
    ratio = mean.var() * FRAMES  # 1 for frames that know nothing of one another
    keys = tuple(
        Key(statistic=s, scope="exposure", exposure="flat", channel="MONO", detail="")
        for s in ("frame_correlation", "fixed_pixel_variance")
    )
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(exposures=[SimpleNamespace(name="flat", numbers=NUMBERS)])
        ),
        vector=SimpleNamespace(keys=keys, values=np.array([seen, np.cbrt(ratio)])),
        null=SimpleNamespace(
            mean=np.array([0.0, np.cbrt(ratio)]), sd=np.full(2, 1e-3), known=np.ones(2, bool)
        ),
        mismatches=[SimpleNamespace(statistic="frame_correlation")] if located else [],
    )


WITHOUT = np.array([0.0, 1.0])


@pytest.mark.parametrize("kind", ["dsnu", "prnu", "hot_pixels"])
@pytest.mark.parametrize("rho", [0.03, 0.1])
def test_frames_that_are_alike_are_no_pattern(kind: str, rho: float) -> None:
    """Their mean varies by 1 + 2 rho 4 / 6: four of six frames follow another one."""
    said = feigned(_state(rho, 0.0), kind, WITHOUT)
    assert said is not None
    assert abs(said.share) < 0.12


def test_a_pattern_beside_them_is_believed() -> None:
    assert feigned(_state(0.03, 0.5), "prnu", WITHOUT) is None


def test_what_is_explained_or_another_effect_feigns_nothing() -> None:
    assert feigned(_state(0.1, 0.0, located=False), "prnu", WITHOUT) is None
    assert feigned(_state(0.1, 0.0), "row_fpn", WITHOUT) is None


def _over_all(rho: float, pattern_dn: float, seed: int) -> Any:
    """Return a state whose map of offsets is drawn: a dark, and a flat whose frames are alike."""
    rng = np.random.default_rng(seed)
    sd_dn, pixels = {"dark": 0.6, "flat": 1.2}, 12_000
    pattern = pattern_dn * rng.standard_normal(pixels)
    top, bottom, noise = np.zeros(pixels), 0.0, 0.0
    for name, sd in sd_dn.items():
        own = rho if name == "flat" else 0.0
        frames = [rng.standard_normal(pixels)]
        for _ in range(FRAMES - 1):
            frames.append(own * frames[-1] + (1 - own**2) ** 0.5 * rng.standard_normal(pixels))
        mean, variance = sd * np.mean(frames, 0) + pattern, sd**2 / FRAMES
        top, bottom, noise = top + mean / variance, bottom + 1 / variance, noise + 1 / variance
    ratio = (top / bottom).var() / (noise / bottom**2)
    keys = [
        Key(statistic="frame_correlation", scope="exposure", exposure=e, channel="MONO", detail="")
        for e in sd_dn
    ]
    keys.append(
        Key(
            statistic="fixed_pixel_variance", scope="offset", exposure="", channel="MONO", detail=""
        )
    )
    numbers = tuple(range(FRAMES))
    return SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(
                exposures=[SimpleNamespace(name=e, numbers=numbers) for e in sd_dn]
            ),
            seen=SimpleNamespace(
                levels={(e, "MONO"): SimpleNamespace(variance_dn2=s**2) for e, s in sd_dn.items()}
            ),
        ),
        vector=SimpleNamespace(keys=tuple(keys), values=np.array([0.0, rho, np.cbrt(ratio)])),
        null=SimpleNamespace(
            mean=np.array([0.0, 0.0, np.cbrt(ratio)]),
            sd=np.array([1e-3, 1e-3, (2 / pixels) ** 0.5 / 3]),
            known=np.ones(3, bool),
        ),
        mismatches=[SimpleNamespace(statistic="frame_correlation")],
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_map_over_all_exposures_has_what_the_alike_ones_give_it(seed: int) -> None:
    """Of a fifth of its weight, but for chance: the dark beside them shows no offsets."""
    without = np.array([0.0, 0.0, 1.0])
    assert feigned(_over_all(0.3, 0.0, seed), "dsnu", without) is not None
    assert feigned(_over_all(0.3, 0.12, seed), "dsnu", without) is None
    assert feigned(_over_all(0.0, 0.12, seed), "dsnu", without) is None


ROWS, COLUMNS = 48, 64


def _lines(columns: Any, name: str = "offset alone", located: str = "half_seam") -> Any:
    """Return a state with a map of pixel noise 1 whose columns differ: (column,)."""
    image = np.random.default_rng(3).standard_normal((ROWS, COLUMNS)) + columns
    return SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", name): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic=located)],
    )


HALVES = np.where(np.arange(COLUMNS) < COLUMNS / 2, -0.5, 0.5)
COMB = np.where(np.arange(COLUMNS) % 2 == 0, -0.5, 0.5)
WHITE = np.random.default_rng(4).normal(0, 0.5, COLUMNS)


@pytest.mark.parametrize("name", ["offset alone", "offset"])
@pytest.mark.parametrize("columns", [HALVES, COMB])
def test_halves_that_differ_as_a_whole_are_no_column_pattern(columns: Any, name: str) -> None:
    said = stepped(_lines(columns, name), "column_fpn")
    assert said is not None
    assert abs(said.share) < 0.2
    assert stepped(_lines(columns, name), "row_fpn") is None
    assert stepped(_lines(columns, name, "row_variance"), "column_fpn") is None


@pytest.mark.parametrize("columns", [WHITE, WHITE + 0.5 * HALVES])
def test_columns_that_differ_one_by_one_are_believed(columns: Any) -> None:
    assert stepped(_lines(columns), "column_fpn") is None


@pytest.mark.parametrize(
    ("effect", "scope", "z", "warm", "denied"),
    [
        (JUMPS, "time", 8.0, 40, True),
        (JUMPS, "time", 2.0, 40, False),
        (JUMPS, "offset", 8.0, 40, False),
        (HotPixels(pixel_fraction=0.01, mean_dn_per_s=5.0), "time", 8.0, 40, False),
        (JUMPS, "time", 8.0, 2, False),  # far fewer than those that jump
    ],
)
def test_hot_pixels_that_have_no_word_do_not_jump(
    effect: Any, scope: str, z: float, warm: int, denied: bool
) -> None:
    keys = (Key("outlying_pixels", scope, "", "R"),)
    image = np.random.default_rng(1).normal(size=(100, 100))
    image.flat[: 25 * warm : 25] = 8.0
    state: Any = SimpleNamespace(
        vector=None,
        setting=SimpleNamespace(
            seen=SimpleNamespace(images={("R", "time"): (image, 1.0)}),
            layout=SimpleNamespace(uniform=[SimpleNamespace(exposure_time_s=0.01)]),
        ),
        null=SimpleNamespace(keys=keys, departures=lambda _: np.array([z])),
    )
    assert (heated(state, effect) is not None) == denied


@pytest.mark.parametrize(("kind", "name"), [("dsnu", "offset"), ("prnu", "gain alone")])
@pytest.mark.parametrize(("spread", "denied"), [(0.0, True), (1.0, False)])
def test_few_pixels_that_stand_out_are_no_pattern(
    kind: str, name: str, spread: float, denied: bool
) -> None:
    rng = np.random.default_rng(6)
    image = rng.normal(0, np.hypot(1, spread), (ROWS, COLUMNS))
    image[rng.random(image.shape) < 0.002] += 20  # a variance of 0.8 in all
    state = _lines(0.0, name, "outlying_pixels")
    state.setting.seen.images["MONO", name] = (image, 1.0)
    assert (outlying(state, kind, np.zeros(0)) is not None) == denied
    state.mismatches[0].statistic = "fixed_pixel_variance"
    assert outlying(state, kind, np.zeros(0)) is None


@pytest.mark.parametrize("shape", [(40, 60), (61, 97), (96, 128)])
@pytest.mark.parametrize(("kind", "name"), [("dsnu", "offset"), ("prnu", "gain")])
@pytest.mark.parametrize(
    ("pattern", "bend", "denied"),
    [(0.0, 0.0, True), (0.0, 2.0, True), (0.3, 0.0, True), (1.5, 0.0, False), (1.5, 2.0, False)],
)
def test_a_wave_is_no_pattern_of_all_pixels(
    shape: tuple[int, int], kind: str, name: str, pattern: float, bend: float, denied: bool
) -> None:
    """A wave of variance 1, of straight crests or bent ones, in noise of 1, rows and a tilt."""
    rng = np.random.default_rng(3)
    y, x = np.indices(shape)
    angle = 2 * np.pi * (0.11 * x + 0.07 * y) + bend * np.sin(2 * np.pi * y / shape[0])
    image = rng.normal(0, 1, shape) + pattern * rng.normal(0, 1, shape) + np.sqrt(2) * np.cos(angle)
    image += rng.normal(0, 1, (shape[0], 1)) + 3 * x / shape[1]
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", name): (image, 1.0)})),
        mismatches=[SimpleNamespace(statistic="fixed_spectral_peak")],
    )
    assert (coloured(state, kind) is not None) == denied
    state.mismatches[0].statistic = "fixed_pixel_variance"
    assert coloured(state, kind) is None


def test_a_map_that_is_noise_but_for_few_pixels_denies_nothing_by_chance() -> None:
    """Its variance beyond noise is a hundredth: the median bin is known no better than that."""
    rng, denied = np.random.default_rng(6), 0
    for _ in range(100):
        image = rng.normal(0, 1, (48, 64))
        image.flat[rng.integers(0, image.size, 3)] += 5.0
        state: Any = SimpleNamespace(
            setting=SimpleNamespace(seen=SimpleNamespace(images={("MONO", "time"): (image, 1.0)})),
            mismatches=[SimpleNamespace(statistic="fixed_correlation_0_1")],
        )
        denied += coloured(state, "hot_pixels") is not None
    assert denied == 0


@pytest.mark.parametrize(
    ("scope", "explained", "denied"),
    [("time", 0.1, True), ("time", 0.9, False), ("offset", 0.1, False)],
)
def test_hot_pixels_are_denied_by_those_that_grow_with_time(
    scope: str, explained: float, denied: bool
) -> None:
    """Few pixels that jump stand out of offsets and gains, too: they are no hot ones.

    Of hot pixels whose heights have another law some are left, and a fourth moment that is theirs.
    """
    state = _lines(0.0, "time alone", "outlying_pixels")
    image, _ = state.setting.seen.images["MONO", "time alone"]
    image[::16, ::16] += 40
    keys = tuple(Key("outlying_pixels", scope, "", "MONO", detail) for detail in ("", "5"))
    without = np.zeros(2)
    state.vector = SimpleNamespace(keys=keys, values=np.array([30.0, 30.0]))
    state.null = SimpleNamespace(
        keys=keys,
        known=np.array([True, True]),
        sd=np.ones(2),
        mean=np.array([3.0, 30.0 * explained]),
        departures=lambda _: np.array([30.0, 30.0]),
    )
    assert (outlying(state, "hot_pixels", without) is not None) == denied


@pytest.mark.parametrize(("spread", "denied"), [(0.0, True), (0.5, False)])
def test_few_pixels_are_found_in_the_map_that_shows_them(spread: float, denied: bool) -> None:
    """Offsets that jump stand out of the gains where no offsets are taken off, and are no PRNU."""
    rng = np.random.default_rng(7)
    state = _lines(0.0, "gain", "outlying_pixels")
    pattern = rng.normal(0, spread, (ROWS, COLUMNS))
    few = np.where(rng.random(pattern.shape) < 0.002, 20.0, 0.0)
    images = state.setting.seen.images
    images["MONO", "gain"] = (pattern + rng.normal(0, 1, pattern.shape), 1.0)
    images["MONO", "gain alone"] = (2 * pattern + few + rng.normal(0, 1, pattern.shape), 1.0)
    assert (outlying(state, "prnu", np.zeros(0)) is not None) == denied


def _warm(share: float, trail: int, seed: int) -> Any:
    """Return a state whose map of what grows with time has hot pixels, and trails below them."""
    rng = np.random.default_rng(seed)
    state = _lines(0.0, "time alone", "outlying_pixels")
    heights = np.where(rng.random((ROWS, COLUMNS)) < share, rng.exponential(60.0), 0.0)
    image = rng.standard_normal(heights.shape)
    for down in range(trail):
        image[down:] += (heights * np.exp(-down / 5))[: ROWS - down]
    state.setting.seen.images["MONO", "time alone"] = (image, 1.0)
    return state


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("share", "trail", "denied"), [(0.003, 1, False), (0.1, 1, False), (0.003, 12, True)]
)
def test_trails_are_no_hot_pixels(share: float, trail: int, denied: bool, seed: int) -> None:
    state = _warm(share, trail, seed)
    assert (side_by_side(state, "hot_pixels") is not None) == denied
    assert side_by_side(state, "dsnu") is None


def test_pixels_of_a_glow_are_no_clusters() -> None:
    """Nearly all that stand out have a neighbour that does, but not of what is around them."""
    state = _warm(0.003, 1, 6)
    image, _ = state.setting.seen.images["MONO", "time alone"]
    y, x = np.mgrid[:ROWS, :COLUMNS]
    image += 60 * np.exp(-np.hypot(y, x) / (0.2 * COLUMNS))
    assert (image > 5).mean() > 0.05
    assert side_by_side(state, "hot_pixels") is None


def test_charge_that_hot_pixels_share_makes_no_clusters() -> None:
    state = _warm(0.003, 1, 5)
    image, _ = state.setting.seen.images["MONO", "time alone"]
    image[1:] += 0.15 * image[:-1].clip(10) - 1.5
    assert side_by_side(state, "hot_pixels") is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("together", "denied"), [(16, True), (1, False)])
def test_what_is_written_into_a_line_of_frames_does_not_jump(
    together: int, denied: bool, seed: int
) -> None:
    """A counter in the first pixels, say; random telegraphs lie anywhere."""
    rng = np.random.default_rng(seed)
    state = _lines(0.0, "variance", "variance_spread")
    image = rng.chisquare(40, (ROWS, COLUMNS)) - 40
    at = [(0, x) for x in range(16)]
    if together == 1:
        at = list(zip(rng.integers(ROWS, size=16), rng.integers(COLUMNS, size=16), strict=True))
    for y, x in at:
        image[y, x] += 2000 * rng.uniform(0.5, 1.0)
    state.setting.seen.images["MONO", "variance"] = (image, float(np.sqrt(80)))
    assert (side_by_side(state, "rts") is not None) == denied
    assert side_by_side(state, "read_noise_spread") is None


@pytest.mark.parametrize(("together", "denied"), [(True, True), (False, False)])
def test_neighbours_on_a_mosaic_lie_in_several_channels(together: bool, denied: bool) -> None:
    """Three pixels that count frames, two of one colour; apart they jump, as far as that tells."""
    rng = np.random.default_rng(3)
    state = _lines(0.0, "variance", "variance_spread")
    sites = {"R": (0, 0), "Gr": (0, 1), "Gb": (1, 0), "B": (1, 1)}
    whole = rng.chisquare(40, (ROWS, COLUMNS)) - 40
    at = [(0, 0), (0, 1), (0, 2)] if together else [(0, 0), (9, 21), (20, 12)]
    for (y, x), height in zip(at, (900, 1000, 800), strict=True):
        whole[y, x] += height
    state.setting.layout = SimpleNamespace(rows=ROWS, columns=COLUMNS, sites=sites)
    state.setting.seen.images.clear()
    for channel, (y, x) in sites.items():
        state.setting.seen.images[channel, "variance"] = (whole[y::2, x::2], float(np.sqrt(80)))
    assert (side_by_side(state, "rts") is not None) == denied
