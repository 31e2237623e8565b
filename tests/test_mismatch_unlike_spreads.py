"""Spreads of one name that differ as chance does not make them say less of each other."""

import numpy as np
import pytest

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.key import Key
from analysis.mismatch.null import _by_name, _unlike
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

DOF = 15


@pytest.mark.parametrize("worth", [3.0, 8.0])
def test_prior_variance_and_degrees_are_those_drawn_from(worth: float) -> None:
    """Smyth 2004, section 6.2: variances are drawn as d0 s0^2 / chi^2(d0), and seen with 15.

    Far above the least spread that counts.
    """
    rng = np.random.default_rng(int(worth))
    true = 50.0 * worth / rng.chisquare(worth, 20_000)
    found = _unlike(true * rng.chisquare(DOF, true.size) / DOF, DOF)
    assert found is not None
    typical, degrees = found
    assert typical == pytest.approx(50.0, rel=0.03)
    assert degrees == pytest.approx(worth, rel=0.05)


def test_spreads_of_one_law_are_alike() -> None:
    """All but one in ten thousand, by the rule: of 2000 draws of ten, 0.2 on average."""
    rng = np.random.default_rng(1)
    unlike = [_unlike(rng.chisquare(DOF, 10) / DOF, DOF) is not None for _ in range(2000)]
    assert sum(unlike) <= 3


@pytest.mark.parametrize("little", [0.0, 1e-31, 0.005])
def test_one_that_hardly_spreads_leaves_others_together(little: float) -> None:
    own = np.random.default_rng(4).chisquare(DOF, 12) / DOF
    own[0] = little
    found = _unlike(own, DOF)
    assert found is None or found[1] > 8


def test_one_that_spreads_a_hundred_times_as_far_leaves_others_as_they_are() -> None:
    rng = np.random.default_rng(2)
    own = rng.chisquare(DOF, 10) / DOF
    own[0] *= 1e4
    keys = [Key("skewness", "exposure", f"flat-{i}", "MONO") for i in range(10)]
    scale, worth, tails = _by_name(keys, own, np.ones(10, bool), DOF)
    variance = tails**2 * (worth * scale + DOF * own) / (worth + DOF)
    assert (variance[1:] < 4).all()
    assert variance[0] > 3000
    assert (tails > 1).all()
    assert (tails < 1.5).all()


@pytest.mark.long
def test_photons_are_named_beside_few_pixels_that_jump() -> None:
    """Few jumping pixels make the skewness of darks anything; that of lit frames is the light's."""
    counted = camera(registry()["rts"](pixel_fraction=0.001, amplitude_dn=25.0))
    counted = counted.model_copy(
        update={"noise": counted.noise.model_copy(update={"shot": "poisson"})}
    )
    levels = (30.0, 60.0, 120.0, 250.0, 500.0, 900.0)
    found = find_mismatch(camera(), recorded(counted, 5, levels=levels), seed=1)
    assert {one.effect for one in found.omitted_physics} == {"rts", "poisson_shot_noise"}


@pytest.mark.parametrize(
    ("kind", "size", "statistic"),
    [
        ("flicker", {"sigma_percent": 1.0}, "level"),
        ("flicker", {"sigma_percent": 1.0}, "frame_variance"),
        ("row_noise", {"sigma_dn": 4.0}, "row_variance"),
    ],
)
def test_errors_are_those_of_their_own_exposure(
    kind: str, size: dict[str, float], statistic: str
) -> None:
    """What a model's light or rows do in one exposure makes others no less sure."""
    model = camera(registry()[kind](**size))
    states = [state_of(recorded(model, seed, levels=FEW_LEVELS), model) for seed in (1, 2)]
    which = [
        i
        for i, key in enumerate(states[0].vector.keys)
        if (key.statistic, key.scope) == (statistic, "exposure")
    ]
    spread = np.concatenate([state.simulated[:, which] for state in states]).std(0, ddof=1)
    for state in states:
        ratio = state.null.sd[which] / spread
        assert (ratio < 2.5).all()
        assert (ratio > 0.5).all()


@pytest.mark.long
def test_a_current_is_named_beside_light_that_flickers() -> None:
    """A level of 0.3 DN in the dark, beside flats that move by 26 DN from frame to frame."""
    flicker, current = (registry()[kind] for kind in ("flicker", "dark_current"))
    true = camera(flicker(sigma_percent=1.0), current(dn_per_s=6.0))
    words = frozenset({"flicker", "dark_current", "black_level_drift", "line_flicker"})
    finding = find_mismatch(
        camera(), recorded(true, 3, rows=64, columns=96, levels=FEW_LEVELS), vocabulary=words
    )
    assert {one.effect for one in finding.omitted_physics} == {"flicker", "dark_current"}
