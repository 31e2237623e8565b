"""Errors of numbers that do not fit, or whose law has a form that is not told; bands that move on.

And what may not be named: codes that spikes fill, limits that no level is near, waves longer than
frames.
"""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

from analysis.mismatch.bandgain import turns_of_bands
from analysis.mismatch.feignedtails import spiked
from analysis.mismatch.formerror import form_of
from analysis.mismatch.notfull import far_below
from analysis.mismatch.phase import WholeFrames
from analysis.mismatch.uncertainty import _misfit
from dsis.effects.bistable_pattern import BistablePattern
from dsis.effects.brighter_fatter import BrighterFatter
from dsis.effects.prnu import Prnu
from dsis.effects.saturation import Saturation

Array = NDArray[np.float64]
NUMBERS, SURE, SIMULATED = 200, 5.0, 16
ROWS, COLUMNS, FRAMES, SD = 96, 64, 10, 4.0


def test_numbers_that_fit_leave_errors_as_they_are() -> None:
    """Chance makes the mean square of 200 numbers 1 +- 0.1: 3 of these in one of 700."""
    rng = np.random.default_rng(1)
    larger = 0
    for _ in range(200):
        slopes, sd = rng.standard_normal((NUMBERS, 2)), rng.uniform(0.5, 2, NUMBERS)
        left, drawn = (sd * rng.standard_normal((n, NUMBERS)) for n in (1, SIMULATED))
        larger += bool((_misfit(slopes, sd, left, drawn) > 1).any())
    assert larger <= 8


def test_numbers_that_move_together_are_no_proof_of_another_law() -> None:
    """Eight that all are seen five times, in four channels and the whole: chance is that of eight.

    A mean square of chi-squared with so few degrees of freedom leans: three standard deviations of
    its scatter are exceeded four times as often as of a normal number.
    """
    rng = np.random.default_rng(4)
    slopes, sd = np.ones((40, 1)), np.full(40, 2.0)
    larger = 0
    for _ in range(1000):
        drawn = np.repeat(2 * rng.standard_normal((1 + SIMULATED, 8)), 5, 1)
        larger += bool((_misfit(slopes, sd, drawn[:1], drawn[1:]) > 1).any())
    assert larger <= 12  # 1.35 expected by the law, more by a scatter that is known of 16


def test_errors_are_larger_by_what_numbers_that_tell_them_are_off() -> None:
    """The first half tells one parameter, and is off by 4 standard deviations; the other fits."""
    rng = np.random.default_rng(2)
    half = np.arange(NUMBERS) < NUMBERS // 2
    slopes = np.stack([half, ~half], 1).astype(float)
    sd = np.full(NUMBERS, 3.0)
    left, drawn = (sd * rng.standard_normal((n, NUMBERS)) for n in (1, SIMULATED))
    first, other = _misfit(slopes, sd, left * np.where(half, 4.0, 1.0), drawn)
    assert first == pytest.approx(4, rel=SURE * (1 / NUMBERS) ** 0.5)
    assert other == 1


@pytest.mark.parametrize("share", [0.002, 0.01, 0.02])
def test_the_rate_of_an_exchange_hangs_on_when_charge_is_exchanged(share: float) -> None:
    """Charge that is exchanged while it comes in loses less than the same exchange at the end.

    The rate at the end that leaves the same variance of a wave, (1 - x / 2)^2, is less by what is
    said, to first order.
    """
    signal = 2000.0
    x = 8 * share
    kept = quad(lambda t: np.exp(-2 * x * t), 0, 1)[0]
    at_the_end = 2 * (1 - kept**0.5)
    layout: Any = SimpleNamespace(
        uniform=[SimpleNamespace(name="flat", kind="flat"), SimpleNamespace(name="d", kind="dark")],
        signal_dn={("flat", "MONO"): signal, ("d", "MONO"): 9999.0},
    )
    effect = BrighterFatter(per_dn=share / signal)
    assert form_of(effect, "per_dn", layout) == pytest.approx(1 - at_the_end / x, rel=0.3)
    assert form_of(effect, "anisotropy", layout) == 0
    assert form_of(Prnu(sigma_percent=1.0), "sigma_percent", layout) == 0


