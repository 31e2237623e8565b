"""A full well that is reached softly: where it starts from, and what a camera makes of it."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import skew

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.candidates import CANDIDATES, Proposal
from analysis.mismatch.candidates.response import moments_of_many, soft_moments
from analysis.mismatch.memory import Memory
from analysis.mismatch.state import State
from dsis.effects import registry
from dsis.effects.dual_gain_mismatch import DualGainMismatch
from dsis.effects.saturation import Saturation
from mismatch_recordings import InMemory, camera, recorded, responding, state_of

pytestmark = pytest.mark.usefixtures("unproven")

LEVELS = (500.0, 1500.0, 2400.0, 2850.0)
FULL, SOFT = 3000.0, 60.0
SLOPE, READ = 0.5, 6.0
SHARES = {"full_well_dn": 0.003, "softness_dn": 0.3, "spread_percent": 0.2}  # of it, its error


def _recording(seed: int, softness: float) -> InMemory:
    """Return a recording whose charge is limited, softly."""

    def limited(charge: NDArray[np.float64]) -> NDArray[np.float64]:
        soft = FULL - softness * np.log1p(np.exp((FULL - charge) / softness))
        return np.asarray(np.minimum(soft, FULL))

    return responding(seed, LEVELS, limited)


def test_a_soft_limit_starts_near_what_made_it() -> None:
    own = CANDIDATES["saturation"]
    state = state_of(_recording(1, SOFT), camera(segments=((SLOPE, READ, None),)))
    starts = [one.effect for one in own.propose(state.clues())]
    soft = [one for one in starts if isinstance(one, Saturation) and one.softness_dn]
    assert len(soft) == 1
    assert soft[0].full_well_dn == pytest.approx(FULL, abs=2 * (SLOPE * FULL) ** 0.5)
    assert soft[0].softness_dn == pytest.approx(SOFT, rel=0.6)


@pytest.mark.parametrize("softness", [20.0, 80.0, 300.0])
def test_moments_are_those_of_noise_that_is_limited(softness: float) -> None:
    rng = np.random.default_rng(7)
    signal, sd = np.array([2500.0, 2950.0]), np.array([36.0, 39.0])
    mean, log_variance, skewness = soft_moments(signal, sd, FULL, softness)
    for i in range(2):
        q = rng.normal(signal[i], sd[i], 1_000_000)
        made = FULL - softness * np.log1p(np.exp((FULL - q) / softness))
        away = made - made.mean()
        assert made.mean() - signal[i] == pytest.approx(mean[i], abs=0.15)
        assert np.log(made.var() / sd[i] ** 2) == pytest.approx(log_variance[i], abs=0.01)
        assert (away**3).mean() / made.std() ** 3 == pytest.approx(skewness[i], abs=0.02)
        read = made + rng.normal(0.0, 9.0, made.size)  # which no limit takes
        _, with_read, less_skewed = (one[i] for one in soft_moments(signal, sd, FULL, softness, 81))
        assert np.log(read.var() / (sd[i] ** 2 + 81)) == pytest.approx(with_read, abs=0.01)
        assert skew(read) == pytest.approx(less_skewed, abs=0.02)


@pytest.mark.parametrize(("softness", "spread"), [(20.0, 1.0), (80.0, 0.5)])
def test_moments_are_means_over_pixels_whose_limits_differ(softness: float, spread: float) -> None:
    """4000 pixels of 500 samples each: what is between pixels is no noise."""
    rng = np.random.default_rng(8)
    signal, sd = np.array([2950.0, 3050.0]), np.array([39.0, 40.0])
    found = moments_of_many(signal, sd, FULL, softness, spread)
    wells = FULL * (1 + spread / 100 * rng.standard_normal((4000, 1)))
    for i in range(2):
        q = rng.normal(signal[i], sd[i], (4000, 500))
        made = wells - softness * np.logaddexp(0, (wells - q) / softness)
        mean, log_variance, skewness, log_apart = (float(one[i]) for one in found)
        away = made - made.mean(1, keepdims=True)
        assert made.mean() - signal[i] == pytest.approx(mean, abs=1.0)
        assert np.log(made.var(1, ddof=1).mean() / sd[i] ** 2) == pytest.approx(
            log_variance, abs=0.06
        )
        third = (away**3).mean() / (away**2).mean() ** 1.5
        assert third == pytest.approx(skewness, abs=0.06)
        between = made.mean(1).var() - made.var(1, ddof=1).mean() / 500
        assert np.log(between) == pytest.approx(log_apart, abs=0.08)


def _of_wells(spread: float, softness: float) -> Callable[[NDArray[np.float64]], Any]:
    """Return the response of pixels whose full wells differ by so many per cent."""
    own = np.random.default_rng(3).standard_normal((64, 64))
    wells = FULL * (1 + spread / 100 * own)

    def limited(charge: NDArray[np.float64]) -> NDArray[np.float64]:
        if not softness:
            return np.minimum(charge, wells)
        return np.asarray(wells - softness * np.logaddexp(0, (wells - charge) / softness))

    return limited


BRIGHT = (300.0, 900.0, 1500.0, 2100.0, 2990.0)
FAR_ABOVE = (300.0, 900.0, 1500.0, 2100.0, 2800.0, 3160.0, 3800.0)


@pytest.mark.parametrize(
    ("levels", "softness"),
    [
        (BRIGHT, 0.0),
        pytest.param(BRIGHT, 40.0, marks=pytest.mark.long),
        pytest.param(FAR_ABOVE, 40.0, marks=pytest.mark.long),
    ],
)
def test_full_wells_that_differ_from_pixel_to_pixel(
    levels: tuple[float, ...], softness: float
) -> None:
    """numpy's sensor: without a word for it, frames denied the full well of all pixels."""
    found = find_mismatch(
        camera(segments=((SLOPE, READ, None),)),
        responding(5, levels, _of_wells(1.0, softness)),
        seed=1,
    )
    (named,) = found.omitted_physics
    assert named.effect == "saturation"
    assert not found.unexplained
    assert named.heldout_gain.ci95[0] > 0
    truth = {"full_well_dn": FULL, "spread_percent": 1.0, "softness_dn": softness}
    said = {name: one for name, one in named.parameters.items() if one.value}
    assert said.keys() == {name for name, value in truth.items() if value}
    for name, one in said.items():
        assert abs(one.value - truth[name]) < 3 * one.standard_error, name
        assert one.standard_error < SHARES[name] * truth[name], name


