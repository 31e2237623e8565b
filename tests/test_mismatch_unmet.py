"""An effect is not named where what calls for it stays, or was never seen."""

from math import exp

import numpy as np
import pytest

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.judge import Judge
from analysis.mismatch.named import Named
from analysis.mismatch.otherlags import alike
from analysis.mismatch.state import State
from analysis.mismatch.unmet import mirrored, unmet
from dsis.effects import Effect, registry
from mismatch_recordings import camera, recorded, state_of

SHARE = 0.06  # of the noise before, that noise has
LEVELS = (250.0, 900.0, 1600.0)
MEMORY = registry()["readout_memory"](fraction=SHARE, lag_pixels=1, along="rows")


def _of(
    effect: Effect, *, rows: float = 0.0, columns: float = 0.0, steps: float = 0.0
) -> Denial | None:
    """Return what is said of an effect beside noise made here, DN, with shares of the noise before.

    Along `rows` and `columns`; levels move by `steps`, up and down by turns.
    """
    state = _state(effect, rows=rows, columns=columns, steps=steps)
    without = state.camera.model_copy(update={"effect": ()})
    return unmet(state, effect, state.predictor(8).mean(without))


def _state(effect: Effect, *, rows: float = 0.0, columns: float = 0.0, steps: float = 0.0) -> State:
    recording = recorded(camera(), 5, rows=96, columns=128, levels=LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(9)
    for i, (name, frames) in enumerate(recording.stacks.items()):
        level = frames.mean() + steps * (-1) ** i
        white = rng.normal(0, (0.5 * (level - 64) + 20) ** 0.5, frames.shape)
        noise = white + rows * np.roll(white, 1, 2) + columns * np.roll(white, 1, 1)
        recording.stacks[name] = np.rint(level + noise).astype(np.uint16)
    return state_of(recording, camera(effect))


def test_memory_along_rows_explains_no_correlation_along_columns() -> None:
    said = _of(MEMORY, rows=SHARE, columns=SHARE)
    assert said is not None
    assert "leaves correlation with the next pixel of the column" in said.why


@pytest.mark.parametrize(
    ("columns", "denied"), [(SHARE, True), (0.2 * SHARE, False), (0.0, False), (-SHARE, False)]
)
def test_memory_along_rows_is_denied_by_as_much_along_columns(columns: float, denied: bool) -> None:
    """What is alike in both directions has one cause; of the other sign it has another."""
    state = _state(MEMORY, rows=SHARE, columns=columns)
    without = state.camera.model_copy(update={"effect": ()})
    said = mirrored(state, MEMORY, state.predictor(8).mean(without))
    assert (said is not None) == denied
    assert said is None or "the next pixel of the column" in said.why


@pytest.mark.parametrize(("columns", "denied"), [(SHARE, True), (0.0, False)])
def test_a_residue_is_denied_by_neighbours_that_are_as_much_alike_along_columns(
    columns: float, denied: bool
) -> None:
    """Along rows a residue, whose codes a level hides; along columns what noise has in common."""
    residue = registry()["adc_memory"](step_dn=-4.0, period_codes=64, at_code=0.0)
    state = _state(residue, rows=SHARE, columns=columns)
    without = state.camera.model_copy(update={"effect": ()})
    said = mirrored(state, residue, state.predictor(8).mean(without))
    assert (said is not None) == denied
    assert said is None or "the next pixel of the column" in said.why


@pytest.mark.parametrize(
    ("together", "denied"), [(0.0, False), (0.15, False), (0.8, True), (1.5, True)]
)
def test_memory_of_one_lag_is_denied_where_a_line_has_as_much_in_common(
    together: float, denied: bool
) -> None:
    """An offset that a row has anew in each frame makes its samples alike at all distances."""
    lag = 7
    memory = registry()["readout_memory"](fraction=SHARE, lag_pixels=lag, along="rows")
    recording = recorded(camera(), 5, levels=LEVELS)
    assert recording.stacks is not None
    rng = np.random.default_rng(9)
    for name, frames in recording.stacks.items():
        level = frames.mean()
        white = rng.normal(0, (0.5 * (level - 64) + 20) ** 0.5, frames.shape)
        rows = rng.normal(0, (together * SHARE) ** 0.5 * white.std(), (*frames.shape[:2], 1))
        noise = white + rows + SHARE * np.roll(white, lag, 2)
        recording.stacks[name] = np.rint(level + noise).astype(np.uint16)
    state = state_of(recording, camera(memory))
    without = state.camera.model_copy(update={"effect": ()})
    said = alike(state, memory, state.predictor(8).mean(without))
    assert (said is not None) == denied
    assert said is None or "at other distances" in said.why


def test_what_has_no_lag_is_not_asked_of_lags() -> None:
    effect = registry()["row_noise"](sigma_dn=1.0)
    state = _state(effect)
    without = state.camera.model_copy(update={"effect": ()})
    assert alike(state, effect, state.predictor(8).mean(without)) is None


@pytest.mark.parametrize("columns", [0.0, 0.2 * SHARE])
def test_an_effect_that_explains_most_of_what_calls_for_it_is_not_denied(columns: float) -> None:
    assert _of(MEMORY, rows=SHARE, columns=columns) is None


def test_memory_of_two_samples_leaves_what_next_ones_share_to_others() -> None:
    """A filter beside it makes next samples alike, along rows and columns: not its lag."""
    memory = registry()["readout_memory"](fraction=0.05, lag_pixels=2, along="rows")
    assert _beside(memory, registry()["spatial_filtering"](fraction=0.0125)) is None


@pytest.mark.parametrize("there", [False, True])
def test_what_only_levels_hint_at_must_be_seen_by_what_it_carries_over(there: bool) -> None:
    """A converter's residue, or levels that something else moves by as much."""
    residue = registry()["adc_memory"](step_dn=1.0, period_codes=64, at_code=20.0)
    if not there:
        assert _of(residue, steps=0.5) is not None
        return
    state = state_of(recorded(camera(residue), 5, levels=LEVELS), camera(residue))
    without = state.camera.model_copy(update={"effect": ()})
    assert unmet(state, residue, state.predictor(8).mean(without)) is None


def _judged(effect: Effect, state: State, first: str) -> tuple[Named, str] | None:
    named = Named(effect.kind, Proposal(effect, ("fraction",)), {}, 9.0, ())
    without = state.camera.model_copy(update={"effect": ()})
    return Judge(state, lambda _: without, 8).denied_by_rest([named], frozenset({first}))


def test_what_neither_differed_at_first_nor_is_seen_now_names_nothing() -> None:
    """Too little to be seen: but for what called for it at first, beside what else was there."""
    little = registry()["readout_memory"](fraction=0.001, lag_pixels=1, along="rows")
    state = _state(little)
    assert _judged(little, state, "level") is not None
    assert _judged(little, state, "correlation_0_1") is None


def test_what_shows_for_certain_was_called_for_whatever_differed_at_first() -> None:
    assert _judged(MEMORY, _state(MEMORY, rows=SHARE), "level") is None


def _beside(effect: Effect, other: Effect) -> Denial | None:
    """Return what is said of an effect that is there, beside another that has no name."""
    state = state_of(recorded(camera(effect, other), 5, levels=LEVELS), camera(effect))
    assert state.mismatches
    without = state.camera.model_copy(update={"effect": ()})
    return unmet(state, effect, state.predictor(8).mean(without))


def test_what_adds_little_to_what_another_makes_is_not_denied() -> None:
    """An offset of each pixel is all that darks show, and little of what gains do in flats."""
    dsnu, prnu = registry()["dsnu"](sigma_dn=0.6), registry()["prnu"](sigma_percent=0.5)
    assert _beside(dsnu, prnu) is None


def test_levels_are_not_what_flicker_explains() -> None:
    """It scatters them; that they are bent besides is another's."""
    flicker = registry()["flicker"](sigma_percent=0.3)
    assert _beside(flicker, registry()["nonlinearity"](percent_full_scale=2.0)) is None


def test_tails_that_single_pixels_have_not_are_no_heavy_tails() -> None:
    """Pixels that are noisy by exp(s z) have a kurtosis of 3 exp(4 s^2) over all, each one 3."""
    size = 0.3
    excess = 3 * (exp(4 * size**2) - 1)
    spread = registry()["read_noise_spread"](log_sigma=size)
    tails = registry()["heavy_tailed_read_noise"](tail_df=4 + 6 / excess)
    state = state_of(recorded(camera(spread), 5, levels=LEVELS), camera(tails))
    without = state.camera.model_copy(update={"effect": ()})
    assert unmet(state, tails, state.predictor(8).mean(without)) is not None
