"""Of planes of odd size the last bin of a line's spectrum is one like the others."""

import pytest

from analysis.mismatch.bank.coherent import SpectrumSums

FRAMES, RAISED = 1000.0, 3.0
ERROR = RAISED / FRAMES**0.5


@pytest.mark.parametrize(("columns", "seen"), [(128, False), (129, True)])
def test_the_last_bin_counts_where_it_is_complex(columns: int, *, seen: bool) -> None:
    """Columns that alternate in a plane of 129 of them are half a bin off its last one."""
    sums = SpectrumSums((64, columns))
    sums.seen = int(FRAMES)
    for power in (sums.power, sums.relative, sums.columns, *sums.rows.values()):
        power[:] = FRAMES
    for key, fine in sums.fine.items():
        fine[:] = FRAMES
        sums.weight[key] = [FRAMES, FRAMES]
    sums.columns[-1] *= RAISED
    value, _ = sums.numbers()["column_spectrum_peak"]
    peak = sums.column_peak()
    assert peak is not None
    assert (value > 8.0) is seen
    assert abs(peak.power - (RAISED if seen else 1.0)) < ERROR
    if seen:
        assert abs(peak.fx - 64 / columns) < 1e-9
