"""The proof on locked frames: likelihood and gains say what they should."""

from functools import cache

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.prove import (
    Loglik,
    gain_of,
    heldout_gain,
    hold,
    hold_seen,
    loglik_of,
    prove,
    prove_held,
)
from analysis.mismatch.prove import held as held_module
from analysis.mismatch.prove.held import Held
from analysis.mismatch.prove.learning import law_of
from analysis.mismatch.prove.whittle import bin_counts, whittle_gain
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import Effect, registry
from dsis.grid import PixelGrid
from mismatch_recordings import (
    COLUMNS,
    FRAMES,
    LEVELS,
    LOCKED,
    ROWS,
    TRAINING,
    camera,
    held_of,
    recorded,
    signals,
)


def test_likelihood_of_white_noise_is_its_closed_form() -> None:
    """Codes of normal noise: ln(Phi(above) - Phi(below)) by scipy.stats, true level and variance.

    The program knows the level of a frame from 6 training frames only: the means of 16 frames cost
    ln(1 + 2 / 6) / 4 nats each on average, with a spread of order 1.
    """
    base = camera()
    recording = recorded(base, 3)
    found = loglik_of(held_of(recording), base, signals(), seed=1)
    away = []
    for name, signal in signals().items():
        sd = np.sqrt(20 + 0.5 * signal[0, 0])
        for k, number in enumerate(LOCKED):
            codes = recording.stacks[name][number] - 64.0 - signal[0, 0]
            upper, lower = (scipy.stats.norm.cdf((codes + h) / sd) for h in (0.5, -0.5))
            away.append(found.frames[name][k] - np.log(upper - lower).sum())
    assert np.abs(np.mean(away) + np.log(1 + 2 / 6) / 4) < 5 * np.std(away) / 4
    assert np.max(np.abs(away)) < 8  # of some 5e4 nats


def test_gain_of_row_noise_is_its_closed_form() -> None:
    """n directions of variance ratio F gain n (F - 1 - ln F) / 2 nats per frame, n = rows.

    The likelihood ratio's own standard deviation is (F - 1) sqrt(n / 2) per frame. Of five 95 %
    intervals three or more cover but for a chance of 1e-3.
    """
    sigma, levels, locked = 1.2, (400.0, 1600.0), tuple(range(3, 16, 4))
    true = camera(registry()["row_noise"](sigma_dn=sigma))
    ratios = {
        name: 1 + COLUMNS * sigma**2 / (20 + 1 / 12 + 0.5 * signal[0, 0])
        for name, signal in signals(levels).items()
    }
    wanted = sum(4 * ROWS * (f - 1 - np.log(f)) / 2 for f in ratios.values())
    variance = sum(4 * ROWS * (f - 1) ** 2 / 2 for f in ratios.values())
    seen, covered = [], 0
    for seed in range(5):
        held = held_of(recorded(true, seed, frames=16, levels=levels), locked)
        gain = gain_of(held, true, camera(), signals(levels), seed=seed)
        seen.append(gain.nats_per_frame * 16)
        covered += gain.ci95[0] < wanted / 16 < gain.ci95[1]
    assert abs(np.mean(seen) - wanted) < 5 * np.sqrt(variance / 5)
    assert covered >= 3


