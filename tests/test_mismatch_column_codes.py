"""One converter's uneven codes are alike in all columns; converters of columns have their own."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.mismatch import find_mismatch
from analysis.mismatch.columncodes import ColumnCodes, column_codes
from analysis.mismatch.taking import layout_of
from dsis.effects import Effect, registry
from mismatch_recordings import FEW_LEVELS, InMemory, camera, recorded

pytestmark = pytest.mark.usefixtures("unproven")

ROWS, COLUMNS, FRAMES = 64, 96, 12
Codes = NDArray[np.uint16]


def _effect(kind: str, **given: object) -> Effect:
    return registry()[kind].model_validate({"kind": kind, **given})


DNL = _effect("adc_dnl", rms_lsb=0.08)
LEANING = _effect("shading", falloff_percent=0.0, tilt_down_percent=3.0, tilt_right_percent=8.0)
UNEVEN = _effect("column_fpn", sigma_dn=6.0)


def _recorded(
    *effects: Effect, cfa: str = "MONO", seed: int = 1, read_dn2: float = 20.0
) -> InMemory:
    true = camera(*effects, cfa=cfa, segments=((0.5, read_dn2, None),))
    return recorded(true, seed, rows=ROWS, columns=COLUMNS, frames=FRAMES, levels=FEW_LEVELS)


def _found(recording: InMemory) -> ColumnCodes:
    assert recording.stacks is not None
    stacks = recording.stacks
    numbers = {e.name: tuple(range(len(e.frames))) for e in recording.exposures}
    layout = layout_of(recording, numbers, lambda name, which: stacks[name][list(which)])
    found = column_codes(layout, stacks.__getitem__)
    assert found is not None
    return found


def _stuck(recording: InMemory, every: int) -> InMemory:
    """Return a recording of which one column in so many has bit 1 stuck at one."""
    stacks: dict[str, Codes] = {}
    for name, frames in (recording.stacks or {}).items():
        stacks[name] = frames.copy()
        stacks[name][:, :, 5::every] |= 2
    return replace(recording, stacks=stacks)


@pytest.mark.parametrize("cfa", ["MONO", "RGGB"])
@pytest.mark.parametrize("beside", [(), (LEANING,), (UNEVEN,), (UNEVEN, LEANING)])
def test_widths_of_one_converter_are_shared(cfa: str, beside: tuple[Effect, ...]) -> None:
    """Whatever codes a column's offset and the light there bring it to."""
    found = _found(_recorded(DNL, *beside, cfa=cfa))
    assert found.own > 4 * found.own_error
    error = np.hypot(found.own_error, found.shared_error)
    assert found.shared == pytest.approx(found.own, abs=5 * error)
    assert found.denial() is None


@pytest.mark.parametrize("sigma_dn", [1.0, 2.0, 6.0])
def test_so_are_they_in_noise_of_two_codes(sigma_dn: float) -> None:
    """Of which histograms are hardly smooth over nine."""
    uneven = _effect("column_fpn", sigma_dn=sigma_dn)
    found = _found(_recorded(DNL, uneven, read_dn2=4.5))
    assert found.own > 4 * found.own_error
    assert found.denial() is None


@pytest.mark.parametrize("parts", [2, 4])
def test_two_converters_in_turn_are_not_denied_and_more_are(parts: int) -> None:
    """Of two taps each column is like half of the others, of four like a fourth."""
    taps = [_recorded(_effect("adc_dnl", rms_lsb=0.2), seed=seed) for seed in range(parts)]
    mixed = dict(taps[0].stacks or {})
    for i, tap in enumerate(taps):
        for name, frames in (tap.stacks or {}).items():
            mixed[name] = mixed[name].copy()
            mixed[name][:, :, i::parts] = frames[:, :, i::parts]
    found = _found(replace(taps[0], stacks=mixed))
    assert found.shared / found.own == pytest.approx(1 / parts, rel=0.25)
    assert (found.denial() is None) == (parts == 2)


@pytest.mark.parametrize("read_dn2", [4.5, 9.0, 20.0])
@pytest.mark.parametrize("seed", range(2))
def test_codes_of_equal_width_show_nothing(seed: int, read_dn2: float) -> None:
    found = _found(_recorded(UNEVEN, seed=seed, read_dn2=read_dn2))
    assert abs(found.own) < 4 * found.own_error
    assert abs(found.shared) < 4 * found.shared_error
    assert found.denial() is None


@pytest.mark.parametrize("every", [8, 16, 32])
def test_a_bit_that_sticks_in_some_columns_is_theirs(every: int) -> None:
    """Of m columns of n that are alike, each is like m - 1 of n - 1 others."""
    found = _found(_stuck(_recorded(), every))
    share = (len(range(5, COLUMNS, every)) - 1) / (COLUMNS - 1)
    assert found.shared / found.own == pytest.approx(share, rel=0.3)
    assert found.denial() is not None


@pytest.mark.long
def test_it_is_named_no_converter_of_all_samples() -> None:
    found = find_mismatch(camera(), _stuck(_recorded(), 16), seed=1)
    assert "adc_dnl" not in {own.effect.kind for own in found.omitted_physics}
    assert "code_imbalance" in {m.statistic for m in found.unexplained}
