"""Whole frames that tell bands of rows from 1/f noise: expected powers, sizes, odds."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from scipy.linalg import toeplitz

from analysis.mismatch.named import Named
from analysis.mismatch.rank import LEAST_GAIN, TOLD_APART, Ranked
from analysis.mismatch.rowlaw import bands, beside, constant_of, fitted, pink, waves_of
from analysis.mismatch.rowodds import RowLaw
from analysis.mismatch.rowpower import SLOW, Powers, Size, powers_of, without_lines
from analysis.mismatch.rowtold import (
    AS_WELL,
    LIKELIER,
    as_likely,
    as_shown,
    beside_undecided,
    unlike_frames,
)
from analysis.mismatch.ties import ties
from exposing import effect

SURE = 5.0  # standard errors
ROWS, COLUMNS, FRAMES = 64, 96, 8
SIZE = Size(ROWS, COLUMNS)
ENDS = (-1e9, 1e9)
NOTHING: frozenset[str] = frozenset()
Rows = Callable[[np.random.Generator], np.ndarray]


def _cosines(count: int) -> np.ndarray:
    """Return orthonormal cosines of 1, 2, ... half cycles: (wave, sample)."""
    wave, at = np.arange(1, count)[:, np.newaxis], np.arange(count) + 0.5
    return np.sqrt(2 / count) * np.cos(np.pi * wave * at / count)


def _sines(count: int) -> np.ndarray:
    """Return orthonormal sines of 1, 2, ... half cycles, without their means."""
    wave, at = np.arange(1, count)[:, np.newaxis], np.arange(count) + 0.5
    made = np.sqrt(2 / count) * np.sin(np.pi * wave * at / count)
    return np.asarray(made - made.mean(1, keepdims=True))


def _pink_covariance(lags: np.ndarray, samples: int) -> np.ndarray:
    """Return the covariance of 1/f noise of unit variance, cosine by cosine.

    Of waves of two frames' length down to two samples: 1 ... n - 1 cycles in 2 n samples.
    """
    cycles = np.arange(1, samples)
    weights = (1 / cycles) / (1 / cycles).sum()
    angle = np.pi * np.multiply.outer(lags, cycles) / samples
    return np.asarray(np.cos(angle) @ weights)


@pytest.mark.parametrize("length", [0.8, 3.0, 15.0])
def test_powers_of_a_series_are_those_of_its_covariance_matrix(length: float) -> None:
    covariance = np.exp(-np.arange(40) / length)
    basis = _cosines(40)
    wanted = np.einsum("ki,ij,kj->k", basis, toeplitz(covariance), basis)
    np.testing.assert_allclose(waves_of(covariance), wanted, rtol=1e-9)
    assert constant_of(covariance) == pytest.approx(toeplitz(covariance).sum() / 40, rel=1e-12)


def test_powers_of_pink_noise_are_those_of_all_pairs_of_pixels() -> None:
    """The covariance of every pixel with every other, waves along rows and down the frame."""
    rows, columns = 16, 48
    size = Size(rows, columns)
    at = np.arange(rows * columns)
    covariance = _pink_covariance(at, rows * columns)[np.abs(at[:, np.newaxis] - at)]
    flat = np.full((1, columns), 1 / np.sqrt(columns))
    along = np.concatenate([flat, _cosines(columns)])
    down = [_cosines(rows), _sines(rows), _cosines(rows)]
    shaped = covariance.reshape(rows, columns, rows, columns)
    mixed = np.einsum("ix,axby,jy->iajb", along, shaped, along, optimize=True)
    own = pink(size)
    for i in range(SLOW):
        for j in range(SLOW):
            wanted = np.einsum("ka,ab,kb->k", down[i], mixed[i, :, j], down[j])
            wanted = np.add.reduceat(wanted, size.starts) / size.counts
            np.testing.assert_allclose(own.slow[:, i, j], wanted, rtol=1e-6, atol=1e-6)
    fine = np.einsum("iaia->i", mixed)[SLOW : size.waves + 1] / rows
    np.testing.assert_allclose(own.waves, fine, rtol=1e-6)
    assert own.whole == pytest.approx(covariance.sum() / (rows * columns), rel=1e-6)
    assert abs(own.slow[:, 0, 1]).max() > 0.2 * own.slow[:, 1, 1].max()  # slopes go with means


def _pink(rng: np.random.Generator) -> np.ndarray:
    """Return a frame of 1/f noise of unit variance in the order of read-out."""
    count = 2 * ROWS * COLUMNS
    size = np.zeros(count // 2 + 1)
    size[1:-1] = 1 / np.sqrt(np.arange(1, count // 2))
    size *= count / 2 / np.sqrt((size**2).sum())
    bins = size * (rng.normal(size=size.size) + 1j * rng.normal(size=size.size))
    return np.asarray(np.fft.irfft(bins, count)[: ROWS * COLUMNS].reshape(ROWS, COLUMNS))


def _bands(length: float) -> Rows:
    root = np.linalg.cholesky(toeplitz(np.exp(-np.arange(ROWS) / length)))

    def made(rng: np.random.Generator) -> np.ndarray:
        return np.repeat((root @ rng.normal(size=ROWS))[:, np.newaxis], COLUMNS, 1)

    return made


def _powers(cause: Rows, sigma: float, rng: np.random.Generator, **more: Any) -> list[Powers]:
    """Return the powers of two darks and a flat; `more`: what else there is."""
    found = []
    for noise, signal in ((1.0, 0.0), (1.0, 0.0), (6.0, 300.0)):
        stack = signal + noise * rng.normal(size=(FRAMES, ROWS, COLUMNS))
        stack += sigma * np.stack([cause(rng) for _ in range(FRAMES)])
        stack += more.get("columns", 0.0) * rng.normal(size=(FRAMES, 1, COLUMNS))
        stack += more.get("rows", 0.0) * rng.normal(size=(FRAMES, ROWS, 1))
        stack *= 1 + more.get("flicker", 0.0) * rng.normal(size=(FRAMES, 1, 1))
        stack += more.get("spike", 0.0) * (rng.random(stack.shape) < 1e-4)
        at = np.arange(COLUMNS) * 3 / COLUMNS + 11 * np.arange(ROWS)[:, np.newaxis] / ROWS
        phase = rng.random((FRAMES, 1, 1))
        stack += more.get("wave", 0.0) * np.cos(2 * np.pi * (at + phase))
        flickers = signal > 0
        own = powers_of(lambda stack=stack: iter(stack), 0.0, ENDS, flickers=flickers)  # type: ignore[misc]
        assert own is not None
        found.append(own)
    return found


def test_white_noise_has_its_variance_in_each_wave() -> None:
    rng = np.random.default_rng(2)
    made = [_powers(_bands(3.0), 0.0, rng) for _ in range(20)]
    darks = [one for own in made for one in own[:2]]
    worth = len(darks) * (FRAMES - 1)
    means = np.mean([own.slow / own.white[:, np.newaxis] for own in darks], 0)
    error = np.sqrt(2 / (worth * SIZE.counts))
    for i in range(SLOW):
        for j in range(SLOW):
            assert (np.abs(means[:, i, j] - (i == j)) < SURE * error).all()
    waves = np.mean([own.waves for own in darks], 0)
    assert np.abs(waves - 1).max() < SURE * np.sqrt(2 / (worth * (ROWS - 1)))
    assert np.mean([own.whole for own in darks]) == pytest.approx(1, abs=SURE * np.sqrt(2 / worth))


def test_clipped_frames_and_single_ones_tell_nothing() -> None:
    frames = np.zeros((4, ROWS, COLUMNS))
    assert powers_of(lambda: iter(frames), 0.0, (0.0, 100.0), flickers=False) is None
    assert powers_of(lambda: iter(frames[:1]), 0.0, ENDS, flickers=False) is None
    assert RowLaw(SIZE, []).odds("pink_noise", "row_banding", NOTHING) is None


def test_sizes_beside_row_noise_are_those_that_were_drawn() -> None:
    """Their means over recordings: neither takes the other's share."""
    rng = np.random.default_rng(4)
    causes = [bands(SIZE, 3.0), beside(SIZE)["row_noise"]]
    found, off = [], []
    for _ in range(30):
        one = fitted(_powers(_bands(3.0), 0.3, rng, rows=0.2), SIZE, causes)
        assert one is not None
        found.append(one.variances)
        off.append(one.off)
    error = np.std(found, axis=0, ddof=1) / np.sqrt(len(found))
    assert (np.abs(np.mean(found, 0) - [0.09, 0.04]) < 4 * error).all()
    # Misfits are standard normal, where nothing is amiss: of few products roughly.
    assert abs(np.mean(off)) < 4 / np.sqrt(len(off))
    assert 0.6 < np.std(off, ddof=1) < 1.4


