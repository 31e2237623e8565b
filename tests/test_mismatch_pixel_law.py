"""Promise: the law of single pixels is learned where it departs, and is normal elsewhere."""

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.prove import shape as law
from analysis.mismatch.prove.cells import cells_of
from analysis.mismatch.prove.shape import EDGES, NORMAL, Shape, Tally
from dsis.effects import registry
from mismatch_recordings import camera


def interval_of(residuals: np.ndarray) -> np.ndarray:
    """Return the interval of each residual; the last ones take all beyond."""
    found = np.searchsorted(EDGES, residuals.ravel(), side="right") - 1
    return np.asarray(np.clip(found, 0, EDGES.size - 2))


def tally_of(own: np.ndarray, base: np.ndarray) -> Tally:
    everything = np.ones((1, own.size), np.bool_)
    frames = (one.astype(np.float32).reshape(1, 1, -1) for one in (own, base))
    return Tally.of(*frames, everything, everything)


def learned_from(own: np.ndarray, base: np.ndarray) -> Shape:
    tally = tally_of(own, base)
    return law.shape_of(tally.ordinary, tally.base_ordinary, tally.exchanged)


def test_residuals_are_counted_in_their_intervals() -> None:
    draws = np.random.default_rng(3)
    own, base = (draws.standard_t(2, 20_000).astype(np.float32) for _ in range(2))
    own[:6] = (-250.0, -200.0, -4.0, 4.0, 199.9, 250.0)
    tally, one, other = tally_of(own, base), interval_of(own), interval_of(base)
    size = EDGES.size - 1
    assert np.array_equal(tally.ordinary, np.bincount(one, minlength=size))
    assert np.array_equal(tally.base_ordinary, np.bincount(other, minlength=size))
    left = [np.bincount(each[one != other], minlength=size) for each in (one, other)]
    assert np.array_equal(tally.exchanged, left[0] + left[1])
    assert tally.odd.sum() == tally.base_odd.sum() == 0


def gains(mass: np.ndarray) -> np.ndarray:
    """Return what a residual gains over the normal law, by interval."""
    least = 1e-12
    return np.log(np.maximum(mass, least) / np.maximum(NORMAL.mass, least))


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_changes_no_shape_costs_next_to_nothing(seed: int) -> None:
    """A normal law learned beside itself: 100 000 fresh residuals lose a few nats at most."""
    draws = np.random.default_rng(seed)
    base, fresh = draws.standard_normal(50_000), draws.standard_normal(100_000)
    own = 0.98 * base + np.sqrt(1 - 0.98**2) * draws.standard_normal(base.size)
    shape = learned_from(own, base)
    own_gains = gains(shape.mass)
    assert own_gains[interval_of(fresh)].sum() > -5.0
    assert own_gains.min() > -np.log(4)  # none were met there: no proof that there are none


@pytest.mark.parametrize("dof", [3, 8])
def test_heavy_tails_are_learned(dof: int) -> None:
    """Fresh residuals gain nearly what Student's own law gains them, by scipy.stats."""
    draws, student = np.random.default_rng(4), scipy.stats.t(dof)
    base = draws.standard_normal(50_000)
    scale = np.sqrt(dof / (dof - 2))
    own = student.ppf(scipy.stats.norm.cdf(base)) / scale
    fresh = student.rvs(100_000, random_state=draws) / scale
    shape = learned_from(own, base)
    gained = gains(shape.mass)[interval_of(fresh)].sum()
    mass = np.diff(student.cdf(EDGES * scale))
    possible = gains(mass)[interval_of(fresh)].sum()
    assert gained > 0.8 * possible


