"""Promise: on locked frames an effect is judged as well beside spikes and full wells as alone."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.edged import single
from analysis.mismatch.layout import Layout
from analysis.mismatch.prove import Loglik, gain_of, heldout_gain
from analysis.mismatch.prove.learning import law_of
from analysis.mismatch.prove.proof import loglik_of
from analysis.mismatch.prove.sites import means_of_most
from dsis.cfa import Cfa
from dsis.effects import registry
from dsis.effects.line_settling import LineSettling
from mismatch_recordings import camera, held_of, recorded, signals

SPIKES = registry()["impulse"](per_megapixel_frame=1500.0, mean_dn=3000.0)
FULL = registry()["saturation"](full_well_dn=2590.0)
BEND = registry()["nonlinearity"](percent_full_scale=0.25)


@pytest.mark.parametrize("seed", range(3))
def test_spikes_hide_no_bent_response(seed: int) -> None:
    """A bend moves levels of flats: what darks say of it, its spikes included, is nothing.

    Odds of 100, which chance has in 1 % of recordings at most.
    """
    held = held_of(recorded(camera(SPIKES, BEND), 30 + seed))
    cameras = (camera(SPIKES), camera(SPIKES, BEND))
    without, with_ = (loglik_of(held, own, signals(), seed=seed) for own in cameras)
    frames = sum(own.size for own in with_.frames.values())
    assert heldout_gain(without, with_, seed=seed).nats_per_frame * frames > np.log(100)
    for dark in ("dark-0", "dark-1"):
        assert np.abs(with_.frames[dark] - without.frames[dark]).max() < 1.0


def test_rare_spikes_drown_no_fixed_pattern() -> None:
    """Of hundreds of standard deviations, a few pixels in ten thousand.

    All others' pattern is known as well as without, and the spikes gain: odds of 100.
    """
    spikes = registry()["impulse"](per_megapixel_frame=60.0, mean_dn=1500.0)
    dsnu = registry()["dsnu"](sigma_dn=1.0)
    held = held_of(recorded(camera(dsnu, spikes), 60))
    hit, calm = (law_of(camera(dsnu, *own), held, signals(), 1) for own in ((spikes,), ()))
    pairs = list(zip(hit.patterns, calm.patterns, strict=True))
    assert pairs
    for own, other in pairs:
        assert np.array_equal(own.gains, other.gains)
        assert other.gains.max() > 0.1
    gain = gain_of(held, camera(dsnu, spikes), camera(dsnu), signals(), seed=1)
    assert gain.nats_per_frame * sum(e.codes.shape[0] for e in held.locked) > np.log(100)


def test_spikes_gain_beside_pixels_that_jump() -> None:
    """Their far noise is where training frames had it: a spike's is not."""
    spikes = registry()["impulse"](per_megapixel_frame=60.0, mean_dn=1500.0)
    rts = registry()["rts"](pixel_fraction=0.01, amplitude_dn=8.0)
    held = held_of(recorded(camera(rts, spikes), 61))
    gain = gain_of(held, camera(rts, spikes), camera(rts), signals(), seed=1)
    assert gain.nats_per_frame * sum(e.codes.shape[0] for e in held.locked) > np.log(100)


def test_row_gains_are_seen_beside_a_full_well() -> None:
    rows = registry()["row_prnu"](sigma_percent=0.06)
    held = held_of(recorded(camera(FULL, rows), 7))
    assert gain_of(held, camera(FULL, rows), camera(FULL), signals(), seed=1).ci95[0] > 0


def test_what_a_full_well_makes_of_codes_speaks_for_nothing_else() -> None:
    """A model whose full well is off by 1 DN: another effect could gain thousands of nats by it."""
    held = held_of(recorded(camera(FULL), 8))
    near = registry()["saturation"](full_well_dn=2591.0)
    other = registry()["crosstalk"](fraction=0.002)
    one, two = (
        loglik_of(held, own, signals(), seed=1) for own in (camera(near), camera(near, other))
    )
    assert one.filled == two.filled == {"flat-5"}
    assert heldout_gain(one, two, seed=1).nats_per_frame < 1.0