@pytest.mark.parametrize("cause", [pytest.param(_pink, marks=pytest.mark.long), _bands(7.0)])
def test_noise_of_single_rows_is_told_with_its_size_whatever_it_is_beside(cause: Rows) -> None:
    """Odds of 20 for what is not there are wrong in one of 20 at most."""
    rng, wrong, sizes = np.random.default_rng(31), 0, []
    for _ in range(5):
        law = RowLaw(SIZE, _powers(cause, 0.1, rng, rows=0.2))
        assert law.beside_either("row_noise", NOTHING) > TOLD_APART
        sizes.append(law.size_besides("row_noise", NOTHING))
        alone = RowLaw(SIZE, _powers(cause, 0.2, rng))
        wrong += alone.beside_either("row_noise", NOTHING) > TOLD_APART
    assert wrong <= 1
    known = [own for own in sizes if own is not None]
    assert len(known) == len(sizes)
    error = np.std(known, ddof=1) / np.sqrt(len(known))
    assert abs(np.mean(known) - 0.2) < 4 * error


def test_of_frames_that_tell_nothing_no_row_has_noise_of_its_own() -> None:
    law = RowLaw(SIZE, [])
    assert law.beside_either("row_noise", NOTHING) == -np.inf
    assert law.size_besides("row_noise", NOTHING) is None


