"""Filters over frames and codecs have no word: what they leave is no bend, lag or tails."""

from types import SimpleNamespace as Stub
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.bank.key import Key
from analysis.mismatch.covariances import of_frames
from analysis.mismatch.feignedtails import mixed
from analysis.mismatch.framelag import alike_without_light
from analysis.mismatch.segments import as_settled
from dsis.effects import registry
from exposing import effect
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded, state_of

Array = NDArray[np.float64]
PLACES = {"dark-0": "dark", "dark-1": "dark", "flat-0": "flat", "flat-1": "flat"}


def _gated(kept: float, width_dn: float, seed: int = 5) -> InMemory:
    """Return a recording whose camera averages frames the more, the less they move."""
    made = recorded(camera(), seed, levels=(100.0, *FEW_LEVELS))
    rng = np.random.default_rng(seed)
    stacks = {}
    for e in made.exposures:
        signal = e.light or 0.0
        shape = (len(e.frames) + 6, made.rows, made.columns)
        frames = signal + np.sqrt(0.5 * signal + 20.0) * rng.standard_normal(shape)
        for k in range(1, len(frames)):
            moved = frames[k] - frames[k - 1]
            frames[k] -= kept * np.exp(-((moved / width_dn) ** 2)) * moved
        stacks[e.name] = np.clip(np.rint(64 + frames[6:]), 0, 4095).astype(np.uint16)
    return InMemory(made.sensor, made.exposures, made.rows, made.columns, made.folder, stacks)


def test_what_frames_share_is_what_variances_lack() -> None:
    """Little light moves little: there the filter takes most, and variances bend."""
    state = state_of(_gated(0.1, 60.0), camera())
    assert {"frame_correlation", "pixel_variance"} <= {m.statistic for m in state.mismatches}
    denial = of_frames(state)
    assert denial is not None
    assert "as covariance what variances lack" in denial.why


def test_a_second_gain_is_believed_where_frames_are_not_alike() -> None:
    path = camera(segments=((0.5, 20.0, 700.0), (0.7, 20.0, None)))
    state = state_of(recorded(path, 5, levels=(100.0, *FEW_LEVELS)), camera())
    assert of_frames(state) is None


def test_a_second_gain_is_believed_beside_lag_of_charge() -> None:
    """Frames are alike, and no more than a part of the bend: the rest is the gain's."""
    lag = registry()["image_lag"](fraction=0.03)
    path = camera(lag, segments=((0.5, 20.0, 700.0), (0.9, 20.0, None)))
    state = state_of(recorded(path, 5, levels=(100.0, *FEW_LEVELS)), camera())
    assert "frame_correlation" in {m.statistic for m in state.mismatches}
    assert of_frames(state) is None


def _state(
    values: dict[str, tuple[float, ...]], off: set[str], *effects: Any, sd: float = 0.003
) -> Any:
    """Return a state of four exposures that departs by `values` of each statistic."""
    keys = [Key(name, "exposure", place, "MONO", "") for name in values for place in PLACES]
    return Stub(
        setting=Stub(
            layout=Stub(exposures=[Stub(name=name, kind=kind) for name, kind in PLACES.items()])
        ),
        camera=Stub(effect=effects),
        vector=Stub(keys=keys, values=np.concatenate([np.array(own) for own in values.values()])),
        null=Stub(
            keys=keys,
            mean=np.zeros(len(keys)),
            sd=np.full(len(keys), sd),
            known=np.ones(len(keys), bool),
        ),
        mismatches=[Stub(statistic=name) for name in off],
    )


LAG = effect("image_lag", fraction=0.05)


