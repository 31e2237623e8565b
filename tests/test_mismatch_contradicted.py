"""An effect is not named where the statistic that calls for it denies it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from analysis.mismatch.bank.key import Key
from analysis.mismatch.contradicted import Denial, _of_codes, contradicted, refuted
from analysis.mismatch.polish import Polished
from analysis.mismatch.predict import Predictor
from analysis.mismatch.state import State
from dsis.camera import Camera
from dsis.effects import Effect, registry
from mismatch_recordings import Array, camera, recorded, state_of

GAIN_PERCENT = 1.0
LEVELS = (250.0, 900.0, 1600.0)
ROWS, COLUMNS = 64, 96
TAPS = registry()["tap_mismatch"](gain_percent=GAIN_PERCENT, regions="top_bottom")


def with_taps(gains: Array, model: Camera = camera(TAPS)) -> State:  # noqa: B008 # frozen
    """Return the state of a camera of two taps beside a sensor whose rows have gains: (row,)."""
    recording = recorded(camera(), 5, rows=ROWS, columns=COLUMNS, levels=LEVELS)
    assert recording.stacks is not None
    for i, level in enumerate(LEVELS):
        added = np.rint(level * (gains - 1))[:, np.newaxis]
        recording.stacks[f"flat-{i}"] = (recording.stacks[f"flat-{i}"] + added).astype(np.uint16)
    return state_of(recording, model)


def as_fitted(state: State, predictor: Predictor, effect: Effect) -> Polished:
    """Return an effect as if it had been fitted with these parameters."""
    mean = predictor.mean(state.camera.model_copy(update={"effect": (effect,)}))
    return Polished((effect,), predictor.loglik(mean), mean, ({},))


def fixed(gains: Array) -> Denial | None:
    """Return what is said of tap mismatch in a sensor whose rows have gains: (row,)."""
    state = with_taps(gains)
    without = state.camera.model_copy(update={"effect": ()})
    return contradicted(state, state.predictor(), "tap_mismatch", without)


@pytest.mark.parametrize("share", [1.0, 0.8])
def test_halves_of_two_amplifiers_are_believed(share: float) -> None:
    step = np.where(np.arange(ROWS) < ROWS / 2, -0.5, 0.5)
    assert fixed(1 + share * GAIN_PERCENT / 100 * step) is None


@pytest.mark.parametrize(("jump", "denied"), [(True, False), (False, True)])
def test_an_effect_is_denied_before_it_is_taken_in_too(jump: bool, denied: bool) -> None:
    """A tilt of the light beside a camera without taps shows no step where halves meet."""
    lines = np.arange(ROWS)
    shape = np.where(lines < ROWS / 2, -0.5, 0.5) if jump else np.linspace(-1, 1, ROWS)
    state = with_taps(1 + GAIN_PERCENT / 100 * shape, camera())
    predictor = state.predictor()
    fitted = as_fitted(state, predictor, TAPS)
    said = refuted(state, predictor, "tap_mismatch", fitted)
    assert (said is not None) == denied


@pytest.mark.parametrize("spikes", [("flat-1",), ("dark-1", "flat-0")])
def test_a_few_spikes_are_believed_though_most_exposures_have_none(spikes: tuple[str, ...]) -> None:
    """Counts of rare hits are Poisson's: of 1 expected in 5 exposures, most hold none."""
    recording = recorded(camera(), 5, rows=ROWS, columns=COLUMNS, levels=LEVELS)
    assert recording.stacks is not None
    for name in spikes:
        recording.stacks[name][4, 30, 40] += 1500
    state = state_of(recording, camera())
    rate = len(spikes) / (5 * 8 * ROWS * COLUMNS / 1e6)
    hits = registry()["impulse"](per_megapixel_frame=rate, mean_dn=1500.0)
    predictor = state.predictor(8)
    assert refuted(state, predictor, "impulse", as_fitted(state, predictor, hits)) is None


def test_many_spikes_are_denied_where_none_are_seen() -> None:
    """Of 100 expected in every exposure none is no chance."""
    state = state_of(recorded(camera(), 5, rows=ROWS, columns=COLUMNS, levels=LEVELS), camera())
    hits = registry()["impulse"](per_megapixel_frame=2000.0, mean_dn=1500.0)
    predictor = state.predictor(8)
    assert refuted(state, predictor, "impulse", as_fitted(state, predictor, hits)) is not None