def test_of_rows_that_neither_makes_nothing_is_told() -> None:
    """Rows that tilt each by itself: neither bands nor 1/f noise do that, and keep no level."""

    def tilted(rng: np.random.Generator) -> Any:
        along = np.linspace(-1, 1, COLUMNS)
        return _bands(3.0)(rng) + 2 * rng.normal(size=(ROWS, 1)) * along

    law = RowLaw(SIZE, _powers(tilted, 0.5, np.random.default_rng(12)))
    assert law.odds("pink_noise", "row_banding", NOTHING) is None
    assert law.odds("row_banding", "pink_noise", NOTHING) is None
    assert law.beside_either("row_noise", NOTHING) == -np.inf


@pytest.mark.parametrize(
    "more",
    [{}, {"columns": 0.3}, {"rows": 0.2}, {"flicker": 0.01}, {"spike": 60.0}, {"wave": 0.3}],
    ids=lambda more: next(iter(more), "alone"),
)
def test_frames_tell_1_f_noise_from_bands(more: dict[str, float]) -> None:
    for cause, sigma, likelier in ((_pink, 0.5, 1), (_bands(7.0), 0.3, -1), (_bands(2.0), 0.3, -1)):
        law = RowLaw(SIZE, _powers(cause, sigma, np.random.default_rng(6), **more))
        odds = law.odds("pink_noise", "row_banding", NOTHING)
        assert odds is not None
        assert likelier * odds > TOLD_APART