@pytest.mark.parametrize("spread", [0.0, 0.3, 1.0])
def test_light_far_above_a_soft_limit_starts_near_what_made_it(spread: float) -> None:
    """Of two flats the noise is gone: nothing foretells that of the brighter one."""
    recording = responding(5, FAR_ABOVE, _of_wells(spread, SOFT))
    started = _proposed(state_of(recording, camera(segments=((SLOPE, READ, None),))))
    alike = [one for one in started if ("spread_percent" in one.free) == (spread > 0)]
    (soft,) = (one.effect for one in alike if "softness_dn" in one.free)
    assert isinstance(soft, Saturation)
    assert soft.full_well_dn == pytest.approx(FULL, abs=10.0)
    assert soft.softness_dn == pytest.approx(SOFT, rel=0.25)
    assert soft.spread_percent == pytest.approx(spread, rel=0.25)


def test_darks_alone_say_nothing_of_a_full_well() -> None:
    """Their brightest place has no signal, and offsets that differ."""
    tails = registry()["heavy_tailed_read_noise"](tail_df=4.0)
    offsets = registry()["dsnu"](sigma_dn=3.0)
    true = camera(offsets, tails, segments=((SLOPE, READ, None),))
    recording = recorded(true, 3, rows=64, columns=64, levels=())
    state = state_of(recording, camera(segments=((SLOPE, READ, None),)))
    assert not any("spread_percent" in one.free for one in _proposed(state))


def test_gains_that_differ_are_no_full_wells_that_do() -> None:
    true = camera(registry()["prnu"](sigma_percent=1.0), segments=((SLOPE, READ, None),))
    state = state_of(recorded(true, 3, levels=LEVELS), camera(segments=((SLOPE, READ, None),)))
    assert not any("spread_percent" in one.free for one in _proposed(state))


def _proposed(state: State) -> Sequence[Proposal]:
    return CANDIDATES["saturation"].propose(state.clues())


def test_a_limit_that_is_not_soft_is_written_as_ever() -> None:
    assert Saturation(full_well_dn=FULL).model_dump().keys() == {"kind", "full_well_dn"}
    assert Saturation(full_well_dn=FULL, softness_dn=2.0).model_dump()["softness_dn"] == 2.0


def test_a_soft_limit_is_not_remembered_as_a_hard_one_nor_a_kink_as_a_step() -> None:
    null = SimpleNamespace(mean=np.zeros(1), sd=np.ones(1), known=np.ones(1, bool))
    state: Any = SimpleNamespace(
        null=null,
        camera=camera(segments=((SLOPE, READ, None),)),
        vector=SimpleNamespace(keys=(Key("skewness", "exposure", "flat", "MONO"),)),
    )
    memory = Memory()
    memory.keep(Saturation(full_well_dn=FULL), state, np.ones(1))
    memory.keep(DualGainMismatch(gain_error_percent=1.0), state, np.ones(1))
    assert memory.recalled(Saturation(full_well_dn=FULL + 1), state) is not None
    assert memory.recalled(Saturation(full_well_dn=FULL, softness_dn=9.0), state) is None
    assert memory.recalled(Saturation(full_well_dn=FULL + 20), state) is None  # half a deviation
    assert memory.recalled(DualGainMismatch(gain_error_percent=1.01), state) is not None
    assert memory.recalled(DualGainMismatch(gain_error_percent=1.0, mean="kinks"), state) is None
    # Most numbers are in units of pixel noise: what was seen beside other noise is forgotten.
    state.vector.keys = (Key("pixel_variance", "exposure", "flat", "MONO"),)
    assert memory.recalled(Saturation(full_well_dn=FULL + 1), state) is not None
    state.null.mean = np.full(1, 0.06)
    assert memory.recalled(Saturation(full_well_dn=FULL + 1), state) is None
