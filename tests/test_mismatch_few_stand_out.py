"""Few pixels or lines that stand far out make no law of lines, and no greens that differ."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.fewfixed import of_few_that_stand_out
from dsis.effects import registry
from mismatch_recordings import FEW_LEVELS, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

Array = NDArray[np.float64]
ROWS, COLUMNS = 48, 64
COLUMN_FPN = registry()["column_fpn"](sigma_dn=1.0)
ROW_PRNU = registry()["row_prnu"](sigma_percent=0.3)
GREENS = registry()["channel_imbalance"](gain_percent=0.4)
ODD_ROWS = registry()["tap_mismatch"](gain_percent=0.4, regions="even_odd_rows")
HALVES = registry()["tap_mismatch"](gain_percent=0.4)


def _state(maps: dict[tuple[str, str], Array]) -> Any:
    """Return a state of maps whose pixels have noise 1, in DN at 100 DN of signal."""
    return SimpleNamespace(
        setting=SimpleNamespace(
            seen=SimpleNamespace(images={key: (own, 1.0) for key, own in maps.items()}),
            layout=SimpleNamespace(
                regressors=lambda _: SimpleNamespace(scales={"gain": 100.0, "offset": 1.0})
            ),
        )
    )


def _noise(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal((ROWS, COLUMNS))


def test_two_columns_are_no_law_of_columns() -> None:
    image = _noise(1)
    image[:, [20, 41]] += [8.0, -5.0]
    denial = of_few_that_stand_out(_state({("MONO", "offset"): image}), COLUMN_FPN)
    assert denial is not None
    assert denial.why.startswith("few lines")
    every = _noise(2) + np.random.default_rng(3).standard_normal(COLUMNS)
    assert of_few_that_stand_out(_state({("MONO", "offset"): every}), COLUMN_FPN) is None
    every[:, 20] += 8.0  # beside a law of all columns one stands out
    assert of_few_that_stand_out(_state({("MONO", "offset"): every}), COLUMN_FPN) is None
    assert of_few_that_stand_out(_state({("MONO", "offset"): _noise(4)}), COLUMN_FPN) is None


def test_pixels_of_some_rows_are_no_gains_of_rows() -> None:
    """Sites that focus, every eighth of every eighth row."""
    image = 3 * _noise(5)
    image[3::8, 2::8] -= 60.0
    denial = of_few_that_stand_out(_state({("MONO", "gain"): image}), ROW_PRNU)
    assert denial is not None
    assert denial.why.startswith("few pixels")


@pytest.mark.parametrize(("gains", "denied"), [(1.0, False), (0.0, True)])
def test_hits_that_make_most_of_the_noise_hide_no_gains_of_rows(gains: float, denied: bool) -> None:
    """Two pixels of a hundred were hit; the others have a third of the noise that is expected."""
    rng = np.random.default_rng(6)
    image = 0.3 * (_noise(7) + gains / COLUMNS**0.5 * 4 * rng.standard_normal((ROWS, 1)))
    image[rng.random(image.shape) < 0.02] += 7.0
    denial = of_few_that_stand_out(_state({("MONO", "gain"): image}), ROW_PRNU)
    assert (denial is not None) == denied


def test_a_map_without_noise_denies_nothing() -> None:
    """Codes that never change: rows differ by whole steps, and few pixels stand out."""
    image = np.repeat(np.arange(ROWS) % 3.0, COLUMNS).reshape(ROWS, COLUMNS)
    image[5, ::16] += 30.0
    assert of_few_that_stand_out(_state({("MONO", "gain"): image}), ROW_PRNU) is None


@pytest.mark.parametrize("effect", [GREENS, ODD_ROWS])
@pytest.mark.parametrize("lines", [True, False])
def test_few_that_stand_out_make_the_greens_differ(effect: Any, *, lines: bool) -> None:
    maps = {(name, "gain"): _noise(k) for k, name in enumerate(("R", "Gr", "Gb", "B"))}
    assert of_few_that_stand_out(_state(maps), effect) is None
    if lines:
        maps["Gr", "gain"][:, 9] += 0.4 * COLUMNS  # 0.4 DN of 100 in the mean
    else:
        maps["Gr", "gain"][::8, ::8] += 0.4 * 64
    denial = of_few_that_stand_out(_state(maps), effect)
    assert denial is not None
    assert "greens" in denial.why
    other = {key: own for key, own in maps.items() if key[0] in ("R", "Gr")}
    assert of_few_that_stand_out(_state(other), effect) is None
    assert of_few_that_stand_out(_state(maps), HALVES) is None


def test_pixels_of_odd_rows_make_no_amplifiers_of_them() -> None:
    image = 3 * _noise(5)
    image[3::8, 2::8] -= 60.0
    denial = of_few_that_stand_out(_state({("MONO", "gain"): image}), ODD_ROWS)
    assert denial is not None
    assert denial.why.endswith("even and odd lines differ")
    image[1::2] += 4.0
    assert of_few_that_stand_out(_state({("MONO", "gain"): image}), ODD_ROWS) is None
    assert of_few_that_stand_out(_state({}), ODD_ROWS) is None


@pytest.mark.long
def test_sites_that_focus_are_named_by_no_word() -> None:
    """One of 64 pixels collects 6 % less light."""
    recording = recorded(camera(), 4, rows=64, columns=96, levels=FEW_LEVELS, lit=False)
    assert recording.stacks is not None
    for name, frames in recording.stacks.items():
        if name.startswith("flat"):
            level = FEW_LEVELS[int(name.removeprefix("flat-"))]
            frames[:, 3::8, 2::8] -= np.uint16(0.06 * level)
    found = find_mismatch(camera(), recording)
    assert not found.omitted_physics
    assert "outlying_pixels" in {one.statistic for one in found.unexplained}