@pytest.mark.long
@pytest.mark.parametrize(("cause", "sigma"), [(_pink, 0.06), (_bands(7.0), 0.04)])
def test_what_is_weak_is_told_wrongly_no_more_often_than_is_said(cause: Rows, sigma: float) -> None:
    """Odds of 9 are wrong in one of 9 at most; `benchmarks/mismatch_row_odds.py` asks hundreds."""
    rng, wrong, repeats = np.random.default_rng(8), 0, 12
    for _ in range(repeats):
        odds = RowLaw(SIZE, _powers(cause, sigma, rng)).odds("pink_noise", "row_banding", NOTHING)
        assert odds is not None
        wrong += (odds if cause is _pink else -odds) < -LIKELIER
    assert wrong <= 1


@pytest.mark.parametrize("kind", ["pink_noise", "row_banding"])
def test_a_line_beside_them_changes_nothing(kind: str) -> None:
    """Bands of a lamp's light, of a phase of their own in each frame, as large as they are."""

    def made(rng: np.random.Generator) -> Any:
        rows = np.arange(SIZE.rows)[:, np.newaxis] / SIZE.rows
        wave = 0.6 * np.cos(2 * np.pi * (8.49 * rows + rng.uniform()))
        return wave + (_pink(rng) if kind == "pink_noise" else _bands(7.0)(rng))

    rng = np.random.default_rng(21)
    powers = without_lines(_powers(made, 0.5, rng), SIZE)
    odds = RowLaw(SIZE, powers).odds(kind, *({"pink_noise", "row_banding"} - {kind}), NOTHING)
    assert odds is not None
    assert odds > 3


def test_no_line_is_cut_out_of_what_is_smooth() -> None:
    rng = np.random.default_rng(22)
    for cause, sigma in ((_pink, 0.4), (_bands(7.0), 0.4), (_bands(1.0), 0.0)):
        powers = _powers(cause, sigma, rng)
        for before, after in zip(powers, without_lines(powers, SIZE), strict=True):
            np.testing.assert_array_equal(before.slow, after.slow)


def _ranked(kind: str, gain: float, *mean: float) -> Ranked:
    effect = Stub(kind=kind)
    proposal: Any = Stub(effect=effect)
    polished: Any = Stub(mean=np.array(mean), effects=(effect,))
    return Ranked(gain, kind, proposal, polished)


def _state(*there: str, noisy_rows: float = -np.inf) -> Any:
    null = Stub(mean=np.zeros(2), sd=np.ones(2), known=np.ones(2, bool))
    setting = Stub(noisy_rows=lambda: noisy_rows)
    return Stub(null=null, setting=setting, camera=Stub(effect=[Stub(kind=k) for k in there]))


def _frames(odds: float) -> Any:
    """Return whole frames that prefer 1/f noise by so much."""

    def of(kind: str, _other: str, _known: frozenset[str]) -> float:
        return odds if kind == "pink_noise" else -odds

    return Stub(rows=Stub(odds=of))


BOTH = [_ranked("row_banding", 40.0, 1.0, 0.1), _ranked("pink_noise", 30.0, 1.0, 0.0)]
OTHERS = [_ranked("row_noise", 35.0, 1.0, 1.0)]


def test_the_likelier_of_both_comes_first_and_of_two_as_likely_neither() -> None:
    def order(odds: float, *there: str) -> list[tuple[str, float]]:
        shown = as_shown(_state(*there), _frames(odds), [BOTH[0], *OTHERS, BOTH[1]])
        return [(one.kind, one.gain) for one in shown]

    kept = [("row_banding", 40.0), ("row_noise", 35.0), ("pink_noise", 30.0)]
    assert order(-20.0) == [*kept[:2], ("pink_noise", 20.0)]
    assert order(-5.0) == kept
    assert order(6.0) == [("pink_noise", 40.0), ("row_noise", 35.0), ("row_banding", 34.0)]
    assert order(90.0)[-1] == ("row_banding", LEAST_GAIN)
    told = [("pink_noise", 40.0), ("row_banding", 37.6), ("row_noise", 35.0)]
    assert order(2.4) == [(kind, pytest.approx(gain)) for kind, gain in told]
    for odds in (1.0, 0.95 * LIKELIER):
        assert order(odds) == [("row_banding", 40.0), ("pink_noise", 40.0), ("row_noise", 35.0)]
    assert order(90.0, "pink_noise") == kept  # beside it nothing is asked
    nobody = as_shown(_state(), None, BOTH)
    assert [one.kind for one in nobody] == ["row_banding", "pink_noise"]


