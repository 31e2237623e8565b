"""Codes that are not equally wide change the tails of noise: that is no heavy-tailed noise."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from analysis.mismatch import feigned
from analysis.mismatch.bank.key import Key
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.feignedtails import coded, lopsided, mixed, placed, timed, underlaid
from dsis.effects.adc_dnl import AdcDnl
from exposing import effect

TAILS = "heavy_tailed_read_noise"


def _kurtosis(rms: float, sd: float, rng: np.random.Generator) -> float:
    """Return the excess kurtosis of Gaussian noise of `sd` codes read by codes of unequal width."""
    half = int(10 * sd)
    codes = np.arange(-half, half + 1)
    edges = np.concatenate([[0.0], np.cumsum(1 + rms * rng.standard_normal(codes.size))])
    share = np.diff(norm.cdf((edges - edges[half] - 0.5) / sd))
    share /= share.sum()
    centred = codes - (share * codes).sum()
    return float((share * centred**4).sum() / (share * centred**2).sum() ** 2 - 3)


def _state(claimed: float, imbalance: float, variance: float = 9.0, located: bool = True) -> Any:
    """Return a state with tails, whose darks use their codes unevenly beyond the model."""
    keys = tuple(
        Key(statistic=s, scope="exposure", exposure="dark", channel="MONO", detail="")
        for s in ("kurtosis", "code_imbalance")
    )
    level = SimpleNamespace(variance_dn2=variance)
    return SimpleNamespace(
        camera=SimpleNamespace(effect=()),
        setting=SimpleNamespace(
            seen=SimpleNamespace(levels={("dark", "MONO"): level, ("flat", "MONO"): level}),
            layout=SimpleNamespace(
                exposures=[
                    SimpleNamespace(name="dark", kind="dark"),
                    SimpleNamespace(name="flat", kind="flat"),
                ]
            ),
        ),
        vector=SimpleNamespace(keys=keys, values=np.array([claimed, imbalance])),
        null=SimpleNamespace(mean=np.array([claimed, 0.0]), known=np.ones(2, bool)),
        mismatches=[SimpleNamespace(statistic="code_imbalance")] if located else [],
    )


WITHOUT = np.zeros(2)


@pytest.mark.parametrize(("rms", "sd"), [(0.1, 2.0), (0.08, 3.0), (0.2, 6.0)])
def test_tails_as_codes_of_a_converter_feign_them_are_denied(rms: float, sd: float) -> None:
    rng = np.random.default_rng(8)
    drawn = np.array([_kurtosis(rms, sd, rng) for _ in range(400)])
    denied = [coded(_state(k, rms, sd**2), TAILS, WITHOUT) is not None for k in drawn if k > 0]
    assert np.mean(denied) > 0.98  # four standard deviations are feigned, and half of that is asked
    assert drawn.std() == pytest.approx(1.84 * rms / sd**0.5, rel=0.1)


@pytest.mark.parametrize("kind", [TAILS, "impulse"])
def test_tails_far_beyond_what_codes_feign_are_believed(kind: str) -> None:
    """Of few spikes too: those of a real CCD, 0.7 per megapixel, were its converter's codes."""
    assert coded(_state(0.1, 0.08), kind, WITHOUT) is not None
    assert coded(_state(0.6, 0.08), kind, WITHOUT) is None
    assert coded(_state(0.1, 0.08), "rts", WITHOUT) is None


def test_codes_that_are_explained_feign_nothing() -> None:
    assert coded(_state(0.1, 0.08, located=False), TAILS, WITHOUT) is None
    assert coded(_state(0.1, 0.0), TAILS, WITHOUT) is None
    assert coded(_state(0.1, 0.08), "rts", WITHOUT) is None


def test_widths_that_are_named_feign_tails_too() -> None:
    """The model's converter is drawn with other codes: 0.03 in noise of one scatter by 0.055."""
    state = _state(0.1, 0.0, 1.0, located=False)
    state.camera.effect = (AdcDnl(rms_lsb=0.03),)
    assert coded(state, TAILS, WITHOUT) is not None
    state.null.known[1] = False  # noise of one code does not show the widths
    assert coded(state, TAILS, WITHOUT) is not None
    far = _state(0.6, 0.0, 1.0, located=False)
    far.camera.effect = state.camera.effect
    assert coded(far, TAILS, WITHOUT) is None


def test_tails_where_widths_are_unknown_count_as_claimed() -> None:
    """Noise of less than two codes in the darks: what flats show of widths is no word on those."""
    state = _state(1.5, np.nan)
    keys = [*state.vector.keys]
    keys += [replace(key, exposure="flat") for key in keys]
    state.vector.keys, state.vector.values = tuple(keys), np.array([1.5, np.nan, 0.01, 0.02])
    state.null.mean = np.array([1.5, np.nan, 0.01, 0.0])
    state.null.known = np.array([True, False, True, True])
    assert coded(state, TAILS, np.zeros(4)) is None


