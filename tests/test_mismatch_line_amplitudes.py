"""Promise: amplitudes of lines come from whole frames, with errors that are true."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import judge
from analysis.mismatch.candidates import Proposal, measured
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.instance import unmeasured
from analysis.mismatch.named import Named
from analysis.mismatch.phase import WholeFrames
from dsis.effects import Effect, registry
from dsis.effects.periodic_noise import PeriodicNoise

ROWS, COLUMNS, FRAMES, SD, DRAWS = 48, 64, 12, 2.0, 24
EXPOSURES = ("dark", "flat", "pair", "other")
KINDS = ("periodic_noise", "bistable_pattern")
LAYOUT: Any = SimpleNamespace(
    rows=ROWS,
    columns=COLUMNS,
    channels=("MONO",),
    uniform=tuple(SimpleNamespace(name=name) for name in EXPOSURES),
    variance_dn2={(e, "MONO"): (3 * SD) ** 2 if e == "flat" else SD**2 for e in EXPOSURES},
    still=frozenset(),
    signal_dn={(e, "MONO"): 400.0 * (e == "flat") for e in EXPOSURES},
)


def _seen(effect: Effect, at: tuple[float, float], seed: int) -> WholeFrames:
    """Return whole frames of two stacks and two pairs, drawn here and not by the effect."""
    y, x = np.arange(ROWS)[:, np.newaxis], np.arange(COLUMNS)
    amplitude: float = effect.amplitude_dn  # type: ignore[attr-defined] # lines have one

    def of(name: str) -> Iterator[NDArray[np.float64]]:
        rng = np.random.default_rng([seed, EXPOSURES.index(name)])
        sd = LAYOUT.variance_dn2[name, "MONO"] ** 0.5
        fixed = rng.normal(0, 5, (ROWS, COLUMNS))
        for _ in range(2 if name in ("pair", "other") else FRAMES):
            if effect.kind == "periodic_noise":
                wave = np.cos(2 * np.pi * (at[0] * x + at[1] * y + rng.uniform()))
            else:
                wave = rng.choice([-1, 1]) * np.cos(2 * np.pi * (at[0] * x + at[1] * y))
            yield 100 + fixed + amplitude * wave + rng.normal(0, sd, (ROWS, COLUMNS))

    return WholeFrames(LAYOUT, of)


SINGLE = [(0.5, 0.25), (0.5, 0.5), (0.0, 0.5)]  # patterns of single pixels lie where they lie


@pytest.mark.parametrize(
    ("kind", "at", "off"),  # of a bin, by which the frequency is wrong
    [
        *((kind, (0.11, -0.23), off) for kind in KINDS for off in (0.0, 1 / 6, 0.25)),
        ("periodic_noise", SINGLE[0], 0.0),
        *(("bistable_pattern", at, 0.0) for at in SINGLE),
    ],
)
def test_amplitudes_are_what_was_planted(kind: str, at: tuple[float, float], off: float) -> None:
    """Of 24 recordings the errors' mean square is 1 within chance, and none is far off."""
    planted = 0.35
    true = (at[0] + off / COLUMNS, at[1] - off / ROWS)
    effect = registry()[kind](amplitude_dn=planted, frequency=at)
    found = [_seen(effect, true, seed).line(effect) for seed in range(DRAWS)]
    known = [one for one in found if one is not None]
    assert len(known) > 0.8 * DRAWS
    z = np.array([(one.amplitude_dn - planted) / one.amplitude_error_dn for one in known])
    # A mean of 24 squares has a standard error of 0.29; what is between steps costs a per cent.
    assert 0.3 < (z**2).mean() < 2.0
    assert abs(z.mean()) < 0.9
    assert np.abs(z).max() < 4.5
    if at in SINGLE:
        assert {one.frequency for one in known} == {at}
        return
    off_by = np.array([np.subtract(one.frequency, true) / one.frequency_error for one in known])
    off_by *= np.array([ROWS / COLUMNS, 1.0]) ** -1  # the error stated is that of the shorter side
    assert 0.3 < (off_by**2).mean() < 2.0


def test_a_frequency_is_less_known_where_each_frame_hardly_shows_its_phase() -> None:
    """Of noise that has two thirds of a line's power in a frame, products of noise add as much."""
    at = (0.11, -0.23)
    effect = registry()["periodic_noise"](amplitude_dn=0.09, frequency=at)
    found = [_seen(effect, at, seed).line(effect) for seed in range(60)]
    known = [one for one in found if one is not None]
    assert len(known) > 20
    off_by = np.array([np.subtract(one.frequency, at) / one.frequency_error for one in known])
    off_by *= np.array([COLUMNS / ROWS, 1.0])
    assert 0.6 < (off_by**2).mean() < 1.5


@pytest.mark.parametrize(
    ("at", "error"),
    [((0.25, 0.5), 0.0), ((0.125, -0.375), 0.0), ((0.11, -0.23), 1 / 48 / 12**0.5)],
)
def test_a_frequency_that_was_not_measured_lies_between_two_waves(
    at: tuple[float, float], error: float
) -> None:
    assert unmeasured(at, LAYOUT) == pytest.approx(error)


def test_noise_has_no_amplitude() -> None:
    none = PeriodicNoise(amplitude_dn=0.0, frequency=(0.11, -0.23))
    assert all(_seen(none, none.frequency, seed).measured(none) is None for seed in range(8))


def test_what_was_measured_is_fitted_no_more() -> None:
    line = PeriodicNoise(amplitude_dn=0.2, frequency=(0.1, 0.2))
    values, errors = {"amplitude_dn": 0.3}, {"amplitude_dn": 0.01}
    found = measured(Proposal(line, ("amplitude_dn",)), values, errors)
    assert found.effect == PeriodicNoise(amplitude_dn=0.3, frequency=(0.1, 0.2))
    assert found.free == ()
    assert found.errors == errors


@pytest.mark.parametrize("free", [("amplitude_dn",), ()])
def test_a_line_that_frames_show_is_not_denied_by_numbers(
    monkeypatch: pytest.MonkeyPatch, free: tuple[str, ...]
) -> None:
    """Correlations that others make hide it in numbers: it is denied only where these fit it."""
    line = Proposal(PeriodicNoise(amplitude_dn=0.2, frequency=(0.1, 0.2)), free)
    named = Named("periodic_noise", line, {}, 30.0, ())
    predictor = SimpleNamespace(
        replicates=16, ready=list, mean=lambda _: np.zeros(1), worth=lambda _: 30.0
    )
    state: Any = SimpleNamespace(predictor=lambda *_: predictor)
    monkeypatch.setattr(judge, "contradicted", lambda *_: Denial(0.0, "it shows 0%"))
    monkeypatch.setattr(judge, "resolved", lambda *_: 0.0)
    asked = judge.Judge(state, lambda _: None, 16)  # type: ignore[arg-type, return-value] # no camera
    assert (asked.denied([named]) is not None) == bool(free)
    assert (asked.needless([named]) is not None) == bool(free)
