"""Light under which levels stay what was recorded, against the matrix of the exchange."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.mismatch.layout import Layout, Taken, sites
from analysis.mismatch.model import Model
from analysis.mismatch.relit import exchanged, relit
from dsis.camera import Camera
from dsis.cfa import Cfa
from dsis.effects import Effect
from dsis.effects.brighter_fatter import BrighterFatter
from dsis.effects.crosstalk import Crosstalk
from dsis.effects.dsnu import Dsnu
from dsis.effects.readout_memory import ReadoutMemory
from mismatch_recordings import camera


def having(*effects: Effect) -> Camera:
    """Return a camera whose highest code levels stay far below."""
    deep = {"black_level": 512, "white_level": 16383, "bit_depth": 14}
    return camera(*effects, cfa="GBRG").model_copy(update=deep)


def layout_of(lights: list[float | None], cfa: Cfa = Cfa.GBRG) -> Layout:
    flats = tuple(Taken(f"flat-{i}", "flat", 0.01, x, (0, 1)) for i, x in enumerate(lights))
    dark = Taken("dark-0", "dark", 0.01, 0.0, (0, 1))
    return Layout((dark, *flats), 64, 96, cfa, 512.0, 16383.0, {}, {})


def signals_of(lights: list[float], ratios: dict[str, float]) -> dict[str, np.ndarray]:
    signals = {"dark-0": np.zeros((2, 2))}
    for i, light in enumerate(lights):
        values = np.zeros((2, 2))
        for channel, at in sites(Cfa.GBRG).items():
            values[at] = light * ratios[channel]
        signals[f"flat-{i}"] = values
    return signals


COLOURS = {"R": 0.6, "Gr": 1.0, "Gb": 1.0, "B": 0.8}


def by_matrix(effect: Crosstalk, levels: np.ndarray) -> np.ndarray:
    """Return the levels far from all borders: a site has two neighbours alike along each axis."""
    f, made = effect.fraction, levels.copy()
    if effect.along != "columns":
        made += 2 * f * (levels[:, ::-1] - levels)
    if effect.along != "rows":
        made += 2 * f * (levels[::-1] - levels)
    return made


@pytest.mark.parametrize("along", ["rows", "columns"])
@pytest.mark.parametrize("lag", [1, 4, 15])
def test_a_memory_of_the_signal_mixes_the_colours_of_its_lag(along: str, lag: int) -> None:
    own = {"kind": "readout_memory", "fraction": 0.1, "lag_pixels": lag, "along": along}
    light = np.array([[400.0, 200.0], [100.0, 400.0]])
    other = light[:, ::-1] if along == "rows" else light[::-1]
    expected = 0.9 * light + 0.1 * (other if lag % 2 else light)
    signal = ReadoutMemory.model_validate({**own, "remembers": "signal"})
    np.testing.assert_allclose(exchanged([signal], light), expected, rtol=1e-6)
    noise = ReadoutMemory.model_validate(own)
    assert signal.exchanges
    assert not noise.exchanges
    np.testing.assert_array_equal(exchanged([noise], light), light)


@given(
    st.floats(0.001, 0.1),
    st.sampled_from(["both", "rows", "columns"]),
    st.lists(st.floats(0.2, 5.0), min_size=4, max_size=4),
)
def test_levels_after_an_exchange_are_those_of_its_matrix(
    fraction: float, along: str, values: list[float]
) -> None:
    effect = Crosstalk.model_validate({"fraction": fraction, "along": along})
    levels = 1000 * np.reshape(values, (2, 2))
    np.testing.assert_allclose(exchanged([effect], levels), by_matrix(effect, levels), rtol=1e-5)


@pytest.mark.parametrize("along", ["both", "rows", "columns"])
@pytest.mark.parametrize("lights", [[1.0, 2.0, 4.0], [None, None, None]])
@pytest.mark.parametrize(("fraction", "red"), [(0.02, 0.6), (0.09, 0.6), (0.02, 0.1)])
def test_with_crosstalk_besides_every_colour_keeps_its_level(
    along: str, lights: list[float | None], fraction: float, red: float
) -> None:
    effect = Crosstalk.model_validate({"fraction": fraction, "along": along})
    recorded = signals_of([500.0, 1000.0, 2000.0], COLOURS | {"R": red})
    made = relit(Model(having(), recorded), having(effect), layout_of(lights))
    where = sites(Cfa.GBRG)
    for name, signal in recorded.items():
        light, levels = made.signals[name], by_matrix(effect, made.signals[name])
        assert light[where["Gr"]] == light[where["Gb"]]  # one filter, one light
        for channel in ("R", "B"):
            assert levels[where[channel]] == pytest.approx(signal[where[channel]], rel=2e-4)
        greens = levels[where["Gr"]] + levels[where["Gb"]]
        assert greens == pytest.approx(2 * signal[where["Gr"]], rel=2e-4)


def test_where_no_light_gives_the_levels_it_stays() -> None:
    """Red alone has less than its neighbours give it."""
    recorded = signals_of([500.0, 1000.0], COLOURS | {"R": 0.05})
    made = relit(Model(having(), recorded), having(Crosstalk(fraction=0.2)), layout_of([1.0, 2.0]))
    assert made.signals is recorded


def test_without_it_the_light_is_what_it_had_been() -> None:
    light, layout = signals_of([500.0, 1000.0], COLOURS), layout_of([1.0, 2.0])
    own = having(Crosstalk(fraction=0.02))
    # Light whose levels with the effect are those of other light without it, and back.
    bare = relit(Model(own, light), having(), layout)
    again = relit(bare, own, layout)
    for name, signal in light.items():
        np.testing.assert_allclose(bare.signals[name], exchanged(own.effect, signal), rtol=1e-5)
        np.testing.assert_allclose(again.signals[name], signal, rtol=1e-5)


def test_light_that_is_known_keeps_its_ratios_though_an_exchange_grows() -> None:
    recorded = signals_of([500.0, 5000.0], COLOURS)
    own = having(BrighterFatter(per_dn=5e-6))
    known = relit(Model(having(), recorded), own, layout_of([1.0, 10.0])).signals
    np.testing.assert_allclose(known["flat-1"], 10 * known["flat-0"], rtol=1e-9)
    unknown = relit(Model(having(), recorded), own, layout_of([None, None])).signals
    red = sites(Cfa.GBRG)["R"]
    for name in ("flat-0", "flat-1"):
        levels = exchanged(own.effect, unknown[name])
        assert levels[red] == pytest.approx(recorded[name][red], rel=1e-5)
    # Neighbours that are brighter give to what is darker, the more the brighter all is.
    shares = [unknown[name][red] / recorded[name][red] for name in ("flat-0", "flat-1")]
    assert shares[1] < shares[0] < 1


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.GBRG])
def test_where_no_colours_exchange_charge_the_light_stays(cfa: Cfa) -> None:
    signals = signals_of([500.0, 1000.0], COLOURS)
    effect = Crosstalk(fraction=0.02) if cfa is Cfa.MONO else Dsnu(sigma_dn=2.0)
    plain = replace(Model(having(), signals))
    made = relit(plain, having(effect), layout_of([1.0, 2.0], cfa))
    assert made.signals is signals
    assert made.camera == having(effect)