@pytest.mark.parametrize("kind", ["quantisation", "adc_dnl"])
def test_cells_cover_the_line(kind: str) -> None:
    """The chances of all codes add up to one, whatever the converter and the law."""
    parameters = {"quantisation": {"step_dn": 3.0}, "adc_dnl": {"rms_lsb": 0.4}}[kind]
    cells = cells_of(camera(registry()[kind](**parameters)), 1)
    draws = np.random.default_rng(2)
    heavy, normal = draws.standard_t(4, 20_000), draws.standard_normal(20_000)
    shape = learned_from(heavy, normal)
    for centre, sd in ((100.0, 5.0), (-60.0, 8.0), (4030.0, 20.0)):
        chance = shape.below((cells.upper_dn - centre) / sd) - shape.below(
            (cells.lower_dn - centre) / sd
        )
        assert chance.min() >= 0
        assert chance.sum() == pytest.approx(1, abs=1e-9)
    assert cells.plain == (kind == "quantisation")


@pytest.mark.parametrize(("step", "phase"), [(2, 1), (6, 5), (6, 0), (7, 3), (64, 63)])
def test_codes_from_a_phase_on_have_all_the_mass(step: int, phase: int) -> None:
    """Cells reach half a step to both sides, and at the ends as far as signals do."""
    model = camera(registry()["quantisation"](step_dn=float(step), phase_dn=phase), black=64.3)
    cells = cells_of(model, 1)
    codes = np.arange(phase, 4096, step)
    np.testing.assert_array_equal(cells.occurring, codes)
    lower, upper = cells.lower_dn[codes] + 64.3, cells.upper_dn[codes] + 64.3
    np.testing.assert_allclose(lower[1:], codes[1:] - step / 2, atol=1 / 16)
    np.testing.assert_allclose(upper[:-1], codes[:-1] + step / 2, atol=1 / 16)
    assert (np.diff(cells.lower_dn) >= 0).all()
    assert (np.diff(cells.upper_dn) >= 0).all()
    assert cells.step_dn == pytest.approx(step, abs=1 / 16)
    for level, sd in ((64.3, 0.5 * step), (phase + 0.2 * step, step), (1000.0, 0.4 * step)):
        edges = np.concatenate([[-np.inf], codes[:-1] + step / 2, [np.inf]])
        mean = float(np.diff(scipy.stats.norm.cdf(edges, level, sd)) @ codes)
        found = cells.centre(mean - 64.3, sd) + 64.3
        assert found == pytest.approx(level, abs=1 / 16 + 2e-3 * step)


def test_a_law_learned_from_normal_draws_is_normal() -> None:
    draws = np.random.default_rng(2).standard_normal(50_000)
    u = np.linspace(-7, 7, 200)
    learned = learned_from(draws, draws)
    # A straight table between steps of 1/64: the second derivative is at most 0.25.
    assert np.abs(learned.below(u) - NORMAL.below(u)).max() < 0.25 / 8 / 64**2 * 1.01


def test_a_few_impulses_are_learned() -> None:
    """Two residuals in 10 000 lie ten standard deviations off: each gains ten nats or more."""
    draws = np.random.default_rng(8)
    base, fresh = draws.standard_normal(50_000), draws.standard_normal(100_000)
    own, hit = base.copy(), draws.random(fresh.size) < 2e-4
    own[::5000] += 10.0
    fresh[hit] += 10.0
    gained = gains(learned_from(own, base).mass)[interval_of(fresh)]
    assert gained[hit].mean() > 10.0
    assert abs(gained[~hit].sum()) < 50.0


@given(st.floats(0.3, 6.0), st.floats(5.0, 30.0))
def test_centre_of_clipped_and_coarse_noise(sd: float, level: float) -> None:
    """From the mean code of a clipped, rounded normal law back to its centre: by scipy.stats."""
    cells = cells_of(camera(black=10.0), 1)
    codes = np.arange(4096)
    edges = np.concatenate([[-np.inf], codes[:-1] + 0.5, [np.inf]])
    mean = float((np.diff(scipy.stats.norm.cdf(edges, level, sd)) * codes).sum())
    found = cells.centre(mean - 10.0, sd) + 10.0
    # What is left where nothing is corrected: 4 sd from the end, or noise of 0.6 of a code.
    assert found == pytest.approx(level, abs=2e-3 * max(sd, 1.0))