def test_numbers_that_nothing_is_known_of_deny_nothing() -> None:
    assert coded(_state(0.1, 0.08), TAILS, np.array([np.nan, 0.0])) is None


def _leaning(skewness: float, expected: float, sd: float) -> Any:
    """Return a state with tails, whose null knows how far chance leans such noise."""
    key = Key(statistic="skewness", scope="exposure", exposure="dark", channel="MONO", detail="")
    z = np.array([(skewness - expected) / sd])
    dark = SimpleNamespace(name="dark", kind="dark")
    return SimpleNamespace(
        camera=SimpleNamespace(effect=()),
        setting=SimpleNamespace(layout=SimpleNamespace(uniform=(dark,))),
        vector=SimpleNamespace(keys=(key,), values=np.array([skewness]), errors=np.array([0.01])),
        null=SimpleNamespace(departures=lambda _: z),
    )


@pytest.mark.parametrize(
    ("skewness", "sd", "denied"),
    [
        (40.0, 1.5, True),  # spikes of one sign
        (-40.0, 1.5, True),
        (40.0, 20.0, False),  # one large value: chance, among tails as heavy
        (0.6, 0.02, False),  # shot noise of three electrons
    ],
)
def test_heavy_tails_lean_to_no_side(skewness: float, sd: float, denied: bool) -> None:
    assert (lopsided(_leaning(skewness, 0.0, sd), TAILS) is not None) == denied
    assert (lopsided(_leaning(skewness, 0.0, sd), "impulse") is not None) == (skewness < 0)


def test_spikes_that_go_down_are_no_charge() -> None:
    """Bits that flip do so both ways; beside tails, or uneven codes, noise leans by chance."""
    state = _leaning(-0.2, 0.0, 5.0)  # 20 errors of white noise, well within spikes' own scatter
    assert lopsided(state, "impulse") is not None
    state.camera.effect = (AdcDnl(rms_lsb=0.1),)
    assert lopsided(state, "impulse") is None
    assert lopsided(_leaning(-0.05, 0.0, 5.0), "impulse") is None


@pytest.mark.parametrize(
    ("within", "left", "told"),
    [
        (0.0, "smooth_variance_spread", False),
        (0.05, "smooth_variance_spread", True),  # five errors: pixels have tails of their own
        (0.0, "column_variance_spread", False),
        (0.05, "row_variance_spread", True),
        (0.0, "kurtosis", True),
    ],
)
def test_noise_that_has_its_place_is_no_tails(within: float, left: str, *, told: bool) -> None:
    names = ("kurtosis", "kurtosis_within_pixels")
    keys = tuple(Key(s, "exposure", "dark", "MONO", "") for s in names)
    state: Any = SimpleNamespace(
        mismatches=[SimpleNamespace(statistic=left)],
        vector=SimpleNamespace(keys=keys, values=np.array([0.06, within])),
        null=SimpleNamespace(
            mean=np.full(2, 0.06), sd=np.full(2, 0.01), known=np.ones(2, np.bool_)
        ),
    )
    assert (placed(state, TAILS, WITHOUT) is None) == told
    assert (placed(state, "impulse", WITHOUT) is None) == told
    assert placed(state, "read_noise_spread", WITHOUT) is None


def test_tails_that_single_pixels_cannot_show_are_not_denied() -> None:
    """Of three frames no kurtosis within pixels is known."""
    state: Any = SimpleNamespace(
        mismatches=[SimpleNamespace(statistic="smooth_variance_spread")],
        vector=SimpleNamespace(
            keys=(Key("kurtosis", "exposure", "dark", "MONO", ""),), values=np.array([0.06])
        ),
        null=SimpleNamespace(
            mean=np.array([0.06]), sd=np.array([0.01]), known=np.ones(1, np.bool_)
        ),
    )
    assert placed(state, TAILS, np.zeros(1)) is None
    assert placed(state, "impulse", np.zeros(1)) is None
    state.mismatches = [SimpleNamespace(statistic="column_variance_spread")]
    state.setting = SimpleNamespace(layout=SimpleNamespace(variance_dn2={"dark": 9.0, "flat": 90}))
    for height, none in ((40.0, False), (80.0, True)):  # higher than any noise of the darks
        own = effect("impulse", per_megapixel_frame=2000.0, mean_dn=height)
        state.camera = SimpleNamespace(effect=(own,))
        assert placed(state, TAILS, np.zeros(1)) is None
        # Outliers of the noisiest lines, if they do not tower above all noise.
        assert (placed(state, "impulse", np.zeros(1)) is None) == none