def test_full_exposures_count_where_only_one_model_has_them() -> None:
    zero = {name: np.zeros(2) for name in ("a", "b")}
    more = {"a": np.full(2, 1.0), "b": np.full(2, 100.0)}
    levels = dict.fromkeys(zero, 0.0)
    full = frozenset({"b"})
    gains = [
        heldout_gain(Loglik(zero, levels, before), Loglik(more, levels, after), seed=1)
        for before, after in ((full, full), (frozenset(), full), (full | {"a"}, full | {"a"}))
    ]
    assert [gain.nats_per_frame for gain in gains] == [1.0, 50.5, 50.5]


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
def test_means_without_spikes(cfa: Cfa) -> None:
    """Of normal noise the mean itself; of noise with spikes that of the pixels without."""
    rng = np.random.default_rng(5)
    plain = rng.normal(100.0, 3.0, (2, 64, 64))
    places = [(slice(None), slice(None))] if cfa is Cfa.MONO else [
        (slice(y, None, 2), slice(x, None, 2)) for y in (0, 1) for x in (0, 1)]  # fmt: skip
    means = [[frame[place].mean() for place in places] for frame in plain]
    assert means_of_most(plain, cfa) == pytest.approx(np.array(means), rel=1e-12)
    hit = rng.random(plain.shape) < 0.01
    spiky = np.where(hit, plain + rng.exponential(2000.0, plain.shape) + 50.0, plain)
    left = [[f[p][~h[p]].mean() for p in places] for f, h in zip(plain, hit, strict=True)]
    assert means_of_most(spiky, cfa) == pytest.approx(np.array(left), abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_rare_codes_of_a_quiet_sensor_are_no_spikes(seed: int) -> None:
    """Noise of a fifth of a code: the rare code beside the others says where the mean lies."""
    rng = np.random.default_rng(seed)
    codes = np.rint(rng.normal(100.1, 0.2, (1, 200, 200)))
    assert (codes != 100).mean() < 1 / 37
    assert means_of_most(codes, Cfa.MONO, 1.0) == pytest.approx(codes.mean((1, 2))[:, np.newaxis])


ROWS, COLUMNS = 96, 128
LINE = np.linspace(-1, 1, ROWS)[:, np.newaxis]
STEP = np.where(LINE < 0, -0.5, 0.5)
DECAY = np.exp(-np.arange(ROWS) / 6.0)[:, np.newaxis]


@pytest.mark.parametrize(
    ("rows", "left", "denied"),
    [
        (-3 * LINE**2, "fixed_smooth_falloff", True),  # bowed light
        (3 * STEP, "half_seam", True),  # halves
        (3 * DECAY, "fixed_smooth_variance", False),  # the decay itself
        (3 * DECAY - 6 * LINE**2, "fixed_smooth_falloff", False),  # and beside bowed light
        (3 * DECAY, "row_variance", False),
    ],
)
@pytest.mark.parametrize("edge", ["top", "bottom"])
def test_surfaces_that_are_left_are_no_decay(rows: Any, left: str, denied: bool, edge: Any) -> None:
    """A map of a gain, per cent, pixel noise 1; signals of 100 DN make it DN too."""
    image = np.random.default_rng(2).standard_normal((ROWS, COLUMNS))
    image += rows if edge == "top" else rows[::-1]
    scale = SimpleNamespace(scales={"gain": 100.0})
    plain = Layout((), ROWS, COLUMNS, Cfa.MONO, 0.0, 4095.0, {}, {})
    state: Any = SimpleNamespace(
        camera=SimpleNamespace(effect=()),
        mismatches=[SimpleNamespace(statistic=left)],
        setting=SimpleNamespace(
            layout=SimpleNamespace(
                rows=ROWS,
                columns=COLUMNS,
                sites=plain.sites,
                from_edge=plain.from_edge,
                regressors=lambda _: scale,
            ),
            seen=SimpleNamespace(images={("MONO", "gain"): (image, 1.0)}),
        ),
    )
    effect = LineSettling(gain_percent=3.0, length_pixels=6.0, edge=edge)
    assert (single(state, effect) is not None) == denied
