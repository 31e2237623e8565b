"""Spikes of hundreds of standard deviations: base numbers and codes are those of the many."""

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.bank.bulk import Bulk
from analysis.mismatch.basefit import BaseFit
from analysis.mismatch.observe import observe
from analysis.mismatch.recalibrate import calibrate
from analysis.mismatch.source import Source
from analysis.mismatch.split import Split
from analysis.mismatch.taking import layout_of
from analysis.mismatch.touches import SPIKES
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import Effect, registry
from dsis.measures import Accumulator, Estimate
from mismatch_recordings import FEW_LEVELS, camera, recorded, state_of

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES = 32, 48, 8
SIGMA = 3.0
PLACES = {"MONO": (0, 0, 1)}
IMPULSE = registry()["impulse"](per_megapixel_frame=500.0, mean_dn=1500.0)
RIVALS = frozenset(
    {"impulse", "heavy_tailed_read_noise", "read_noise_spread", "rts", "hot_pixels", "dsnu", "prnu"}
)
"""What makes single samples or pixels stand out."""


def _noise(rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.normal(100, SIGMA, (FRAMES, ROWS, COLUMNS)).round()


def _bulk(frames: NDArray[np.float64]) -> Bulk:
    sums = Bulk(PLACES, {"MONO": SIGMA**2})
    assert len(list(sums.watching(frames))) == len(frames)
    return sums


@pytest.mark.parametrize("frames", [2, FRAMES])
def test_the_variance_of_the_many_is_unbiased_and_its_error_known(frames: int) -> None:
    rng = np.random.default_rng(1)
    sums = [_bulk(_noise(rng)[:frames]) for _ in range(400)]
    found = np.array([one.variance_dn2("MONO", np.nan) for one in sums])
    true = SIGMA**2 + 1 / 12
    error = true * np.sqrt(2 / sums[0].dof("MONO"))
    assert abs(found.mean() - true) < 4 * error / 400**0.5
    assert found.std() == pytest.approx(error, rel=0.1)


def test_lines_and_frames_that_move_as_one_are_no_noise_of_pixels() -> None:
    """Light that flickers by many standard deviations of a pixel is no spike either."""
    rng = np.random.default_rng(2)
    frames = _noise(rng) + rng.normal(0, 2, (FRAMES, ROWS, 1)).round()
    frames += rng.normal(0, 40, (FRAMES, 1, 1)).round()
    found = _bulk(frames)
    assert found.variance_dn2("MONO", np.nan) == pytest.approx(SIGMA**2, rel=0.05)
    assert found.far("MONO") < 1e-3


def test_spikes_are_left_out_and_counted() -> None:
    rng = np.random.default_rng(3)
    frames = _noise(rng)
    hit = rng.random(frames.shape) < 0.01
    frames[hit] += 500
    found = _bulk(frames)
    assert found.variance_dn2("MONO", np.nan) == pytest.approx(SIGMA**2, rel=0.05)
    # Both differences of a frame see it; two spikes in a row may cancel.
    assert found.far("MONO") == pytest.approx(2 * 0.01 * 0.99, rel=0.2)


def test_what_is_not_rare_is_no_spike() -> None:
    """The scale was wrong, say: then the plain variance is all that is known."""
    found = Bulk(PLACES, {"MONO": SIGMA**2 / 100})
    list(found.watching(_noise(np.random.default_rng(5))))
    assert found.variance_dn2("MONO", 7.0) == 7.0
    one = Bulk(PLACES, {"MONO": SIGMA**2})
    list(one.watching(_noise(np.random.default_rng(5))[:1]))
    assert one.variance_dn2("MONO", 7.0) == 7.0


@pytest.mark.parametrize("effects", [(), (IMPULSE,)])
def test_flicker_does_not_move_base_numbers(effects: tuple[Effect, ...]) -> None:
    flicker = registry()["flicker"](sigma_percent=20.0)
    true = camera(*effects, flicker)
    (piece,) = _fitted(true, cfa="RGGB").pieces
    assert abs(piece.slope - 0.5) < 5 * piece.slope_error < 0.1


def _fitted(true: Camera, cfa: str = "MONO") -> BaseFit:
    true = true.model_copy(update={"cfa": Cfa(cfa)})
    recording = recorded(true, 6)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    dark = seen.levels["dark-0", layout.channels[0]]
    assert (dark.variance_dn2 > 10 * 20.0) == (IMPULSE in true.effect)  # of the spikes
    return calibrate(true, layout, seen, None, seed=1, jobs=1).fit


def test_base_numbers_beside_spikes_are_those_of_the_many() -> None:
    (piece,) = _fitted(camera(IMPULSE)).pieces
    assert abs(piece.intercept - 20.0) < 4 * piece.intercept_error < 4.0
    assert abs(piece.slope - 0.5) < 4 * piece.slope_error < 0.1


def test_a_wrong_switch_is_found_beside_spikes() -> None:
    segments = ((0.5, 20.0, 700.0), (0.8, 120.0, None))
    true = camera(IMPULSE, segments=segments)
    recording = recorded(true, 6)
    split, source = Split.of(recording), Source(recording)
    layout = layout_of(recording, split.development, source.frames)
    numbers = {e.name: e.numbers for e in layout.exposures}
    seen = observe(layout, lambda name: source.frames(name, numbers[name]))
    wrong = camera(IMPULSE, segments=((0.5, 20.0, 1200.0), (0.8, 120.0, None)))
    (switch,) = calibrate(wrong, layout, seen, None, seed=1, jobs=1).switches
    assert 500 < switch < 900


@pytest.mark.long
def test_rare_spikes_are_named_alone_with_their_numbers() -> None:
    recording = recorded(camera(IMPULSE), 6, levels=FEW_LEVELS)
    found = find_mismatch(camera(), recording, seed=2, vocabulary=RIVALS)
    assert [effect.effect for effect in found.omitted_physics] == ["impulse"]
    for name, true in (("per_megapixel_frame", 500.0), ("mean_dn", 1500.0)):
        fitted = found.omitted_physics[0].parameters[name]
        assert isinstance(fitted.value, float)
        assert abs(fitted.value - true) < 4 * fitted.standard_error < 2 * true


@pytest.mark.parametrize("uneven", [False, True])
def test_widths_of_codes_are_told_beside_spikes(uneven: bool) -> None:
    """Their variance is no width of the noise that smooths the histogram."""
    rng = np.random.default_rng(4)
    exact = rng.normal(100, SIGMA, (64, 96, 128))
    hit = rng.random(exact.shape) < 5e-4
    spiked = exact + np.where(hit, rng.exponential(1000, exact.shape), 0.0)
    plain, beside = (_imbalance(values, uneven) for values in (exact, spiked))
    assert (beside.value > 10 * beside.null_error) == uneven
    assert beside.value == pytest.approx(plain.value, rel=0.1, abs=plain.null_error)


def _imbalance(exact: NDArray[np.float64], uneven: bool) -> Estimate:
    """Return what is measured where every other code is a tenth wider, its neighbours narrower."""
    codes = np.floor(exact + 0.1 * (np.floor(exact) % 2)) if uneven else np.floor(exact)
    sums = Accumulator(96, 128, camera().cfa, 0.0, 65535.0)
    for frame in codes:
        sums.add(np.clip(frame, 0, 65535).astype(np.float32))
    return sums.result().channels["MONO"].estimates["code_imbalance"]


def test_base_numbers_of_the_many_are_refitted_to_the_many() -> None:
    """Simulations of a spiky recording leave spikes out as well."""
    state = state_of(recorded(camera(IMPULSE), 4, rows=64, columns=96), camera())
    assert state.calibrated.sums == {SPIKES}
    own = [key.statistic == "pixel_variance" for key in state.vector.keys]
    assert np.isfinite(state.simulated[:, own]).all()
    brighter = state.camera.model_copy(update={"effect": (IMPULSE,)})
    assert np.isfinite(state.simulations.of(brighter, 1)[:, own]).all()