@pytest.mark.parametrize(
    ("change", "short", "grows", "denied"),
    [
        (5.0, 0.5, True, True),  # tails that would show without time, and do not
        (5.0, 4.0, True, False),
        (0.2, 0.5, True, True),  # few electrons of a glow, in long exposures alone
        (0.2, 3.5, True, False),  # rare spikes, of which a short dark has one as well
        (0.2, 0.5, False, False),  # nothing is left that grows with time
    ],
)
@pytest.mark.parametrize("times", [(0.01, 0.5), (0.5, 0.5)])
def test_tails_of_charge_that_needs_time_are_no_spikes(
    change: float, short: float, grows: bool, denied: bool, times: tuple[float, float]
) -> None:
    names = ("flat", "short", "long")
    keys = tuple(
        Key(statistic="kurtosis", scope="exposure", exposure=name, channel="MONO", detail="")
        for name in names
    )
    where = SimpleNamespace(exposure_time_s=(0.01, 0.5) if grows else None)
    uniform = [
        SimpleNamespace(name=name, exposure_time_s=time, kind="flat" if name == "flat" else "dark")
        for name, time in zip(names, (1e-4, *times), strict=True)  # a flat has too much noise
    ]
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(layout=SimpleNamespace(uniform=uniform)),
        vector=SimpleNamespace(
            keys=keys, values=np.array([0.0, short, 60.0]), errors=np.array([1.0, 1.0, 1.0])
        ),
        null=SimpleNamespace(
            mean=np.array([0.0, change, 60.0]), sd=np.ones(3), known=np.ones(3, bool)
        ),
        mismatches=[SimpleNamespace(statistic="level", where=where)],
    )
    for kind in ("impulse", TAILS):
        assert (timed(state, kind, np.zeros(3)) is not None) is (denied and len(set(times)) > 1)
    assert timed(state, "rts", np.zeros(3)) is None
    state.null.known[:] = False
    assert timed(state, "impulse", np.zeros(3)) is None


@pytest.mark.parametrize("name", ["timed", "mixed", "warmed", "grown", "placed"])
def test_all_that_feigns_an_effect_is_asked(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    own = effect("impulse", per_megapixel_frame=30.0)
    asked = [n for n in feigned.of_another.__code__.co_names if callable(getattr(feigned, n, None))]
    for other in asked:
        monkeypatch.setattr(feigned, other, lambda *_: None)
    state: Any = SimpleNamespace(null=SimpleNamespace(mean=np.zeros(1)))
    assert feigned.of_another(state, own, np.zeros(1)) is None
    said = Denial(0.0, "for a reason")
    monkeypatch.setattr(feigned, name, lambda *_: said)
    assert feigned.of_another(state, own, np.zeros(1)) is said


@pytest.mark.parametrize(
    ("along_rows", "along_columns", "denied"),
    [
        (0.07, 0.05, True),
        (0.07, 0.0, False),  # a filter along rows
        (0.02, 0.02, False),  # may be another's
    ],
)
def test_noise_that_neighbours_share_in_the_dark_is_no_law_of_single_samples(
    along_rows: float, along_columns: float, denied: bool
) -> None:
    names = ("correlation_0_1", "correlation_1_0")
    keys = tuple(
        Key(statistic=name, scope="exposure", exposure="dark", channel="MONO", detail="")
        for name in names
    )
    state: Any = SimpleNamespace(
        setting=SimpleNamespace(
            layout=SimpleNamespace(exposures=[SimpleNamespace(name="dark", kind="dark")])
        ),
        vector=SimpleNamespace(keys=keys, values=np.array([along_rows, along_columns])),
        null=SimpleNamespace(mean=np.zeros(2), sd=np.full(2, 0.004), known=np.ones(2, bool)),
        mismatches=[SimpleNamespace(statistic=name) for name in names],
    )
    for kind in ("adc_dnl", "read_noise_spread", TAILS):
        assert (mixed(state, kind) is not None) is denied
    assert mixed(state, "quantisation") is None


@pytest.mark.parametrize(
    ("low_dn4", "leaning", "kind", "denied"),
    [
        (81 * 0.08, 0.0, TAILS, True),  # of a kurtosis of 0.1 in noise of 3 DN
        (81 * 0.03, 0.0, TAILS, False),
        (81 * 0.03, 12.0, TAILS, True),
        (81 * 0.01, 12.0, TAILS, False),  # a dozen spikes do not make noise lean
        (0.0, 12.0, TAILS, False),
        (81 * 0.08, 0.0, "rts", True),
        (81 * 0.08, 0.0, "row_noise", False),
    ],
)
def test_tails_as_spikes_feign_them_that_are_too_low_are_denied(
    low_dn4: float, leaning: float, kind: str, *, denied: bool
) -> None:
    state = _state(0.1, 0.0)
    state.setting.low_spikes_dn4 = {"dark": low_dn4} if low_dn4 else {}
    dark = state.setting.layout.exposures[0]
    state.setting.layout.uniform = [dark]
    state.null.sd = np.full(2, 0.01)
    state.vector.keys = (state.vector.keys[0], replace(state.vector.keys[1], statistic="skewness"))
    state.null.departures = lambda _: np.array([0.0, leaning])
    assert (underlaid(state, kind, WITHOUT) is not None) is denied
