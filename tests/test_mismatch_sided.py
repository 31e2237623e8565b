"""Charge that transfer leaves behind is no crosstalk: neighbours share the more the farther out."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch.layout import sites
from analysis.mismatch.sidedneighbours import Sided, sided
from dsis.cfa import Cfa

Array = NDArray[np.float64]
FRAMES, ROWS, COLUMNS = 8, 96, 128
BLACK = 100.0


def _layout(cfa: Cfa = Cfa.MONO) -> Any:
    exposures = [
        SimpleNamespace(name=name, numbers=tuple(range(FRAMES))) for name in ("dark", "flat")
    ]
    size = {"rows": ROWS, "columns": COLUMNS}
    return SimpleNamespace(uniform=exposures, sites=sites(cfa), white_dn=4095.0, **size)


def _found(stacks: dict[str, Array], cfa: Cfa = Cfa.MONO) -> Sided:
    def frames(name: str) -> Iterator[Array]:
        yield from stacks[name]

    return sided(_layout(cfa), frames)


def _stacks(share: Array, seed: int) -> dict[str, Array]:
    """Return a dark and a flat; of each electron's noise a share goes to the row before."""
    rng = np.random.default_rng(seed)
    found = {}
    for name, signal in (("dark", 0.0), ("flat", 400.0)):
        light = rng.normal(signal, signal**0.5, (FRAMES, ROWS, COLUMNS))
        moved = light * share[:, np.newaxis]
        mixed = light - moved
        mixed[:, :-1] += moved[:, 1:]
        found[name] = np.rint(BLACK + mixed + rng.normal(0, 3.0, light.shape))
    return found


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("seed", range(3))
def test_a_share_that_is_the_same_everywhere_is_crosstalk(cfa: Cfa, seed: int) -> None:
    found = _found(_stacks(np.full(ROWS, 0.04), seed), cfa)
    assert found.denial("crosstalk") is None
    assert abs(found.apart) < 5 * found.error


@pytest.mark.parametrize("cfa", [Cfa.MONO, Cfa.RGGB])
@pytest.mark.parametrize("seed", range(3))
def test_a_share_that_grows_from_the_read_out_on_is_none(cfa: Cfa, seed: int) -> None:
    """0 to 12 per cent: outer thirds share 2 and 10, which differ by 4 / 3 of the mean."""
    found = _found(_stacks(np.linspace(0.0, 0.12, ROWS), seed), cfa)
    assert found.apart == pytest.approx(4 / 3, abs=4 * found.error + 0.1)
    for kind in ("crosstalk", "spatial_filtering"):
        denial = found.denial(kind)
        assert denial is not None
        assert "one side" in denial.why
    assert found.denial("row_noise") is None


@pytest.mark.parametrize("seed", range(3))
def test_white_noise_and_lines_that_move_say_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.normal(0, 4.0, (FRAMES, ROWS, 1))
    stacks = {name: own + rows for name, own in _stacks(np.zeros(ROWS), seed).items()}
    assert _found(stacks).denial("crosstalk") is None
    clipped = {name: (own - own.mean()).clip(0) for name, own in stacks.items()}
    assert _found(clipped) == Sided()


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("tilt", [0.6, 0.9])
def test_crosstalk_under_uneven_light_is_not_denied(tilt: float, seed: int) -> None:
    """Where there is more light there is more of its noise, of which the same share crosses."""
    rng = np.random.default_rng(seed)
    level = 400.0 * np.linspace(1 - tilt, 1 + tilt, ROWS)[:, np.newaxis]
    light = rng.normal(level, level**0.5, (FRAMES, ROWS, COLUMNS))
    mixed = light * (1 - 0.03)
    mixed[:, :-1] += 0.03 * light[:, 1:]
    stacks = _stacks(np.full(ROWS, 0.03), seed)
    stacks["flat"] = np.rint(BLACK + mixed + rng.normal(0, 3.0, light.shape))
    assert _found(stacks).denial("crosstalk") is None


def _hit(stacks: dict[str, Array], seed: int, hits: int, dn: float, parts: int = 3) -> None:
    """Add hits to each third of the rows, or only to the first ones."""
    rng, third = np.random.default_rng(seed), ROWS // 3
    for frame in (frame for own in stacks.values() for frame in own):
        for part in range(parts):
            rows = rng.integers(0, third, hits) + part * third
            frame[rows, rng.integers(0, COLUMNS, hits)] += dn


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("hits", "dn"), [(8, 2000.0), (32, 600.0)])
@pytest.mark.parametrize("parts", [1, 3])
def test_hits_say_nothing_of_what_neighbours_share(
    hits: int, dn: float, parts: int, seed: int
) -> None:
    stacks = _stacks(np.full(ROWS, 0.04), seed)
    _hit(stacks, seed, hits, dn, parts)
    assert _found(stacks).denial("crosstalk") is None


@pytest.mark.parametrize("seed", range(2))
def test_hits_side_by_side_on_one_side_say_nothing_either(seed: int) -> None:
    rng, stacks = np.random.default_rng(seed), _stacks(np.full(ROWS, 0.04), seed)
    for frame in (frame for own in stacks.values() for frame in own):
        y, x = rng.integers(0, ROWS // 3, 12), rng.integers(0, COLUMNS - 1, 12)
        frame[y, x] += 600.0
        frame[y, x + 1] += 600.0
    assert _found(stacks).denial("crosstalk") is None


@pytest.mark.parametrize("quiet", [False, True])
@pytest.mark.parametrize("dn", [0.0, 600.0, 2500.0])
def test_charge_left_behind_is_seen_beside_hits_and_a_quiet_frame(dn: float, quiet: bool) -> None:
    stacks = _stacks(np.linspace(0.0, 0.12, ROWS), 1)
    _hit(stacks, 1, 8, dn)
    if quiet:
        for own in stacks.values():
            own[0] = np.rint(own.mean(0) + 0.3 * (own[0] - own.mean(0)))
    found = _found(stacks)
    assert found.denial("crosstalk") is not None
    assert found.apart == pytest.approx(4 / 3, abs=4 * found.error + 0.15)


def test_where_many_are_far_out_nothing_is_asked() -> None:
    stacks = _stacks(np.full(ROWS, 0.04), 1)
    _hit(stacks, 1, 160, 600.0)
    assert _found(stacks) == Sided()