@pytest.mark.parametrize(
    ("dark", "off", "there", "denied"),
    [
        (0.012, {"frame_correlation"}, True, True),  # a filter that rounds is weak in the dark
        (0.012, {"frame_correlation"}, False, False),  # nothing is fitted yet
        (0.012, set(), True, False),  # not for certain
        (0.006, {"frame_correlation"}, True, False),  # little
        (0.012, {"frame_correlation", "jumping_pixels"}, True, False),  # of few pixels
        (0.030, {"frame_correlation"}, False, True),  # half as much as with light
        (-0.030, {"frame_correlation"}, True, False),
    ],
)
def test_darks_that_stay_alike_beside_a_lag_deny_it(
    dark: float, off: set[str], there: bool, denied: bool
) -> None:
    """Lit frames are as alike as the lag makes them, 0.05; darks should not be."""
    effects = (LAG,) if there else ()
    state = _state({"frame_correlation": (dark, dark, 0.05, 0.05)}, off, *effects, sd=0.002)
    if there:
        state.null.mean[2:] = 0.05
    denial = alike_without_light(state, "image_lag", np.zeros(4))
    assert (denial is not None) is denied
    assert alike_without_light(state, "rts", np.zeros(4)) is None


def test_lit_frames_that_are_unlike_by_chance_deny_no_lag() -> None:
    state = _state({"frame_correlation": (0.0, 0.0, -0.05, -0.05)}, set(), LAG)
    assert alike_without_light(state, "image_lag", np.zeros(4)) is None


@pytest.mark.parametrize(
    ("kind", "along_rows", "along_columns", "denied"),
    [
        ("heavy_tailed_read_noise", 0.3, 0.2, True),
        ("heavy_tailed_read_noise", -0.3, 0.2, True),
        ("read_noise_spread", 0.3, 0.2, True),
        ("heavy_tailed_read_noise", 0.3, 0.01, False),  # memory goes along one axis
        ("heavy_tailed_read_noise", 0.05, 0.05, True),
        ("adc_dnl", 0.05, 0.05, True),
        ("rts", 0.3, 0.2, False),
    ],
)
def test_samples_that_share_their_noise_have_no_law_of_their_own(
    kind: str, along_rows: float, along_columns: float, denied: bool
) -> None:
    lit = 0.01  # in light other noise hides it
    values = {
        "correlation_0_1": (along_rows, along_rows, lit, lit),
        "correlation_1_0": (along_columns, along_columns, lit, lit),
    }
    assert (mixed(_state(values, set(values)), kind) is not None) is denied
    assert mixed(_state(values, {"correlation_0_1"}), kind) is None  # the other is explained
    without = _state(values, set(values))
    for exposure in without.setting.layout.exposures:
        exposure.kind = "flat"
    assert mixed(without, kind) is None


def test_a_switch_is_where_the_final_model_has_it() -> None:
    signals = {("a", "B"): 2400.0, ("a", "Gr"): 3500.0, ("b", "B"): 1000.0}
    moved: Any = Stub(switches=(2900.0,), fit=Stub(signal_dn=signals))
    switch, error = as_settled(moved, 2100.0, 180.0)
    assert switch == 2900.0
    drawn = np.random.default_rng(1).uniform(2400, 3500, 200_000)
    assert error == pytest.approx(np.sqrt(((drawn - 2900) ** 2).mean()), rel=0.01)
    same: Any = Stub(switches=(2100.0,), fit=Stub(signal_dn=signals))
    assert as_settled(same, 2100.0, 380.0) == (2100.0, 380.0)
    assert as_settled(moved, 2850.0, 900.0) == (2900.0, 900.0)  # other gaps were as likely
    none: Any = Stub(switches=(), fit=Stub(signal_dn=signals))
    assert as_settled(none, 2100.0, 380.0) == (2100.0, 380.0)


@pytest.mark.parametrize("kind", ["adc_dnl", "heavy_tailed_read_noise", "read_noise_spread"])
@pytest.mark.parametrize(("dark", "denied"), [(0.15, True), (0.01, False)])
def test_frames_that_share_noise_in_the_dark_have_no_law_of_single_samples(
    kind: str, dark: float, denied: bool
) -> None:
    values = {"frame_correlation": (dark, dark, 0.01, 0.01)}
    assert (mixed(_state(values, {"frame_correlation"}), kind) is not None) is denied
    assert mixed(_state(values, set()), kind) is None  # something explains it