def _levels(top: float, variance: float) -> Any:
    place = ("flat", "MONO")
    layout = SimpleNamespace(
        uniform=[SimpleNamespace(name="flat", kind="flat")], signal_dn={place: top}
    )
    seen = SimpleNamespace(levels={place: SimpleNamespace(variance_dn2=variance)})
    even = SimpleNamespace(layout=SimpleNamespace(sites={}))
    return SimpleNamespace(setting=SimpleNamespace(layout=layout, seen=seen), clues=lambda: even)


def test_a_soft_limit_needs_a_level_near_it() -> None:
    soft = Saturation(full_well_dn=3000.0, softness_dn=200.0)
    denied = far_below(_levels(2200.0, 900.0), soft)
    assert denied is not None
    assert "no level is near" in denied.why
    assert far_below(_levels(2700.0, 900.0), soft) is None
    assert far_below(_levels(2200.0, 900.0), Saturation(full_well_dn=3000.0)) is None
    assert far_below(_levels(2200.0, 900.0), Prnu(sigma_percent=1.0)) is None
    # Noise has a standard deviation of 30 DN: what cuts its tail is near, however hard it is.
    assert far_below(_levels(2940.0, 900.0), Saturation(full_well_dn=3000.0, softness_dn=2)) is None


def test_spikes_that_are_left_make_codes_uneven() -> None:
    def left(**sizes: float) -> Any:
        off = [SimpleNamespace(statistic=name, z=z) for name, z in sizes.items()]
        return SimpleNamespace(mismatches=off)

    assert spiked(left(one_off_outliers=90.0, kurtosis=7000.0), "adc_dnl") is not None
    assert spiked(left(one_off_outliers=90.0, kurtosis=7000.0), "prnu") is None
    assert spiked(left(kurtosis=7000.0), "adc_dnl") is None
    assert spiked(left(one_off_outliers=5.0, kurtosis=6.0), "adc_dnl") is None
    assert spiked(left(one_off_outliers=-90.0, kurtosis=-90.0), "adc_dnl") is None


def test_a_pattern_has_more_than_a_wave_in_a_frame() -> None:
    layout: Any = SimpleNamespace(rows=ROWS, columns=COLUMNS)

    def none(_: str) -> Iterator[Array]:
        return iter(())

    long = BistablePattern(amplitude_dn=1.0, frequency=(1.2 / COLUMNS, 0.4 / ROWS))
    why = WholeFrames(layout, none).denial(long)
    assert why is not None
    assert "smooth surface" in why


def _flats(depth: float, cycles: float, turns: float | None) -> Any:
    def frames(name: str) -> Iterator[Array]:
        rng = np.random.default_rng([3, int(name[-1])])
        start, y = rng.random(), np.arange(ROWS)[:, None]
        for k in range(FRAMES):
            turn = rng.random() if turns is None else start + turns * k
            light = 1 + depth * np.sin(2 * np.pi * (cycles * y / ROWS + turn))
            yield 1000 * light + rng.normal(0, SD, (ROWS, COLUMNS))

    return frames


@pytest.mark.parametrize("turns", [0.3, 0.71, None])
def test_the_step_of_a_phase_is_told(turns: float | None) -> None:
    """Of bands of 0.3 DN in noise of 4 DN; phases at random have none."""
    names = [f"flat-{k}" for k in range(4)]
    layout: Any = SimpleNamespace(
        rows=ROWS,
        columns=COLUMNS,
        channels=("MONO",),
        uniform=tuple(SimpleNamespace(name=n, numbers=tuple(range(FRAMES))) for n in names),
        variance_dn2={(n, "MONO"): SD**2 for n in names},
        signal_dn={(n, "MONO"): 1000.0 for n in names},
        still=frozenset(),
    )
    found = turns_of_bands(layout, _flats(3e-4, 3.3, turns), 3.3)
    if turns is None:
        assert found is None
    else:
        assert found is not None
        assert found[0] == pytest.approx(turns, abs=0.02)
        assert 0 < found[1] < 0.03