@pytest.mark.parametrize("by_numbers", [30.0, 39.9, 40.0])
def test_what_frames_tell_does_not_tie_whatever_numbers_say(by_numbers: float) -> None:
    """At odds of 9, which are less than what tells other effects apart."""
    both = [BOTH[0], replace(BOTH[1], gain=by_numbers)]
    for odds in (1.05 * LIKELIER, -1.05 * LIKELIER):
        best, other = as_shown(_state(), _frames(odds), both)
        assert not ties(_state(), best, other)
        assert best.gain - other.gain >= abs(odds)
        assert other.told_from == ""
    best, other = as_shown(_state(), _frames(0.9 * LIKELIER), both)
    assert best.told_from == other.told_from == ""
    assert best.gain == other.gain


def test_what_another_is_as_likely_as_that_was_not_fitted_is_denied() -> None:
    state, (best, other) = _state(), BOTH
    denial = unlike_frames(state, _frames(0.0), best, OTHERS)
    assert denial is not None
    assert denial.share == pytest.approx(0.5)
    assert "1/f noise" in denial.why
    assert unlike_frames(state, _frames(0.0), best, [*OTHERS, other]) is None
    assert unlike_frames(state, _frames(-4.0), best, OTHERS) is None
    assert unlike_frames(state, _frames(-1.05 * LIKELIER), best, OTHERS) is None
    assert unlike_frames(state, _frames(-0.95 * LIKELIER), best, OTHERS) is not None
    assert unlike_frames(_state("pink_noise"), _frames(9.0), best, OTHERS) is None
    assert unlike_frames(state, _frames(9.0), OTHERS[0], []) is None


def test_noise_of_single_rows_comes_first_where_frames_show_it_with_either() -> None:
    best, other = BOTH

    def denied(odds: float, left: set[str], *there: str) -> bool:
        state = _state(*there, noisy_rows=4.0)
        return unlike_frames(state, _frames(odds), best, [*OTHERS, other], left) is not None

    assert denied(0.0, {"row_noise"})
    assert not denied(0.0, set())  # no word for it, or it was denied
    assert not denied(0.0, {"row_noise"}, "row_noise")  # the user's own
    assert not denied(-4.0, {"row_noise"})  # what it is beside is told
    sure = unlike_frames(_state(noisy_rows=2.0), _frames(0.0), best, [other], {"row_noise"})
    assert sure is None


def test_a_size_beside_what_is_undecided_may_hold_a_part_of_it() -> None:
    proposal: Any = Stub(effect=effect("row_noise", sigma_dn=5.0))
    named = Named("row_noise", proposal, {"sigma_dn": 0.3}, 40.0, ())
    wide = beside_undecided(named, [tuple(BOTH)], lambda: 4.6)
    assert wide.errors == {"sigma_dn": pytest.approx(0.5)}
    assert beside_undecided(named, [tuple(BOTH)], lambda: None) is named
    assert beside_undecided(named, [(BOTH[0], OTHERS[0])], lambda: 4.6) is named
    assert beside_undecided(named, [], lambda: 4.6) is named


@pytest.mark.parametrize("kind", ["pink_noise", "row_banding"])
def test_what_frames_show_as_well_is_undecided(kind: str) -> None:
    """Whichever of both was fitted, as long as rows are left that call for one."""
    other = {"pink_noise": "row_banding", "row_banding": "pink_noise"}[kind]
    refused = {kind: f"{AS_WELL} the other", "prnu": "it explains nothing that differs for certain"}
    assert as_likely(refused, {"row_correlation"}) == {kind: other, other: kind}
    assert as_likely(refused, {"fixed_pixel_variance"}) == {}
    assert as_likely({kind: "it is something else"}, {"row_correlation"}) == {}
    assert as_likely({}, {"row_correlation"}) == {}