@given(st.floats(0.01, 0.12), st.floats(-0.1, 0.1))
def test_whittle_is_exact_on_a_torus(f: float, g: float) -> None:
    """A circulant Gaussian field by scipy's multivariate normal; the mean is left to levels."""
    rows, columns = 6, 8
    delta = np.zeros((rows, columns))
    delta[0, 0] = 1 - 2 * f - 2 * g
    delta[0, 1] = delta[0, -1] = f
    delta[1, 0] = delta[-1, 0] = g
    power = np.abs(np.fft.fft2(delta)) ** 2
    power[0, 0] = 1.0
    kernel = np.fft.ifft2(power).real
    place = [(y, x) for y in range(rows) for x in range(columns)]
    covariance = np.array(
        [[kernel[(y - v) % rows, (x - u) % columns] for v, u in place] for y, x in place]
    )
    field = np.random.default_rng(1).standard_normal((rows, columns))
    wanted = scipy.stats.multivariate_normal.logpdf(field.reshape(-1), cov=covariance)
    wanted -= scipy.stats.norm.logpdf(field).sum()
    counts = bin_counts((rows, columns), Cfa.MONO)
    found = whittle_gain(field, power[:, : columns // 2 + 1], counts)
    assert found == pytest.approx(wanted, abs=1e-8)


def test_spectrum_of_crosstalk_is_its_closed_form() -> None:
    """Shot noise through the kernel, read noise white: power of a kernel of nearest neighbours."""
    f, levels = 0.03, (1600.0,)
    true = camera(registry()["crosstalk"](fraction=f))
    held = held_of(recorded(true, 6, levels=levels))
    spectrum = law_of(true, held, signals(levels), 4).exposures["flat-0"].spectrum
    assert spectrum is not None
    y = np.cos(2 * np.pi * np.fft.fftfreq(ROWS))[:, np.newaxis]
    x = np.cos(2 * np.pi * np.fft.rfftfreq(COLUMNS))[np.newaxis]
    power = 800.0 * (1 - 4 * f + 2 * f * (x + y)) ** 2 + 20.0
    counts = bin_counts((ROWS, COLUMNS), Cfa.MONO)
    power /= (counts * power).sum() / counts.sum()
    inside = counts > 0
    # Lags of 8 frames have an error of 1 / sqrt(8 N) = 0.003; a bin adds up four times two of them.
    assert np.abs(spectrum - power)[inside].max() < 5 * 0.003 * 4
    # What the difference costs, nats per frame, is next to nothing of the gain.
    cost, gain = (
        0.5 * (counts * (power / p - 1 - np.log(power / p))).sum() for p in (spectrum, 1.0)
    )
    assert cost < 0.05 * gain


PLANTED = {
    "adc_dnl": {"rms_lsb": 0.1},
    "amp_glow": {"dn_per_s": 40.0},
    "bistable_pattern": {"amplitude_dn": 0.18, "frequency": (0.5, 0.5)},
    "black_level_drift": {"sigma_dn": 0.25},
    "brighter_fatter": {"per_dn": 5e-6},
    "channel_imbalance": {"gain_percent": 0.4},
    "column_fpn": {"sigma_dn": 0.2},
    "column_noise": {"sigma_dn": 0.4},
    "crosstalk": {"fraction": 0.015},
    "dark_current": {"dn_per_s": 15.0},
    "dsnu": {"sigma_dn": 0.6},
    "dual_gain_mismatch": {"gain_error_percent": 0.3},
    "flicker": {"sigma_percent": 0.08},
    "heavy_tailed_read_noise": {"tail_df": 18.0},
    "hot_pixels": {"pixel_fraction": 0.001, "mean_dn_per_s": 400.0},
    "image_lag": {"fraction": 0.04},
    "impulse": {"per_megapixel_frame": 200.0, "mean_dn": 300.0},
    "line_flicker": {"depth_percent": 0.12, "cycles_per_frame": 3.3},
    "nonlinearity": {"percent_full_scale": 0.25},
    "periodic_noise": {"amplitude_dn": 0.35, "frequency": (0.21, 0.13)},
    "pink_noise": {"sigma_dn": 0.5},
    "poisson_shot_noise": {},
    "prnu": {"sigma_percent": 0.2},
    "quantisation": {"step_dn": 2.0},
    "read_noise_spread": {"log_sigma": 0.12},
    "readout_memory": {"fraction": 0.025, "lag_pixels": 2},
    "row_fpn": {"sigma_dn": 0.2},
    "row_prnu": {"sigma_percent": 0.06},
    "column_prnu": {"sigma_percent": 0.06},
    "adc_memory": {"step_dn": 2.0, "period_codes": 64, "at_code": 20.0},
    "row_noise": {"sigma_dn": 0.4},
    "row_banding": {"sigma_dn": 0.4, "length_rows": 2.5},
    "rts": {"pixel_fraction": 0.01, "amplitude_dn": 8.0},
    "saturation": {"full_well_dn": 2690.0},
    "shading": {"falloff_percent": 0.4},
    "smooth_prnu": {"sigma_percent": 0.15, "length_pixels": 6.0},
    "spatial_filtering": {"fraction": 0.015},
    "tap_mismatch": {"gain_percent": 0.18},
    "line_settling": {"gain_percent": 0.6, "offset_dn": -1.0, "length_pixels": 6.0},
}
"""Strengths at some 20 standard deviations of the statistic that isolates each effect."""


def base_for(kind: str) -> Camera:
    """Return a base model that can have an effect, and show it."""
    if kind == "channel_imbalance":
        return camera(cfa="RGGB")
    if kind == "dual_gain_mismatch":
        return camera(segments=((0.5, 20.0, 700.0), (0.8, 120.0, None)))
    if kind == "poisson_shot_noise":
        return camera(segments=((2.0, 20.0, None),))
    return camera()


def having(base: Camera, effect: Effect) -> Camera:
    return base.model_copy(update={"effect": (*base.effect, effect)})


@pytest.mark.parametrize("kind", registry())
def test_every_effect_that_was_planted_gains(kind: str) -> None:
    """Base model with the true numbers, so that nothing but the effect is missing."""
    base = base_for(kind)
    true = having(base, registry()[kind](**PLANTED[kind]))
    gain = gain_of(held_of(recorded(true, 11)), true, base, signals(), seed=5)
    assert gain.ci95[0] > 0
    assert gain.ci95[0] < gain.nats_per_frame < gain.ci95[1]


def test_a_missing_segment_gains() -> None:
    base = camera()
    true = camera(segments=((0.5, 20.0, 700.0), (0.52, 40.0, None)))
    gain = gain_of(held_of(recorded(true, 11)), true, base, signals(), seed=5)
    assert gain.ci95[0] > 0


@cache
def null(seed: int) -> tuple[Held, Loglik]:
    """Return a recording of the base model alone, and its likelihood."""
    held = held_of(recorded(camera(), 1000 + seed))
    return held, loglik_of(held, camera(), signals(), seed=seed)


WEAK = {
    "row_noise": {"sigma_dn": 0.02},
    "dsnu": {"sigma_dn": 0.025},
    "crosstalk": {"fraction": 3e-4},
    "flicker": {"sigma_percent": 0.002},
    "rts": {"pixel_fraction": 2.5e-4, "amplitude_dn": 8.0},
    "adc_dnl": {"rms_lsb": 0.005},
}
"""A tenth of what stands at five standard deviations."""


@pytest.mark.parametrize("kind", WEAK)
def test_an_effect_that_is_not_there_gains_nothing(kind: str) -> None:
    """At 2.5 % false gains, 3 or more of 6 have the chance 3e-4."""
    weak = having(camera(), registry()[kind](**WEAK[kind]))
    gains = []
    for seed in range(6):
        held, before = null(seed)
        after = loglik_of(held, weak, signals(), seed=seed)
        gains.append(heldout_gain(before, after, seed=seed))
    assert sum(gain.ci95[0] > 0 for gain in gains) < 3
    assert np.mean([gain.nats_per_frame for gain in gains]) < 0.5


@pytest.mark.parametrize("kind", ["crosstalk", "dsnu", "prnu", "adc_dnl", "image_lag"])
def test_a_strong_effect_that_is_not_there_loses(kind: str) -> None:
    wrong = having(camera(), registry()[kind](**PLANTED[kind]))
    gain = gain_of(null(0)[0], wrong, camera(), signals(), seed=1)
    assert gain.ci95[1] < 0


def test_an_effect_is_not_credited_for_another() -> None:
    """Two fixed patterns: each gains beside the other, and the true one most."""
    dsnu = registry()["dsnu"](sigma_dn=0.8)
    prnu = registry()["prnu"](sigma_percent=0.3)
    held = held_of(recorded(camera(dsnu, prnu), 21))
    both = loglik_of(held, camera(dsnu, prnu), signals(), seed=1)
    for one in (dsnu, prnu):
        alone = loglik_of(held, camera(one), signals(), seed=1)
        assert heldout_gain(alone, both, seed=1).ci95[0] > 0


def test_levels_are_predicted_from_light() -> None:
    """A bend of the response is no gain where light is unknown: any level then is as good."""
    bend = registry()["nonlinearity"](percent_full_scale=0.25)
    found = [
        gain_of(
            held_of(recorded(camera(bend), 4, lit=lit)), camera(bend), camera(), signals(), seed=1
        )
        for lit in (True, False)
    ]
    assert found[0].ci95[0] > 0
    assert found[1].nats_per_frame < 0.5 * found[0].nats_per_frame


def test_exposures_that_are_locked_altogether() -> None:
    """Without training frames of their own, without a signal of their own: that of their light."""
    drift = registry()["prnu"](sigma_percent=0.5)
    recording = recorded(camera(drift), 8)
    names = [e.name for e in recording.exposures]
    locked = {n: tuple(range(FRAMES)) if n in ("dark-1", "flat-3") else LOCKED for n in names}
    training = {n: () if n in ("dark-1", "flat-3") else TRAINING for n in names}
    held = hold(recording, training, locked)
    known = {n: s for n, s in signals().items() if n not in ("dark-1", "flat-3")}
    before, after = (loglik_of(held, c, known, seed=1) for c in (camera(), camera(drift)))
    assert np.isfinite(np.concatenate(list(after.per_frame.values()))).all()
    whole = loglik_of(held, camera(drift), signals(), seed=1)
    assert after.frames["flat-3"] == pytest.approx(whole.frames["flat-3"], rel=1e-3)
    # The pattern is known from the other exposures.
    assert (after.frames["flat-3"] - before.frames["flat-3"]).min() > 0


def test_scenes_are_judged_about_their_training_mean() -> None:
    """A ramp: its variance follows the signal; the training mean's error costs 1 / 6 of it."""
    rows = camera(registry()["row_noise"](sigma_dn=2.0))
    ramp = np.broadcast_to(np.linspace(100, 1500, COLUMNS, dtype=np.float32), (ROWS, COLUMNS))
    recording = recorded(rows, 9, levels=(400.0, 900.0), scene=ramp)
    held = held_of(recording)
    known = signals((400.0, 900.0))
    before, after = (loglik_of(held, c, known, seed=1) for c in (camera(), rows))
    assert (after.frames["scene"] - before.frames["scene"]).min() > 0
    assert before.levels["scene"] == 0.0
    sd = np.sqrt(20 + 0.5 * ramp + 4) * np.sqrt(1 + 1 / 6)
    codes = recording.stacks["scene"]
    training = codes[list(TRAINING)].mean(0)
    closed = scipy.stats.norm.logpdf(codes[3], training, sd).sum()
    # Rows gain some 40 nats over this white law, the level's own a few; all is some 6e4.
    assert after.frames["scene"][0] == pytest.approx(closed, abs=200)
    assert after.frames["scene"][0] > closed


def test_a_picture_in_which_the_greens_differ_hides_no_imbalance() -> None:
    """Lines of light upon the rows of red: its greens differ by 40 %, those of flats by 0.4 %."""
    true = camera(registry()["channel_imbalance"](gain_percent=0.4), cfa="RGGB")
    lines = np.full((ROWS, COLUMNS), 300.0, np.float32)
    lines[::2] = 420.0
    gains = []
    for scene in (None, lines):
        held = held_of(recorded(true, 11, scene=scene))
        known = signals() | ({} if scene is None else {"scene": lines.astype(np.float64)})
        before, after = (loglik_of(held, c, known, seed=1) for c in (camera(cfa="RGGB"), true))
        gains.append(sum(after.levels[name] - before.levels[name] for name in signals()))
    assert gains[1] == pytest.approx(gains[0], rel=0.05)
    assert gains[1] > 20


def test_clipped_exposures_are_left_out() -> None:
    levels = (*LEVELS[:4], 4100.0)
    held = held_of(recorded(camera(), 2, levels=levels))
    assert held.left_out == ("flat-4",)


def test_a_large_sensor_is_seen_through_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """At its centre, from an even row and column on; gains are the window's."""
    true = camera(registry()["prnu"](sigma_percent=0.5), cfa="RGGB")
    recording = recorded(true, 2, rows=102, columns=140, levels=(400.0, 1600.0))
    monkeypatch.setattr(held_module, "MOST_SAMPLES", 4 * 12 * 50 * 70)
    held = held_of(recording)
    assert held.grid == PixelGrid(50, 68, Cfa.RGGB, 26, 36, 102, 140)
    first = held.exposures[2].codes[0]
    assert (first == recording.stacks["flat-0"][3][26:76, 36:104]).all()
    gain = gain_of(held, true, camera(cfa="RGGB"), signals((400.0, 1600.0)), seed=1)
    assert gain.ci95[0] > 0


def test_the_same_whatever_the_jobs() -> None:
    recording = recorded(camera(registry()["row_noise"](sigma_dn=0.5)), 13)
    names = [e.name for e in recording.exposures]
    numbers = dict.fromkeys(names, TRAINING), dict.fromkeys(names, LOCKED)
    after = camera(registry()["row_noise"](sigma_dn=0.5))
    one, two = (
        prove(recording, *numbers, camera(), after, signals(), seed=3, jobs=jobs) for jobs in (1, 2)
    )
    assert one.gain == two.gain
    assert one.auc == two.auc
    assert one.loglik_per_pixel.after - one.loglik_per_pixel.before == pytest.approx(
        one.gain.nats_per_frame / (ROWS * COLUMNS), rel=1e-6
    )


def test_a_classifier_sees_more_of_a_large_sensor_than_likelihoods_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recording, numbers = recorded(camera(), 11), {}
    for e in recording.exposures:
        numbers[e.name] = TRAINING
    locked = dict.fromkeys(numbers, LOCKED)
    held = hold(recording, numbers, locked)
    assert hold_seen(recording, numbers, locked, held) is held  # the whole sensor already
    monkeypatch.setattr("analysis.mismatch.prove.held.MOST_SAMPLES", 200_000)
    window = hold(recording, numbers, locked)
    seen = hold_seen(recording, numbers, locked, window)
    assert window.grid.rows < recording.rows
    assert (seen.grid.rows, seen.grid.columns) == (recording.rows, recording.columns)
    before, after = camera(), camera(registry()["row_noise"](sigma_dn=2.0))
    told = prove_held(window, before, after, signals(), seed=1, seen=seen)
    own = prove_held(window, before, after, signals(), seed=1)
    assert told.loglik_per_pixel == own.loglik_per_pixel
    assert told.auc_after is not None
    assert own.auc_after is None  # a single patch