@pytest.mark.parametrize("direction", [1, -1])
def test_a_tilt_is_no_step_between_halves(direction: int) -> None:
    """The means of the halves differ as those of two amplifiers would; nothing jumps."""
    tilt = direction * np.linspace(-1, 1, ROWS)
    said = fixed(1 + GAIN_PERCENT / 100 * tilt)
    assert said is not None
    assert said.share < 0.5
    # The wrong way round all else denies it too.
    assert direction < 0 or "step between two halves" in said.why


@pytest.mark.parametrize(("share", "needed"), [(1.0, True), (0.85, True), (0.0, False)])
def test_what_is_clearly_there_is_needed_though_not_quite_as_fitted(
    share: float, needed: bool
) -> None:
    """The error of its form is the effect's: what lies far from none is worth more than none."""
    step = np.where(np.arange(ROWS) < ROWS / 2, -0.5, 0.5)
    state = with_taps(1 + share * GAIN_PERCENT / 100 * step)
    predictor = state.predictor()
    without = predictor.mean(state.camera.model_copy(update={"effect": ()}))
    assert (predictor.worth(without) > 10) == needed
    assert needed or predictor.worth(without) < 0


@pytest.mark.parametrize(("in_darks", "denied"), [(1.0, False), (0.0, True)])
def test_flats_do_not_outvote_darks(in_darks: float, denied: bool) -> None:
    """An amplifier glows in the dark too: a tilt of the light alone, however clear, is no glow."""
    places = [("flat", 20.0), ("flat", 25.0), ("dark", 8.0), ("dark", 9.0)]
    keys = tuple(
        Key("fixed_smooth_tilt", "exposure", f"{kind}-{i}", "MONO", "rows")
        for i, (kind, _) in enumerate(places)
    )
    change = np.array([z for _, z in places])
    shown = np.array([z * (1 if kind == "flat" else in_darks) for kind, z in places])
    exposures = [SimpleNamespace(name=k.exposure, kind=k.exposure[:4]) for k in keys]
    null = SimpleNamespace(
        mean=change, sd=np.ones(4), known=np.ones(4, bool), departures=lambda _: shown - change
    )
    state: Any = SimpleNamespace(
        null=null,
        vector=SimpleNamespace(keys=keys, values=shown),
        setting=SimpleNamespace(layout=SimpleNamespace(exposures=exposures)),
    )
    predictor: Any = SimpleNamespace(mean=lambda _: np.zeros(4), forms=np.full(4, 0.08))
    found = contradicted(state, predictor, "amp_glow", camera())
    assert (found is not None) is denied


@pytest.mark.parametrize(
    ("gap_dn", "moved_dn", "noise_dn", "denied"),
    [
        (8.0, 3.0, 5.0, True),
        (8.0, 30.0, 5.0, False),
        (8.0, 3.0, 20.0, False),
        (1.0, 3.0, 0.9, False),
    ],
)
def test_codes_that_are_far_apart_move_levels(
    gap_dn: float, moved_dn: float, noise_dn: float, denied: bool
) -> None:
    """By up to half their distance, where noise is no wider and none of it is explained."""
    names = [f"flat-{i}" for i in range(4)]
    keys = tuple(
        Key(statistic, "exposure", name, "MONO")
        for name in names
        for statistic in ("level", "code_spacing")
    )
    of_levels = np.array([key.statistic == "level" for key in keys])
    places = [(name, "MONO") for name in names]
    state: Any = SimpleNamespace(
        mismatches=[SimpleNamespace(statistic="code_spacing")],
        vector=SimpleNamespace(keys=keys, values=np.zeros(8)),
        null=SimpleNamespace(mean=np.zeros(8), sd=np.full(8, 0.1), known=np.ones(8, bool)),
        setting=SimpleNamespace(
            seen=SimpleNamespace(
                levels=dict.fromkeys(places, SimpleNamespace(variance_dn2=noise_dn**2)),
                gaps_dn=dict.fromkeys(places, gap_dn),
            )
        ),
    )
    found = _of_codes(state, "nonlinearity", np.where(of_levels, moved_dn, 0.0))
    assert (found is not None) is denied


@pytest.mark.parametrize(("left", "denied"), [("code_spacing", True), ("code_imbalance", False)])
def test_codes_in_steps_are_no_widths_that_scatter(left: str, denied: bool) -> None:
    """As a camera that stores the square root of its codes leaves them."""
    state: Any = SimpleNamespace(mismatches=[SimpleNamespace(statistic=left)])
    assert (_of_codes(state, "adc_dnl", np.zeros(0)) is not None) is denied
